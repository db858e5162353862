//! Error messages for people: what is wrong, where (with the line of the file), and what to do.

use super::{Caller, CliError, ExperimentError, PathBuf, printable};
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use psidpd_core::document::FileError;
use psidpd_dynamics::run::RunError;
use psidpd_lammps_host::LammpsError;

/// The longest line, in bytes, that is shown with an error.
const LONGEST_LINE: usize = 2000;

/// The error of a verb.
#[derive(Debug)]
pub struct Failure {
    error: Box<dyn std::error::Error + Send + Sync + 'static>,
    /// The input files of the verb.
    inputs: Vec<String>,
}

impl<E: std::error::Error + Send + Sync + 'static> From<E> for Failure {
    fn from(error: E) -> Failure {
        Failure { error: Box::new(error), inputs: Vec::new() }
    }
}

impl Failure {
    /// Adds the input files of the verb, which are shown if the message names none of them.
    pub fn of(mut self, inputs: &[PathBuf]) -> Failure {
        self.inputs = inputs.iter().map(|path| printable(&path.display().to_string())).collect();
        self
    }

    /// The exit code is 1 for a run that stopped and for lost results, 2 for bad input.
    pub fn exit_code(&self) -> u8 {
        let stopped = run_error(&*self.error).is_some_and(RunError::is_stop);
        let lost = matches!(self.error.downcast_ref(), Some(CliError::Lost(_) | CliError::Unwritten { .. }));
        if stopped || lost { 1 } else { 2 }
    }

    /// Renders the error for the terminal, with escape sequences for colour. An error about a file shows the line.
    pub fn render(&self, caller: Caller) -> String {
        self.rendered(&Renderer::styled(), caller)
    }

    /// Renders the error as plain text.
    pub fn plain(&self, caller: Caller) -> String {
        self.rendered(&Renderer::plain(), caller)
    }

    fn rendered(&self, renderer: &Renderer, caller: Caller) -> String {
        let shows = |e: &&FileError| {
            let text = e.place.source.text();
            !text.is_empty() && text.lines().all(|line| line.len() <= LONGEST_LINE)
        };
        let located = file_error(&*self.error).filter(shows);
        // Text from a file may contain control characters, which are made printable in every part of the message.
        let text = located.map_or(String::new(), |e| printable(e.place.source.text()));
        let name = located.map_or("", |e| e.place.source.name());
        let title = match located {
            // The line itself shows the place.
            Some(e) if e.place.key.is_empty() => e.kind.to_string(),
            Some(e) => format!("{}: {}", e.place.key, e.kind),
            None => self.error.to_string(),
        };
        let mut report = Group::with_title(Level::ERROR.primary_title(printable(&title)));
        if let Some(e) = located {
            let place = AnnotationKind::Primary.span(e.place.span.clone()).label("here");
            report = report.element(Snippet::source(text).path(name).annotation(place));
        }
        let help = run_error(&*self.error).and_then(|error| error.help(caller));
        if let Some(help) = help.or_else(|| file_error(&*self.error)?.help.clone()) {
            report = report.element(Level::HELP.message(printable(&help)));
        }
        let title = printable(&title);
        if !self.inputs.is_empty()
            && !self.inputs.iter().any(|input| [name, &title].iter().any(|t| t.contains(input)))
        {
            report = report.element(Level::NOTE.message(format!("in {}", self.inputs.join(", "))));
        }
        renderer.render(&[report])
    }
}

/// The error inside a transparent error, whose own `source` skips that error.
fn unwrapped<'a>(error: &'a (dyn std::error::Error + 'static)) -> &'a (dyn std::error::Error + 'static) {
    match error.downcast_ref() {
        Some(ExperimentError::File(found)) => return found,
        Some(ExperimentError::Run(found)) => return found,
        Some(ExperimentError::Lammps(found)) => return unwrapped(found),
        _ => {}
    }
    match error.downcast_ref() {
        Some(LammpsError::File(found)) => found,
        Some(LammpsError::Native(found)) => found,
        _ => error,
    }
}

/// Finds the error about a model or scene file, wherever it is wrapped.
fn file_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a FileError> {
    let mut next = Some(error);
    while let Some(error) = next.map(unwrapped) {
        if let Some(RunError::File(found)) = error.downcast_ref() {
            return Some(found);
        }
        if let Some(found) = error.downcast_ref() {
            return Some(found);
        }
        next = error.source();
    }
    None
}

fn run_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a RunError> {
    unwrapped(error).downcast_ref()
}
