use super::{ParticleOptions, draw_particles};
use psidpd_formats::files::{PathError, folder_inside, names_inside, remove_if_there, replace_inside};
use psidpd_formats::{FormatError, Frame};
use std::path::{Path, PathBuf};

pub const SNAPSHOTS: &str = "snapshots";

/// The name of the snapshot of a step. The order of the names is the order of the steps.
pub fn snapshot_name(step: u64) -> String {
    format!("particles-{step:010}.png")
}

/// The step of a snapshot, from its name.
pub(super) fn step_of(path: &Path) -> Option<u64> {
    path.file_stem()?.to_str()?.strip_prefix("particles-")?.parse().ok()
}

/// Writes a picture of the particles into the folder of snapshots of a run, whole or not at all, and returns its path.
/// The folder is created if it does not exist.
pub fn write_snapshot(folder: &Path, frame: &Frame) -> Result<PathBuf, FormatError> {
    let snapshots = folder.join(SNAPSHOTS);
    folder_inside(&snapshots).map_err(PathError::at("write", &snapshots))?;
    let path = snapshots.join(snapshot_name(frame.step));
    let (image, _) = draw_particles(frame, &ParticleOptions::default());
    // A run does not wait for a smaller file.
    let png = image.to_png_fast().map_err(FormatError::content(&path))?;
    // The resumed run makes the same step.
    replace_inside(&path, &png, false)?;
    Ok(path)
}

/// Removes the snapshots of an earlier run from the folder of a run.
pub fn remove_snapshots(folder: &Path) -> Result<(), FormatError> {
    for path in snapshots(folder) {
        remove_if_there(&path).map_err(PathError::at("write", &path))?;
    }
    Ok(())
}

/// The snapshots in the folder of a run, in the order of their steps.
pub fn snapshots(folder: &Path) -> Vec<PathBuf> {
    let folder = folder.join(SNAPSHOTS);
    let mut paths: Vec<PathBuf> = names_inside(&folder).iter().map(|name| folder.join(name)).collect();
    paths.retain(|p| {
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or("");
        name.starts_with("particles-") && name.ends_with(".png")
    });
    paths.sort();
    paths
}
