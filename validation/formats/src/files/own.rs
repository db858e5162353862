//! How psidpd knows what it has made.

use super::inside::is_empty_or_missing;
use super::{Draft, PathError, open_inside, unless_missing};
use psidpd_core::document::open_regular;
use serde::Serialize;
use std::fs::{canonicalize, metadata};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
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

/// The content of the mark of a folder. It names this folder alone, so that a copy of the mark, or one in a folder from
/// elsewhere, marks nothing.
fn mark_of(folder: &Path) -> io::Result<String> {
    Ok(format!("psidpd made folder {} and replaces what is in it.\n", metadata(folder)?.ino()))
}

/// Whether the folder has its own mark, made by this user.
fn is_marked(folder: &Path) -> io::Result<bool> {
    let expected = mark_of(folder)?;
    let mark = open_inside(&folder.join(MARK))?;
    let is_own = mark.metadata()?.uid() == rustix::process::geteuid().as_raw();
    let mut found = Vec::new();
    mark.take(expected.len() as u64 + 1).read_to_end(&mut found)?;
    Ok(is_own && found == expected.as_bytes())
}

/// Whether the path lies in a folder that [`work_folder`] has made; links and steps back on the way to it are followed.
pub(super) fn is_in_work(path: &Path) -> bool {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let place = path.ancestors().skip(1).find_map(|folder| canonicalize(folder).ok());
    place.is_some_and(|place| place.ancestors().any(|folder| is_marked(folder).unwrap_or(false)))
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
        let mut draft = Draft::new(&mark, false)?;
        draft.write_all(mark_of(path)?.as_bytes())?;
        match draft.finish(false) {
            // Another process was faster.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            done => done,
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
