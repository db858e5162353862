//! Writing files whole or not at all.

use super::FormatError;
pub use super::error::PathError;
use serde::{Serialize, de::DeserializeOwned};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Replaces a file so that readers see the old content or the new, never a part.
///
/// The bytes go to a temporary file in the same folder, which is flushed to disk and then renamed over
/// `path`. On failure nothing is left behind and an existing file keeps its content. If `path` is a symbolic
/// link, its target is replaced. Pipes, devices and the program's own output are written to directly.
pub fn write_atomically(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), PathError> {
    let path = path.as_ref();
    write(path, bytes).map_err(PathError::at("write", path))
}

/// Replaces a file by a value as indented JSON, as [`write_atomically`] does.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), PathError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| PathError::at("write", path)(e.into()))?;
    write_atomically(path, (text + "\n").as_bytes())
}

/// Replaces a file whole, through the file `new` in its folder, without waiting for the disk. A killed run leaves at most
/// `new`.
pub fn replace_through(new: &Path, path: &Path, bytes: &[u8]) -> Result<(), PathError> {
    fs::write(new, bytes).and_then(|()| fs::rename(new, path)).map_err(PathError::at("write", path))
}

pub fn remove_if_there(path: &Path) -> io::Result<()> {
    fs::remove_file(path).or_else(unless_missing)
}

/// Removes those of some files in a folder that exist.
pub fn remove_all(folder: &Path, names: &[&str]) -> Result<(), PathError> {
    names
        .iter()
        .map(|name| folder.join(name))
        .try_for_each(|path| remove_if_there(&path).map_err(PathError::at("write", &path)))
}

/// The text of a file; `None` if the file does not exist.
pub fn read_if_there(path: &Path) -> Result<Option<String>, PathError> {
    match fs::read_to_string(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        read => read.map(Some).map_err(PathError::at("read", path)),
    }
}

/// The content of a JSON file; `None` if the file does not exist.
pub fn read_json_if_there<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, FormatError> {
    let parse = |text: String| serde_json::from_str(&text);
    let found = read_if_there(path)?.map(parse).transpose();
    found.map_err(FormatError::content(path))
}

/// Turns the error of a missing file into success.
pub fn unless_missing(error: io::Error) -> io::Result<()> {
    if error.kind() == ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let about = match fs::metadata(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return replace(&end_of_links(path)?, bytes),
        about => about?,
    };
    let output = rustix::fs::fstat(io::stdout())?;
    if (about.dev(), about.ino()) == (output.st_dev, output.st_ino) {
        let mut output = io::stdout().lock();
        output.write_all(bytes)?;
        output.flush()
    } else if about.is_file() || about.is_dir() {
        replace(&fs::canonicalize(path)?, bytes)
    } else {
        File::options().write(true).open(path)?.write_all(bytes)
    }
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

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if path.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // The file is opened here for two reasons: the user's mask decides its permissions, and an error does not name the
    // temporary file.
    let mut code = None;
    let open = |temporary: &Path| {
        let file = File::options().write(true).create_new(true).open(temporary);
        file.inspect_err(|e| code = e.raw_os_error())
    };
    let made = tempfile::Builder::new().prefix(".psidpd-").make_in(folder, open);
    let mut file = made.map_err(|e| code.map_or(e, io::Error::from_raw_os_error))?;
    file.as_file_mut().write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    use std::os::unix::fs::symlink;

    #[test]
    fn writes_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_unwritable_folder_is_named_with_the_cause() {
        let folder = tempfile::tempdir().unwrap();
        let blocker = folder.path().join("blocker");
        std::fs::write(&blocker, b"").unwrap();
        for (path, cause) in [
            (blocker.join("a.txt"), io::ErrorKind::NotADirectory),
            (folder.path().join("none/a.txt"), io::ErrorKind::NotFound),
        ] {
            let error = write_atomically(&path, b"x").unwrap_err();
            let text = error.to_string();
            assert!(text.contains(path.to_str().unwrap()), "{text}");
            let found = error.cause;
            assert_eq!(found.kind(), cause);
            assert!(text.contains(&found.to_string()), "{text}");
            assert!(!text.contains(".psidpd-"), "{text}");
        }
    }

    /// The target of a link is replaced, or created if it does not exist, and the link stays.
    #[test]
    fn links_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second, file] = ["first", "second", "inner/file"].map(|name| folder.path().join(name));
        std::fs::create_dir(folder.path().join("inner")).unwrap();
        symlink("second", &first).unwrap();
        symlink("inner/file", &second).unwrap();
        for bytes in [b"one", b"two"] {
            write_atomically(&first, bytes).unwrap();
            assert_eq!(std::fs::read(&file).unwrap(), bytes);
            assert!(first.is_symlink() && second.is_symlink() && !file.is_symlink());
        }
        symlink("round", folder.path().join("round")).unwrap();
        assert!(write_atomically(folder.path().join("round"), b"x").is_err());
    }

    /// A pipe gets the bytes and stays a pipe.
    #[test]
    fn what_is_no_file_is_written_to() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let link = folder.path().join("link");
        symlink("pipe", &link).unwrap();
        for path in [&pipe, &link] {
            let reader = std::thread::spawn({
                let pipe = pipe.clone();
                move || std::fs::read(pipe).unwrap()
            });
            write_atomically(path, b"bytes").unwrap();
            assert_eq!(reader.join().unwrap(), b"bytes");
            assert!(!std::fs::metadata(&pipe).unwrap().is_file());
        }
        write_atomically("/dev/null", b"bytes").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn a_folder_is_not_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        assert!(write_atomically(&inner, b"x").is_err());
        assert!(write_atomically("/", b"x").is_err());
        assert!(write_atomically("", b"x").is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
