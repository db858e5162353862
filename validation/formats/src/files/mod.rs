//! The one door to files that are written, and to those that the folder of a run holds.
//!
//! Whatever is written is whole or not there: a [`Draft`] gets its name when it is complete. A file that exists is replaced for
//! one of three reasons: the user gave leave, psidpd made it, or it belongs to the run whose folder is open. An input of the
//! program is never replaced, nor removed. `tests/tests/door.rs` keeps other code from writing by other ways.
//!
//! * [`write_result`] is for a file that the user named: links are followed, pipes and devices are written to.
//! * The functions `…_inside` are for the folder of a run, which may come from anywhere: no link in it is followed, and only
//!   regular files are opened.
//! * [`work_folder`] makes a folder in which psidpd may replace everything.

mod draft;
mod inputs;
mod inside;
mod own;
mod result;

pub use super::error::PathError;
pub use draft::Draft;
pub use inputs::{Protected, is_protected, protect};
pub use inside::{
    copy_program, create_inside, draft_inside, folder_inside, is_empty_or_missing, names_inside, open_inside,
    open_inside_to_write, read_if_there, read_inside, read_json_if_there, remove_all, remove_folder_if_empty,
    remove_if_there, replace_inside, there,
};
pub use own::{PAGE, SOFTWARE, SVG, json_text, remove_tree, remove_work, temporary_folder, work_folder};
pub use result::{Existing, may_replace, open_lock, write_bytes, write_json, write_new, write_result};

use std::io::{self, ErrorKind};
use std::path::Path;

/// Turns the error of a missing file into success.
pub fn unless_missing(error: io::Error) -> io::Result<()> {
    if error.kind() == ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

/// A path as text for results in JSON, which cannot hold every path.
pub fn shown<S: serde::Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&path.display())
}

#[cfg(test)]
mod tests;
