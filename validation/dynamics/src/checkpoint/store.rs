//! The checkpoints in the folder of a run.

use super::{Checkpoint, CheckpointError, NEWEST, format};
use psidpd_formats::files::{WriteError, remove_if_there};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

const BEFORE: &str = "checkpoint.old";
const UNFINISHED: &str = "checkpoint.new";

/// The checkpoints in a folder.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

/// A checkpoint that can be used.
#[derive(Debug)]
pub struct Found {
    pub checkpoint: Checkpoint,
    /// Why it is the one before the newest; `None` if it is the newest.
    pub fallback: Option<CheckpointError>,
}

impl Store {
    /// The names of all.
    pub const FILES: [&str; 3] = [UNFINISHED, BEFORE, NEWEST];

    /// Those in `folder`.
    pub fn new(folder: &Path) -> Store {
        Store { folder: folder.to_owned() }
    }

    /// The newest one.
    pub fn path(&self) -> PathBuf {
        self.folder.join(NEWEST)
    }

    /// Whether there is any.
    pub fn exists(&self) -> bool {
        [NEWEST, BEFORE].iter().any(|name| self.folder.join(name).symlink_metadata().is_ok())
    }

    /// Writes another one and keeps the newest as the one before. If that fails, those that are there stay.
    pub fn write(&self, checkpoint: &Checkpoint) -> Result<(), WriteError> {
        let new = self.folder.join(UNFINISHED);
        let newest = self.path();
        self.write_new(checkpoint, &new).map_err(|cause| {
            // A partial file only takes space.
            let _ = std::fs::remove_file(&new);
            WriteError { path: newest, cause }
        })
    }

    fn write_new(&self, checkpoint: &Checkpoint, new: &Path) -> io::Result<()> {
        let mut file = File::create(new)?;
        format::write(checkpoint, &mut file)?;
        file.sync_all()?;
        self.keep_as_before()?;
        std::fs::rename(new, self.path())?;
        self.sync()
    }

    /// Links the newest one as the one before, so that there is always at least one.
    fn keep_as_before(&self) -> io::Result<()> {
        let (newest, before) = (self.path(), self.folder.join(BEFORE));
        if !newest.exists() {
            return Ok(());
        }
        remove_if_there(&before)?;
        // Where there are no hard links, a run killed now is left with `checkpoint.old` alone; that will do.
        std::fs::hard_link(&newest, &before).or_else(|_| std::fs::rename(&newest, &before))
    }

    /// The newest checkpoint that is whole and that `usable` agrees with; `None` if there is none at all.
    ///
    /// # Errors
    /// What is wrong with the newest one, if the one before will not do either; a foreign one.
    pub fn find(
        &self,
        usable: impl Fn(&Checkpoint) -> Result<(), CheckpointError>,
    ) -> Result<Option<Found>, CheckpointError> {
        let load = |name: &str| {
            let checkpoint = format::read(&self.folder.join(name))?;
            usable(&checkpoint).map(|()| checkpoint)
        };
        let newest = match load(NEWEST) {
            Ok(checkpoint) => return Ok(Some(Found { checkpoint, fallback: None })),
            Err(error @ CheckpointError::Foreign { .. }) => return Err(error),
            Err(error) => error,
        };
        match load(BEFORE) {
            Ok(checkpoint) => Ok(Some(Found { checkpoint, fallback: Some(newest) })),
            Err(error @ CheckpointError::Foreign { .. }) => Err(error),
            Err(_) if !self.exists() => Ok(None),
            // A missing newest one is less informative.
            Err(error) => Err(if self.path().exists() { newest } else { error }),
        }
    }

    /// Makes the one before the newest, so that the next one written will not push it out.
    pub fn fall_back(&self) -> Result<(), WriteError> {
        let newest = self.path();
        std::fs::rename(self.folder.join(BEFORE), &newest)
            .and_then(|()| self.sync())
            .map_err(WriteError::at(&newest))
    }

    /// Removes all but the newest.
    pub fn keep_newest(&self) -> Result<(), WriteError> {
        self.remove(&[UNFINISHED, BEFORE])
    }

    /// Removes all.
    pub fn clear(&self) -> Result<(), WriteError> {
        self.remove(&Store::FILES)
    }

    fn remove(&self, names: &[&str]) -> Result<(), WriteError> {
        for name in names {
            let path = self.folder.join(name);
            remove_if_there(&path).map_err(WriteError::at(&path))?;
        }
        Ok(())
    }

    /// Brings names to the disk.
    fn sync(&self) -> io::Result<()> {
        File::open(&self.folder)?.sync_all()
    }
}
