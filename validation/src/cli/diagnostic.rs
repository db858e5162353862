//! Errors as a person sees them: what, where (with the line of the file), and what to do.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use psidpd_core::document::{FileError, printable};
use psidpd_dynamics::checkpoint::Caller;
use psidpd_dynamics::run::RunError;
use psidpd_experiments::calibrate::CalibrateError;
use psidpd_experiments::crosscheck::ValidateError;
use psidpd_experiments::from_eos::FromEosError;
use psidpd_experiments::sweep::SweepError;

/// The longest line, in bytes, that is shown with an error.
const LONGEST_LINE: usize = 2000;

/// A verb that could not be carried out.
#[derive(Debug)]
pub struct Failure(Box<dyn std::error::Error + Send + Sync + 'static>);

impl<E: std::error::Error + Send + Sync + 'static> From<E> for Failure {
    fn from(error: E) -> Failure {
        Failure(Box::new(error))
    }
}

impl Failure {
    /// 1 for a run that stopped on the way, 2 for bad input.
    pub fn exit_code(&self) -> u8 {
        if run_error(&*self.0).is_some_and(RunError::is_stop) { 1 } else { 2 }
    }

    /// For the terminal, with escape sequences for colour: an error about a file shows the line.
    pub fn render(&self, caller: Caller) -> String {
        self.rendered(&Renderer::styled(), caller)
    }

    /// The same as plain text.
    pub fn plain(&self, caller: Caller) -> String {
        self.rendered(&Renderer::plain(), caller)
    }

    fn rendered(&self, renderer: &Renderer, caller: Caller) -> String {
        let shows = |e: &&FileError| {
            let text = e.file().text();
            !text.is_empty() && text.lines().all(|line| line.len() <= LONGEST_LINE)
        };
        let located = file_error(&*self.0).filter(shows);
        // What was read stands in all of these as it was written.
        let text = located.map_or(String::new(), |e| printable(e.file().text()));
        let name = located.map_or("", |e| e.file().name());
        let title = match located {
            // The place is shown with the line itself.
            Some(e) if e.key().is_empty() => e.kind().to_string(),
            Some(e) => format!("{}: {}", e.key(), e.kind()),
            None => self.0.to_string(),
        };
        let mut report = Group::with_title(Level::ERROR.primary_title(printable(&title)));
        if let Some(e) = located {
            let place = AnnotationKind::Primary.span(e.span()).label("here");
            report = report.element(Snippet::source(text).path(name).annotation(place));
        }
        let help = run_error(&*self.0).and_then(|error| error.help(caller));
        if let Some(help) = help.or_else(|| Some(file_error(&*self.0)?.help()?.to_string())) {
            report = report.element(Level::HELP.message(printable(&help)));
        }
        renderer.render(&[report])
    }
}

/// What a transparent error wraps: its own `source` is the source of that.
fn unwrapped<'a>(error: &'a (dyn std::error::Error + 'static)) -> &'a (dyn std::error::Error + 'static) {
    match error.downcast_ref() {
        Some(ValidateError::File(found)) => return found,
        Some(ValidateError::Run(found)) => return found,
        _ => {}
    }
    if let Some(SweepError::File(found)) = error.downcast_ref() {
        return found;
    }
    match error.downcast_ref() {
        Some(FromEosError::File(found)) => return found,
        Some(FromEosError::Run(found)) => return found,
        Some(FromEosError::Calibrate(found)) => return unwrapped(found),
        _ => {}
    }
    match error.downcast_ref() {
        Some(CalibrateError::File(found)) => found,
        Some(CalibrateError::Run(found)) => found,
        _ => error,
    }
}

/// The error about a model or scene file, wherever it is wrapped.
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
