use super::RunError;
use psidpd_formats::PathError;
use std::fs::{File, TryLockError, create_dir_all};
use std::path::{Path, PathBuf};

/// The folder of a run or of a sweep, locked against others. The lock ends with the process, even if that is killed.
#[derive(Debug)]
pub struct Folder {
    pub path: PathBuf,
    _lock: File,
}

impl Folder {
    /// Creates the folder if it is missing, and locks it.
    pub fn open(path: &Path) -> Result<Folder, RunError> {
        create_dir_all(path).map_err(PathError::at("write", path))?;
        let lock = File::open(path).map_err(PathError::at("write", path))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => Err(RunError::Busy { folder: path.to_owned() }),
            // Some file systems have no locks; what is there has none.
            _ => Ok(Folder { path: path.to_owned(), _lock: lock }),
        }
    }
}
