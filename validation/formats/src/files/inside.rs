//! Files in the folder of a run, which may come from anywhere: a link in it is not followed, and what is no regular file is
//! not opened.

use super::draft::{open_folder, refuse_input};
use super::{Draft, PathError, unless_missing};
use crate::FormatError;
use crate::memory;
use rustix::fs::{AtFlags, Mode, OFlags, openat, unlinkat};
use rustix::io::Errno;
use serde::de::DeserializeOwned;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

fn open(path: &Path, flags: OFlags) -> io::Result<File> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "not a regular file");
    // Opening a device may act on it.
    match path.symlink_metadata() {
        Ok(about) if !about.is_file() => return Err(refused()),
        _ => {}
    }
    let name = path.file_name().ok_or_else(refused)?;
    let flags = flags | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = match openat(open_folder(path)?, name, flags, Mode::from_raw_mode(0o666)) {
        Err(Errno::LOOP) => return Err(refused()),
        opened => File::from(opened?),
    };
    if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }
}

pub fn open_inside(path: &Path) -> io::Result<File> {
    open(path, OFlags::RDONLY)
}

/// Opens a file of the run to continue it.
pub fn open_inside_to_write(path: &Path) -> io::Result<File> {
    refuse_input(&open_folder(path)?, path.file_name().unwrap_or_default())?;
    open(path, OFlags::RDWR)
}

/// Creates a file that must not exist.
pub fn create_inside(path: &Path) -> io::Result<File> {
    open(path, OFlags::RDWR | OFlags::CREATE | OFlags::EXCL)
}

/// Begins a file that replaces the one of its name.
pub fn draft_inside(path: &Path) -> io::Result<Draft> {
    Draft::new(path, true)
}

/// Replaces a file whole; it waits for the disk if `sync` is set.
pub fn replace_inside(path: &Path, bytes: &[u8], sync: bool) -> Result<(), PathError> {
    let write = || {
        let mut draft = Draft::new(path, true)?;
        io::Write::write_all(&mut draft, bytes)?;
        draft.finish(sync)
    };
    write().map_err(PathError::at("write", path))
}

/// Copies a program or a library, with the right to be executed, into the place of an older one.
pub fn copy_program(from: &Path, to: &Path) -> Result<(), PathError> {
    let copy = || {
        let mut draft = Draft::new(to, true)?;
        io::copy(&mut File::open(from)?, &mut draft)?;
        draft.allow_execution()?;
        draft.finish(false)
    };
    copy().map_err(PathError::at("write", to))
}

/// Whether anything has this name, a dangling link too.
pub fn there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Creates a folder in that of a run, if it is missing. A link to a folder is none.
pub fn folder_inside(path: &Path) -> io::Result<()> {
    match path.symlink_metadata() {
        Ok(about) if about.is_dir() => Ok(()),
        Ok(_) => Err(io::Error::new(ErrorKind::NotADirectory, "not a folder")),
        Err(_) => std::fs::create_dir(path),
    }
}

/// The names in a folder of a run; none if it is missing or a link.
pub fn names_inside(folder: &Path) -> Vec<OsString> {
    if !folder.symlink_metadata().is_ok_and(|about| about.is_dir()) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(|entry| Some(entry.ok()?.file_name())).collect()
}

/// Whether there is nothing at the path, or an empty folder.
pub fn is_empty_or_missing(path: &Path) -> bool {
    match path.symlink_metadata() {
        Ok(about) if about.is_dir() => std::fs::read_dir(path).is_ok_and(|mut all| all.next().is_none()),
        found => found.is_err(),
    }
}

/// Reads a whole file, if it fits into the memory.
pub fn read_inside(path: &Path) -> Result<Vec<u8>, PathError> {
    let read = || {
        let mut file = open_inside(path)?;
        let length = file.metadata()?.len();
        // Its content becomes several times as large.
        memory::fits(4.0 * length as f64, || "reading it needs".to_owned()).map_err(io::Error::other)?;
        let mut bytes = Vec::new();
        file.by_ref().take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(PathError::at("read", path))
}

/// The text of a file; `None` if the file does not exist.
pub fn read_if_there(path: &Path) -> Result<Option<String>, PathError> {
    match read_inside(path) {
        Err(error) if error.cause.kind() == ErrorKind::NotFound => Ok(None),
        read => {
            let text =
                String::from_utf8(read?).map_err(|_| io::Error::new(ErrorKind::InvalidData, "not UTF-8"));
            text.map(Some).map_err(PathError::at("read", path))
        }
    }
}

/// The content of a JSON file; `None` if the file does not exist.
pub fn read_json_if_there<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, FormatError> {
    let parse = |text: String| serde_json::from_str(&text);
    let found = read_if_there(path)?.map(parse).transpose();
    found.map_err(FormatError::content(path))
}

pub fn remove_if_there(path: &Path) -> io::Result<()> {
    let Some(name) = path.file_name() else { return Err(ErrorKind::InvalidInput.into()) };
    let remove = || {
        let folder = open_folder(path)?;
        refuse_input(&folder, name)?;
        Ok(unlinkat(&folder, name, AtFlags::empty())?)
    };
    remove().or_else(unless_missing)
}

pub fn remove_folder_if_empty(path: &Path) -> io::Result<()> {
    match std::fs::remove_dir(path) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::DirectoryNotEmpty) => Ok(()),
        done => done,
    }
}

/// Removes those of some files in a folder that exist.
pub fn remove_all(folder: &Path, names: &[&str]) -> Result<(), PathError> {
    names
        .iter()
        .map(|name| folder.join(name))
        .try_for_each(|path| remove_if_there(&path).map_err(PathError::at("write", &path)))
}
