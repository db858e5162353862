//! Standard output of the program.

use super::{ErrorKind, Table, Write, printable};
use std::fmt::Arguments;
use std::io;
use std::sync::Mutex;

/// The first error of standard output, most often a full disk.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a line as `println!` does, with control characters made harmless. A write error becomes an error of the verb at
/// its end. If the reader closes the pipe, as `| head` does, the program ends.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say::line(format_args!($($text)*)) };
}
pub(super) use say;

pub fn line(text: Arguments) {
    if write(text).is_err() {
        std::process::exit(0);
    }
}

/// Prints a line of a run, which continues if the reader closes the pipe.
pub fn whoever_listens(text: &str) {
    let _ = write(format_args!("{text}"));
}

/// Prints a table with colours. Its cells have no control characters.
pub fn table(table: &Table) {
    bytes((table.to_text() + "\n").as_bytes());
}

/// Prints a table of a run, which continues if the reader closes the pipe.
pub fn table_to_whoever_listens(table: &Table) {
    let _ = keep(io::stdout().lock().write_all((table.to_text() + "\n").as_bytes()));
}

/// Writes output for other programs, every byte unchanged.
pub fn bytes(bytes: &[u8]) {
    if keep(io::stdout().lock().write_all(bytes)).is_err() {
        std::process::exit(0);
    }
}

/// Flushes standard output, and returns the first error if any output is lost.
pub fn lost() -> Option<io::Error> {
    let _ = keep(io::stdout().flush());
    LOST.lock().unwrap_or_else(|lock| lock.into_inner()).take()
}

/// The error of a pipe that its reader has closed.
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
