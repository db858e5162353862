//! Files and folders of experiments; errors name them.

use crate::ExperimentError;
use psidpd_formats::files::read_inside;
use std::fs::create_dir_all;
use std::path::{Path, PathBuf};

/// Creates a folder, if it is missing, and returns its absolute path: LAMMPS runs in folders of its own, so that paths must
/// not depend on ours.
pub fn absolute_folder(path: &Path) -> Result<PathBuf, ExperimentError> {
    create_dir_all(path).map_err(ExperimentError::at(path))?;
    path.canonicalize().map_err(ExperimentError::at(path))
}

/// The rows of a table of numbers: without comments, and words that are no numbers.
pub fn rows(path: &Path) -> Result<Vec<Vec<f64>>, ExperimentError> {
    let text = String::from_utf8(read_inside(path)?).map_err(ExperimentError::at(path))?;
    let row = |line: &str| line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    Ok(text.lines().filter(|l| !l.starts_with('#')).map(row).collect())
}
