//! The files of a run in its folder, except checkpoints and `timing.json`.

use super::frames::{DUMP, Frames, GSD, XYZ};
use super::growing::GrowingFile;
use super::thermo::HEADER;
use super::{RunError, Thermo, Timing};
use crate::checkpoint::{Checkpoint, ROWS as THERMO, Store, Written};
use crate::scene::Scene;
use psidpd_formats::About;
use psidpd_formats::files::{
    PathError, folder_inside, is_empty_or_missing, is_protected, names_inside, read_json_if_there,
    remove_all, remove_folder_if_empty, remove_if_there, replace_inside, there,
};
use psidpd_observe::Observation;
use psidpd_pictures::snapshot::SNAPSHOTS;
use psidpd_pictures::{VTK, remove_snapshots, remove_vtk, snapshots, vtk_files};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

/// Files of a run that a scene or a user may use as input.
pub const FILES: [&str; 6] = [THERMO, DUMP, XYZ, GSD, "final.data", "last-good.data"];

/// Files that are written when a run ends or stops.
const LAST: [&str; 5] = ["final.data", "last-good.data", OBSERVABLES, "summary.json", "report.html"];

/// The names of all files of runs, without those in folders.
fn names() -> impl Iterator<Item = &'static str> {
    FILES.into_iter().chain(LAST).chain(Store::FILES).chain([About::NAME, Timing::NAME])
}

/// Whether a new run in `folder` would remove or replace `input`, which is a file or the folder of another run.
pub(super) fn replaces(folder: &Path, input: &Path) -> bool {
    let (Ok(folder), Ok(input)) = (folder.canonicalize(), input.canonicalize()) else { return false };
    let name = input.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    input == folder || input.parent() == Some(&folder) && names().any(|own| own == name)
}

/// An input among the files that a new run in `folder` would remove or replace.
pub(super) fn input_among(folder: &Path) -> Option<PathBuf> {
    let named = names().map(|name| folder.join(name)).chain(named_tables(folder));
    named.chain(snapshots(folder)).chain(vtk_files(folder)).find(|path| is_protected(path))
}

/// What is in the way of a new run: it has the name of a file of runs, and no checkpoint tells which run made it.
pub(super) fn in_the_way(folder: &Path) -> Option<PathBuf> {
    let folders = [TABLES, SNAPSHOTS, VTK].map(|name| folder.join(name));
    let used = folders.into_iter().filter(|path| !is_empty_or_missing(path));
    names().map(|name| folder.join(name)).filter(|path| there(path)).chain(used).next()
}

/// Whether a run of this scene has begun in the folder, and was killed before its first checkpoint: its description is the first
/// file that a run writes.
pub(super) fn has_begun(scene: &Scene, folder: &Path) -> bool {
    let ended = LAST.iter().any(|name| there(&folder.join(name)));
    let found: Option<Value> = read_json_if_there(&folder.join(About::NAME)).ok().flatten();
    let same = |found| serde_json::to_value(super::about::about(scene)).is_ok_and(|own| own == found);
    !ended && found.is_some_and(same)
}

const OBSERVABLES: &str = "observables.json";
const TABLES: &str = "observables";

pub(super) struct Output {
    rows: Option<GrowingFile>,
    noted: Option<Written>,
    frames: Frames,
}

impl Output {
    /// Creates empty files, and a description of the run.
    pub fn create(scene: &Scene, folder: &Path) -> Result<Output, RunError> {
        remove_all(folder, &[THERMO, DUMP, XYZ, GSD])?;
        remove_tables(folder)?;
        remove_all(folder, &LAST)?;
        remove_snapshots(folder)?;
        remove_vtk(folder)?;
        super::about::about(scene).write(folder)?;
        let rows = scene.output.thermo > 0;
        let mut rows = rows.then(|| GrowingFile::create(folder, THERMO)).transpose()?;
        rows.iter_mut().try_for_each(|file| file.line(HEADER))?;
        Ok(Output::of(rows, Frames::create(scene, folder)?))
    }

    /// Opens the files of a resumed run and truncates them to what was written at its checkpoint; the scene may have more steps than
    /// the run had.
    pub fn reopen(scene: &Scene, folder: &Path, checkpoint: &Checkpoint) -> Result<Output, RunError> {
        remove_tables(folder)?;
        remove_all(folder, &LAST)?;
        let rows = GrowingFile::reopen(folder, THERMO, &checkpoint.files)?;
        Ok(Output::of(rows, Frames::reopen(scene, folder, checkpoint)?))
    }

    fn of(rows: Option<GrowingFile>, frames: Frames) -> Output {
        let mut output = Output { rows, noted: None, frames };
        output.note();
        output
    }

    /// Writes a row of totals if one is due, and returns whether it was.
    pub fn row(&mut self, thermo: &Thermo) -> Result<bool, PathError> {
        let Some(file) = &mut self.rows else { return Ok(false) };
        file.line(&thermo.line()).map(|()| true)
    }

    /// The files with all particles.
    pub fn frames(&mut self) -> &mut Frames {
        &mut self.frames
    }

    /// The record of the file of rows.
    pub fn rows(&self) -> Option<Written> {
        self.rows.as_ref().map(|file| file.written)
    }

    /// Notes what is written of each file that grows at its end alone, for a checkpoint of this step.
    pub fn note(&mut self) {
        self.noted = self.rows();
        self.frames.note();
    }

    /// Syncs all files to the disk, and returns what was noted last.
    pub fn sync(&mut self) -> Result<BTreeMap<String, Written>, RunError> {
        self.rows.iter_mut().try_for_each(GrowingFile::sync)?;
        let mut files = self.frames.sync()?;
        files.extend(self.noted.map(|rows| (THERMO.to_owned(), rows)));
        Ok(files)
    }
}

/// Writes `observables.json` and the tables in `observables/`, if there are any observations, and syncs them to the disk.
pub(super) fn write_observations(folder: &Path, observations: &[Observation]) -> Result<(), PathError> {
    if observations.is_empty() {
        return Ok(());
    }
    let tables = folder.join(TABLES);
    folder_inside(&tables).map_err(PathError::at("write", &tables))?;
    for observation in observations {
        let mut text = Vec::new();
        let path = tables.join(observation.file_name(observations));
        observation.csv(&mut text).map_err(PathError::at("write", &path))?;
        replace_inside(&path, &text, true)?;
    }
    write_json(&folder.join(OBSERVABLES), &observations)
}

/// Writes a value as indented JSON and syncs the file to the disk.
pub(super) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), PathError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| PathError::at("write", path)(e.into()))?;
    replace_inside(path, (text + "\n").as_bytes(), true)
}

/// Removes the tables that `observables.json` of an earlier run names, and their folder if it is then empty.
fn remove_tables(folder: &Path) -> Result<(), PathError> {
    let tables = folder.join(TABLES);
    let remove = || -> io::Result<()> {
        for table in named_tables(folder) {
            remove_if_there(&table)?;
        }
        if tables.is_symlink() { Ok(()) } else { remove_folder_if_empty(&tables) }
    };
    remove().map_err(PathError::at("write", &tables))
}

/// The tables that `observables.json` names and that are there.
fn named_tables(folder: &Path) -> Vec<PathBuf> {
    let tables = folder.join(TABLES);
    let all: Vec<Observation> =
        read_json_if_there(&folder.join(OBSERVABLES)).ok().flatten().unwrap_or_default();
    // A name in a file from elsewhere may be a path out of the folder, so only names of files there count.
    let names = names_inside(&tables);
    let is_named = |name: &&OsString| all.iter().any(|o| name.as_os_str() == o.file_name(&all).as_str());
    names.iter().filter(is_named).map(|name| tables.join(name)).collect()
}
