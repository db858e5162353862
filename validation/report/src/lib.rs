//! Reports: checks and their results, tables, plots, a self-contained HTML page, and progress bars.
//!
//! No function panics on any input. Values that cannot be shown (a NaN, a control character) are left out or replaced, and
//! failures return a [`ReportError`].

mod chart;
mod error;
pub mod figure;
pub mod html;
pub mod plot;
pub mod progress;
pub mod quantity;
pub mod results;
pub mod run;
mod scale;
pub mod table;
mod text;

pub use error::ReportError;
pub use figure::Figure;
pub use html::{Item, Report, Section};
pub use plot::{Plot, Series, Style};
pub use progress::{Bar, Overall, Progress, to_stderr};
pub use results::{Check, Results};
pub use run::{Against, FALSE_ALARM, Headline, HeadlineValue, headline, run_report, write_run_report};
pub use table::{Align, Table};
pub use text::{named, typeset};

/// The lowest and the highest of the values that are finite; infinity and its negative if there are none.
pub fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite = values.filter(|v| v.is_finite());
    finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Each item once, in the order of their first occurrence.
pub fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for item in items {
        if !found.contains(&item) {
            found.push(item);
        }
    }
    found
}
