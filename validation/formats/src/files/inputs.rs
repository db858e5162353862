//! The inputs of the program, which nothing may replace.

use rustix::fs::Stat;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Device and number of each file, once for each guard that protects it.
static INPUTS: Mutex<Vec<(u64, u64)>> = Mutex::new(Vec::new());

fn inputs() -> MutexGuard<'static, Vec<(u64, u64)>> {
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Protects files until it is dropped.
#[derive(Debug, Default)]
#[must_use]
pub struct Protected(Vec<(u64, u64)>);

/// Keeps these files from being replaced or removed, by whatever name.
pub fn protect<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Protected {
    let found: Vec<_> = paths.into_iter().filter_map(|path| id(path.as_ref())).collect();
    inputs().extend(&found);
    Protected(found)
}

impl Drop for Protected {
    fn drop(&mut self) {
        let mut all = inputs();
        for id in &self.0 {
            if let Some(at) = all.iter().position(|other| other == id) {
                all.swap_remove(at);
            }
        }
    }
}

/// Whether the path leads to an input.
pub fn is_protected(path: &Path) -> bool {
    id(path).is_some_and(|id| inputs().contains(&id))
}

pub(super) fn has(file: &Stat) -> bool {
    inputs().contains(&(file.st_dev, file.st_ino))
}

fn id(path: &Path) -> Option<(u64, u64)> {
    let about = std::fs::metadata(path).ok().filter(|about| about.is_file())?;
    Some((about.dev(), about.ino()))
}
