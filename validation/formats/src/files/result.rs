//! Files that the user named.

use super::own::{is_in_work, is_made_here, json_text};
use super::{Draft, PathError};
use serde::Serialize;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What the user says about files that exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Existing {
    /// Only what psidpd made is replaced.
    #[default]
    Keep,
    /// All may be replaced but inputs.
    Replace,
}

impl From<bool> for Existing {
    /// From the option `--overwrite`.
    fn from(overwrite: bool) -> Existing {
        if overwrite { Existing::Replace } else { Existing::Keep }
    }
}

/// Writes a file that the user named: whole, or not at all.
///
/// If `path` is a symbolic link, its target is written. Pipes, devices and the program's own output are written to directly.
///
/// # Errors
/// As [`may_replace`], and what the system says.
pub fn write_result(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PathError> {
    write_to(path, existing, write).map_err(PathError::at("write", path))
}

/// As [`write_result`], from memory.
pub fn write_bytes(path: &Path, existing: Existing, bytes: &[u8]) -> Result<(), PathError> {
    write_result(path, existing, |out| out.write_all(bytes))
}

/// Writes a file that must not exist, nor a link in its place.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<(), PathError> {
    let write = || {
        let mut draft = Draft::new(path, false)?;
        draft.write_all(bytes)?;
        draft.finish(true)
    };
    write().map_err(PathError::at("write", path))
}

/// As [`write_result`], a value as indented JSON.
pub fn write_json(path: &Path, existing: Existing, value: &impl Serialize) -> Result<(), PathError> {
    let text = json_text(value).map_err(|e| PathError::at("write", path)(e.into()))?;
    write_bytes(path, existing, text.as_bytes())
}

/// Refuses a file that [`write_result`] would refuse, before the work is done.
///
/// # Errors
/// A file exists that is an input, or that psidpd did not make and the user did not give leave to replace.
pub fn may_replace(path: &Path, existing: Existing) -> Result<(), PathError> {
    place(path, existing).map(drop).map_err(PathError::at("write", path))
}

/// Opens a file that locks are put on, and creates it if it is missing. Its content is not used.
pub fn open_lock(path: &Path) -> Result<File, PathError> {
    let mut options = File::options();
    options.create(true).truncate(false).read(true).write(true);
    options.open(path).map_err(PathError::at("open", path))
}

enum Place {
    New(PathBuf),
    Old(PathBuf),
    Output,
    NoFile,
}

fn place(path: &Path, existing: Existing) -> io::Result<Place> {
    let in_work = is_in_work(path);
    let found = if in_work { fs::symlink_metadata(path) } else { fs::metadata(path) };
    let about = match found {
        Err(error) if error.kind() == ErrorKind::NotFound => return end_of_links(path).map(Place::New),
        about => about?,
    };
    if in_work && !about.is_file() && !about.is_dir() {
        return Ok(Place::Old(path.to_owned()));
    }
    let output = rustix::fs::fstat(io::stdout())?;
    if (about.dev(), about.ino()) == (output.st_dev, output.st_ino) {
        return Ok(Place::Output);
    }
    if about.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if !about.is_file() {
        return Ok(Place::NoFile);
    }
    if super::is_protected(path) {
        let why = "it is an input and would be overwritten: choose another place for the results";
        return Err(io::Error::new(ErrorKind::InvalidInput, why));
    }
    if existing == Existing::Keep && !in_work && !is_made_here(path).unwrap_or(false) {
        let why = "it already exists: replace it with --overwrite, or choose another place";
        return Err(io::Error::new(ErrorKind::AlreadyExists, why));
    }
    Ok(Place::Old(fs::canonicalize(path)?))
}

fn write_to(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let (path, replaces) = match place(path, existing)? {
        Place::New(path) => (path, false),
        Place::Old(path) => (path, true),
        Place::Output => {
            let mut output = io::stdout().lock();
            write(&mut output)?;
            return output.flush();
        }
        Place::NoFile => return write(&mut File::options().write(true).open(path)?),
    };
    let mut draft = Draft::new(&path, replaces)?;
    write(&mut draft)?;
    draft.finish(true)
}

/// The path at which to create a new file: `path` itself, or the target of dangling links.
fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    // Linux follows at most 40 links.
    for _ in 0..40 {
        match fs::read_link(&path) {
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(rustix::io::Errno::LOOP.into())
}
