//! The checkpoints in the folder of a run.

use super::{Checkpoint, CheckpointError, NEWEST, format};
use psidpd_formats::files::{PathError, draft_inside, open_inside, remove_all, remove_if_there, there};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

const BEFORE: &str = "checkpoint.old";
const UNFINISHED: &str = "checkpoint.new";

#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

#[derive(Debug)]
pub struct Found {
    pub checkpoint: Checkpoint,
    /// The reason why the newest checkpoint was not used; `None` if it was.
    pub fallback: Option<CheckpointError>,
}

impl Store {
    /// The names of all checkpoint files, the unfinished one included.
    pub const FILES: [&str; 3] = [UNFINISHED, BEFORE, NEWEST];

    pub fn new(folder: &Path) -> Store {
        Store { folder: folder.to_owned() }
    }

    pub fn path(&self) -> PathBuf {
        self.folder.join(NEWEST)
    }

    pub fn exists(&self) -> bool {
        [NEWEST, BEFORE].iter().any(|name| there(&self.folder.join(name)))
    }

    /// Writes a new checkpoint and keeps the newest as the previous one. If that fails, the present checkpoints stay.
    pub fn write(&self, checkpoint: &Checkpoint) -> Result<(), PathError> {
        self.write_new(checkpoint).map_err(PathError::at("write", &self.path()))
    }

    fn write_new(&self, checkpoint: &Checkpoint) -> io::Result<()> {
        let mut draft = draft_inside(&self.path())?;
        format::write(checkpoint, &mut draft)?;
        draft.sync()?;
        self.keep_as_before()?;
        draft.finish(false)?;
        self.sync()
    }

    /// Links the newest checkpoint as the previous one, so that one is always there.
    fn keep_as_before(&self) -> io::Result<()> {
        let (newest, before) = (self.path(), self.folder.join(BEFORE));
        // A link would make the previous one lead out of the folder.
        if !newest.symlink_metadata().is_ok_and(|about| about.is_file()) {
            return Ok(());
        }
        remove_if_there(&before)?;
        // Without hard links the newest is renamed; a run killed now leaves `checkpoint.old` alone, which suffices.
        std::fs::hard_link(&newest, &before).or_else(|_| std::fs::rename(&newest, &before))
    }

    /// Finds the newest checkpoint that is whole and that `usable` accepts; `None` if there is no checkpoint.
    /// The error is the fault of the newest checkpoint if the previous one cannot be used either.
    pub fn find(
        &self,
        usable: impl Fn(&Checkpoint) -> Result<(), CheckpointError>,
    ) -> Result<Option<Found>, CheckpointError> {
        let load = |name: &str| {
            let path = self.folder.join(name);
            let file = open_inside(&path).map_err(CheckpointError::unreadable(&path))?;
            let checkpoint = format::read(file, &path)?;
            usable(&checkpoint).map(|()| checkpoint)
        };
        let newest = match load(NEWEST) {
            Ok(checkpoint) => return Ok(Some(Found { checkpoint, fallback: None })),
            Err(error) if error.is_of_another_run() => return Err(error),
            Err(error) => error,
        };
        match load(BEFORE) {
            Ok(checkpoint) => Ok(Some(Found { checkpoint, fallback: Some(newest) })),
            Err(error) if error.is_of_another_run() => Err(error),
            Err(_) if !self.exists() => Ok(None),
            // That the newest checkpoint is missing says less than the fault of the previous one.
            Err(error) => Err(if there(&self.path()) { newest } else { error }),
        }
    }

    /// Makes the previous checkpoint the newest, so that the next write does not replace it.
    pub fn fall_back(&self) -> Result<(), PathError> {
        let newest = self.path();
        std::fs::rename(self.folder.join(BEFORE), &newest)
            .and_then(|()| self.sync())
            .map_err(PathError::at("write", &newest))
    }

    pub fn keep_newest(&self) -> Result<(), PathError> {
        remove_all(&self.folder, &[UNFINISHED, BEFORE])
    }

    pub fn clear(&self) -> Result<(), PathError> {
        remove_all(&self.folder, &Store::FILES)
    }

    /// Syncs the folder, so that its file names survive a power failure.
    fn sync(&self) -> io::Result<()> {
        File::open(&self.folder)?.sync_all()
    }
}
