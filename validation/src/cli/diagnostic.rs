//! Errors as a person sees them: what, where (with the line of the file), and what to do.

use crate::crosscheck::ValidateError;
use crate::run::RunError;
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use psidpd_core::document::{FileError, printable};
use std::fmt;

/// The longest line, in bytes, that is shown with an error.
const LONGEST_LINE: usize = 2000;

/// A verb that could not be carried out.
#[derive(Debug)]
pub struct Failure {
    error: Box<dyn std::error::Error + Send + Sync + 'static>,
    source: Option<NamedSource<String>>,
    stopped: bool,
}

impl Failure {
    /// Bad input, or something missing.
    pub fn new(error: impl std::error::Error + Send + Sync + 'static) -> Failure {
        let error: Box<dyn std::error::Error + Send + Sync> = Box::new(error);
        let source = file_error(&*error)
            .filter(|e| !e.file().text().is_empty())
            // Lines are shown whole.
            .filter(|e| e.file().text().lines().all(|line| line.len() <= LONGEST_LINE))
            .map(|e| NamedSource::new(e.file().name(), printable(e.file().text())).with_language("toml"));
        let stopped = matches!(run_error(&*error), Some(e) if e.is_stop());
        Failure { error, source, stopped }
    }

    /// 1 for a run that stopped on the way, 2 for bad input.
    pub fn exit_code(&self) -> u8 {
        if self.stopped { 1 } else { 2 }
    }
}

/// The error about a model or scene file, wherever it is wrapped.
fn file_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a FileError> {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(found) = error.downcast_ref::<FileError>() {
            return Some(found);
        }
        // Transparent errors report the source of what they wrap, not the wrapped error itself.
        if let Some(RunError::File(found)) = error.downcast_ref::<RunError>() {
            return Some(found);
        }
        if let Some(ValidateError::File(found)) = error.downcast_ref::<ValidateError>() {
            return Some(found);
        }
        next = error.source();
    }
    None
}

fn run_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a RunError> {
    if let Some(ValidateError::Run(found)) = error.downcast_ref::<ValidateError>() {
        return Some(found);
    }
    error.downcast_ref::<RunError>()
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match file_error(&*self.error) {
            // The place is shown with the line itself.
            Some(e) if self.source.is_some() && !e.key().is_empty() => format!("{}: {}", e.key(), e.kind()),
            Some(e) if self.source.is_some() => e.kind().to_string(),
            _ => self.error.to_string(),
        };
        // What was read stands in it as it was written.
        f.write_str(&printable(&text))
    }
}

impl std::error::Error for Failure {}

impl Diagnostic for Failure {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        if let Some(help) = run_error(&*self.error).and_then(RunError::help) {
            return Some(Box::new(help));
        }
        let help = file_error(&*self.error)?.help()?;
        Some(Box::new(help))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|s| s as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let error = file_error(&*self.error).filter(|_| self.source.is_some())?;
        let label = LabeledSpan::new_with_span(Some("here".to_owned()), error.span());
        Some(Box::new(std::iter::once(label)))
    }
}
