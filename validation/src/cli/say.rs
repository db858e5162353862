//! What is said on standard output.

use psidpd_core::document::printable;
use psidpd_report::Table;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::Mutex;

/// Why something that was said is lost: a full disk, most often.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Says a line as `println!` does, but that names from outside do nothing to a terminal, and that what cannot be written is an
/// error of the verb at its end. A reader that has seen enough, as `| head`, ends the program.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say::line(format_args!($($text)*)) };
}
pub(super) use say;

pub fn line(text: Arguments) {
    if write(text).is_err() {
        std::process::exit(0);
    }
}

/// The same in a run, which goes on without a reader.
pub fn whoever_listens(text: &str) {
    let _ = write(format_args!("{text}"));
}

/// A table, whose cells are clean, with its colours.
pub fn table(table: &Table) {
    bytes((table.to_text() + "\n").as_bytes());
}

/// The same in a run.
pub fn table_to_whoever_listens(table: &Table) {
    let _ = keep(io::stdout().lock().write_all((table.to_text() + "\n").as_bytes()));
}

/// What other programs read: every byte as it is.
pub fn bytes(bytes: &[u8]) {
    if keep(io::stdout().lock().write_all(bytes)).is_err() {
        std::process::exit(0);
    }
}

/// The first error, if anything is lost.
pub fn lost() -> Option<io::Error> {
    let _ = keep(io::stdout().flush());
    LOST.lock().unwrap_or_else(|lock| lock.into_inner()).take()
}

/// Nobody reads on.
struct Left;

fn write(text: Arguments) -> Result<(), Left> {
    let text = printable(&text.to_string()) + "\n";
    keep(io::stdout().lock().write_all(text.as_bytes()))
}

fn keep(done: io::Result<()>) -> Result<(), Left> {
    match done {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Left),
        Err(error) => {
            LOST.lock().unwrap_or_else(|lock| lock.into_inner()).get_or_insert(error);
            Ok(())
        }
    }
}
