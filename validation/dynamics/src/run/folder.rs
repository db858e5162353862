use super::error::RunError;
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::path::{Path, PathBuf};

/// The folder of a run, which no other run may write to at the same time. The lock ends with the process,
/// however that ends.
pub(super) struct Folder {
    path: PathBuf,
    _lock: File,
}

impl Folder {
    /// Makes the folder if need be, and locks it.
    pub fn open(path: &Path) -> Result<Folder, RunError> {
        std::fs::create_dir_all(path).map_err(RunError::output(path))?;
        let lock = File::open(path).map_err(RunError::output(path))?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Err(rustix::io::Errno::WOULDBLOCK) => Err(RunError::Busy { folder: path.to_owned() }),
            // Some file systems have no locks: run there without one.
            _ => Ok(Folder { path: path.to_owned(), _lock: lock }),
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}
