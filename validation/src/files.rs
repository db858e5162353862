//! Writing files whole or not at all.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {cause}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    #[source]
    pub cause: std::io::Error,
}

/// Writes a file so that readers see the old content or the new, never a part.
///
/// The bytes go to a temporary file in the same folder, which is flushed to
/// disk and then renamed over `path`. On failure nothing is left behind and an
/// existing file keeps its content. A symbolic link at `path` is replaced.
pub fn write_atomically(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), WriteError> {
    let path = path.as_ref();
    replace(path, bytes).map_err(|cause| WriteError { path: path.to_owned(), cause })
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if path.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // Opened here, so that the user's mask decides the permissions as for any
    // new file, and so that an error does not name the temporary file.
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
