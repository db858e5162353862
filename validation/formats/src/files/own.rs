//! How psidpd knows what it has made.

use super::inside::is_empty_or_missing;
use super::{PathError, create_inside, unless_missing};
use psidpd_core::document::open_regular;
use serde::Serialize;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use tempfile::TempDir;

/// Marks a page, near its beginning.
pub const PAGE: &str = "<meta name=\"generator\" content=\"psidpd\"/>";

/// Marks a picture: the end of an SVG, a text at the beginning of a PNG, a comment at the beginning of a GIF.
pub const SVG: &str = "<!-- psidpd -->\n";
pub const SOFTWARE: [&str; 2] = ["Software", "psidpd"];

/// JSON has no comments: a blank before the last line break marks results.
const JSON: [&[u8]; 2] = [b"} \n", b"] \n"];

/// The file that marks a folder in which psidpd may replace everything.
const MARK: &str = ".psidpd";

/// A value as indented JSON, with the mark of psidpd's results.
pub fn json_text(value: &impl Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + " \n")
}

/// Whether a file is empty, or a page, a picture or JSON of psidpd.
pub(super) fn is_made_here(path: &Path) -> io::Result<bool> {
    let mut file = open_regular(path)?;
    let mut start = vec![0; 1024];
    let length = file.metadata()?.len();
    start.truncate(length.min(1024) as usize);
    file.read_exact(&mut start)?;
    let mut end = Vec::new();
    file.seek(SeekFrom::Start(length.saturating_sub(SVG.len() as u64)))?;
    file.take(SVG.len() as u64).read_to_end(&mut end)?;
    let has = |text: &str| start.windows(text.len()).any(|w| w == text.as_bytes());
    Ok(match &start[..] {
        [] => true,
        [b'{' | b'[', ..] => JSON.iter().any(|mark| end.ends_with(mark)),
        page if page.starts_with(b"<!DOCTYPE html>") => has(PAGE),
        svg if svg.starts_with(b"<svg") => end == SVG.as_bytes(),
        png if png.starts_with(b"\x89PNG") => has(&SOFTWARE.join("\0")),
        gif if gif.starts_with(b"GIF89a") => has(SOFTWARE[1]),
        _ => false,
    })
}

/// Whether the path lies in a folder that [`work_folder`] has made.
pub(super) fn is_in_work(path: &Path) -> bool {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    path.ancestors()
        .skip(1)
        .any(|folder| folder.join(MARK).symlink_metadata().is_ok_and(|mark| mark.is_file()))
}

/// Creates a folder in which psidpd may replace everything, or takes one that it created before.
///
/// # Errors
/// A folder that holds anything else.
pub fn work_folder(path: &Path) -> Result<(), PathError> {
    let mark = path.join(MARK);
    let make = || {
        if is_in_work(&mark) {
            return std::fs::create_dir_all(path);
        }
        if !is_empty_or_missing(path) {
            let why = "it holds files that psidpd did not make: choose another folder, or remove it";
            return Err(io::Error::new(ErrorKind::AlreadyExists, why));
        }
        std::fs::create_dir_all(path)?;
        match create_inside(&mark) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            created => created?.write_all(b"psidpd made this folder and replaces what is in it.\n"),
        }
    };
    make().map_err(PathError::at("use", path))
}

/// Removes a folder that [`work_folder`] made, with all that is in it.
pub fn remove_work(path: &Path) -> io::Result<()> {
    if is_in_work(&path.join(MARK)) {
        std::fs::remove_dir_all(path)
    } else {
        Err(ErrorKind::PermissionDenied.into())
    }
}

/// Removes a folder that only psidpd writes into by its name, such as an environment for LAMMPS, with all that is in it.
pub fn remove_tree(path: &Path) -> Result<(), PathError> {
    std::fs::remove_dir_all(path).or_else(unless_missing).map_err(PathError::at("remove", path))
}

/// A folder of that kind that ends with its use.
pub fn temporary_folder() -> Result<TempDir, PathError> {
    let folder = tempfile::tempdir().map_err(PathError::at("create a folder in", &std::env::temp_dir()))?;
    work_folder(folder.path())?;
    Ok(folder)
}
