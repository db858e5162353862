//! A file that gets its name when it is complete.

use super::inputs;
use rustix::fs::{
    AtFlags, CWD, Dir, FileType, FlockOperation, Mode, OFlags, RenameFlags, fchmod, flock, fstat, linkat,
    openat, renameat, renameat_with, statat, unlinkat,
};
use rustix::io::Errno;
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// A file without a name, in the folder that it will be in. A process that is killed leaves nothing of it; where the file
/// system has no such files it has a temporary name, and the next draft in the folder removes it.
#[derive(Debug)]
pub struct Draft {
    out: BufWriter<File>,
    folder: OwnedFd,
    name: OsString,
    /// The name of the file until it is complete.
    temporary: Option<OsString>,
    /// Whether it replaces a file of its name.
    replaces: bool,
}

impl Draft {
    /// Begins the file at `path`, whose last part is not followed if it is a link.
    pub(super) fn new(path: &Path, replaces: bool) -> io::Result<Draft> {
        let no_name = || io::Error::new(ErrorKind::InvalidInput, "not the name of a file");
        let name = path.file_name().ok_or_else(no_name)?.to_owned();
        let folder = open_folder(path)?;
        remove_leftovers(path, &folder);
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        // Its permissions are those that the user's mask leaves.
        let (file, temporary) = match openat(&folder, ".", flags, Mode::from_raw_mode(0o666)) {
            Ok(file) if Path::new("/proc/self/fd").is_dir() => (file, None),
            Err(error @ (Errno::NOSPC | Errno::DQUOT | Errno::ACCESS | Errno::ROFS)) => {
                return Err(error.into());
            }
            _ => named(&folder).map(|(file, name)| (file, Some(name)))?,
        };
        // Whoever removes what killed processes left spares locked files. Some file systems have no locks.
        let _ = flock(&file, FlockOperation::NonBlockingLockExclusive);
        Ok(Draft { out: BufWriter::new(file.into()), folder, name, temporary, replaces })
    }

    /// Lets those execute the file who may read it.
    pub(super) fn allow_execution(&mut self) -> io::Result<()> {
        let mode = fstat(self.out.get_ref())?.st_mode;
        Ok(fchmod(self.out.get_ref(), Mode::from_raw_mode(mode & 0o777 | (mode & 0o444) >> 2))?)
    }

    /// Waits until its bytes have reached the disk.
    pub fn sync(&mut self) -> io::Result<()> {
        self.out.flush()?;
        self.out.get_ref().sync_all()
    }

    /// Gives the file its name, after its bytes have reached the disk if `sync` is set.
    pub fn finish(mut self, sync: bool) -> io::Result<()> {
        if sync {
            self.sync()?;
        }
        self.out.flush()?;
        if self.replaces { self.replace() } else { self.appear() }
    }

    fn replace(&mut self) -> io::Result<()> {
        refuse_input(&self.folder, &self.name)?;
        if self.temporary.is_none() {
            self.temporary = Some(self.link_somewhere()?);
        }
        let from = self.temporary.as_deref().unwrap_or(&self.name);
        renameat(&self.folder, from, &self.folder, &self.name)?;
        self.temporary = None;
        Ok(())
    }

    /// Takes the name if no file has it.
    fn appear(&mut self) -> io::Result<()> {
        let Some(temporary) = &self.temporary else { return Ok(self.link(&self.name)?) };
        match linkat(&self.folder, temporary, &self.folder, &self.name, AtFlags::empty()) {
            Ok(()) => unlinkat(&self.folder, temporary, AtFlags::empty())?,
            Err(Errno::EXIST) => return Err(Errno::EXIST.into()),
            // The file system has no hard links.
            Err(_) => {
                renameat_with(&self.folder, temporary, &self.folder, &self.name, RenameFlags::NOREPLACE)?;
            }
        }
        self.temporary = None;
        Ok(())
    }

    fn link(&self, name: &OsStr) -> Result<(), Errno> {
        let own = format!("/proc/self/fd/{}", self.out.get_ref().as_fd().as_raw_fd());
        linkat(CWD, own, &self.folder, name, AtFlags::SYMLINK_FOLLOW)
    }

    fn link_somewhere(&self) -> io::Result<OsString> {
        loop {
            let name = random_name();
            match self.link(&name) {
                Ok(()) => return Ok(name),
                Err(Errno::EXIST) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}

impl Write for Draft {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl io::Seek for Draft {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(name) = &self.temporary {
            let _ = unlinkat(&self.folder, name, AtFlags::empty());
        }
    }
}

/// The folder that a file is in.
pub(super) fn open_folder(path: &Path) -> io::Result<OwnedFd> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Ok(openat(CWD, folder, OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())?)
}

pub(super) fn refuse_input(folder: &OwnedFd, name: &OsStr) -> io::Result<()> {
    match statat(folder, name, AtFlags::SYMLINK_NOFOLLOW) {
        Ok(file) if inputs::has(&file) => Err(io::Error::new(
            ErrorKind::InvalidInput,
            "it is an input: choose another place for the results",
        )),
        _ => Ok(()),
    }
}

const PREFIX: &str = ".psidpd-";
const LETTERS: usize = 6;

fn random_name() -> OsString {
    use std::hash::{BuildHasher, RandomState};
    let mut number = RandomState::new().hash_one(std::process::id());
    let mut name = PREFIX.to_owned();
    for _ in 0..LETTERS {
        name.push(char::from(b"abcdefghijklmnopqrstuvwxyz"[(number % 26) as usize]));
        number /= 26;
    }
    name.into()
}

fn named(folder: &OwnedFd) -> io::Result<(OwnedFd, OsString)> {
    loop {
        let name = random_name();
        let flags = OFlags::CREATE | OFlags::EXCL | OFlags::RDWR | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        match openat(folder, &name, flags, Mode::from_raw_mode(0o666)) {
            Ok(file) => return Ok((file, name)),
            Err(Errno::EXIST) => {}
            Err(error) => return Err(error.into()),
        }
    }
}

/// Removes the temporary files of processes that were killed, once for each folder.
fn remove_leftovers(path: &Path, folder: &OwnedFd) {
    static LOOKED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let place = path.parent().unwrap_or(path).to_owned();
    if !LOOKED.lock().unwrap_or_else(PoisonError::into_inner).insert(place) {
        return;
    }
    let me = rustix::process::geteuid().as_raw();
    for entry in Dir::read_from(folder).into_iter().flatten().filter_map(Result::ok) {
        let name = entry.file_name();
        let rest = name.to_bytes().strip_prefix(PREFIX.as_bytes());
        if rest.is_none_or(|rest| rest.len() != LETTERS || !rest.iter().all(u8::is_ascii_alphanumeric)) {
            continue;
        }
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let Ok(file) = openat(folder, name, flags, Mode::empty()) else { continue };
        let own = fstat(&file)
            .is_ok_and(|f| FileType::from_raw_mode(f.st_mode) == FileType::RegularFile && f.st_uid == me);
        if own && flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok() {
            let _ = unlinkat(folder, name, AtFlags::empty());
        }
    }
}
