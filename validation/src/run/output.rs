//! The files that a run leaves in its folder, checkpoints and times apart.

use super::dump::write_frame;
use super::error::RunError;
use super::growing::GrowingFile;
use super::simulation::Simulation;
use super::thermo::{Thermo, ThermoFile};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::Path;

/// The name of the dump.
const DUMP: &str = "dump.lammpstrj";

/// What a run writes at its end, however it ends.
const LAST: [&str; 3] = ["final.data", "last-good.data", "summary.json"];

/// The files that grow as a run goes.
pub(super) struct Output {
    thermo: Option<ThermoFile>,
    dump: Option<GrowingFile>,
}

impl Output {
    /// Empty files.
    pub fn create(scene: &Scene, folder: &Path) -> Result<Output, RunError> {
        remove_last(folder)?;
        let thermo = (scene.output.thermo > 0).then(|| ThermoFile::create(folder));
        let dump = (scene.output.dump > 0).then(|| GrowingFile::create(folder, DUMP));
        Ok(Output { thermo: thermo.transpose()?, dump: dump.transpose()? })
    }

    /// The files of a run that goes on, cut to the `lengths` of its checkpoint.
    pub fn reopen(folder: &Path, lengths: &BTreeMap<String, u64>) -> Result<Output, RunError> {
        remove_last(folder)?;
        let length = |name: &str| lengths.get(name).copied();
        let thermo = length(ThermoFile::NAME).map(|length| ThermoFile::reopen(folder, length));
        let dump = length(DUMP).map(|length| GrowingFile::reopen(folder, DUMP, length));
        Ok(Output { thermo: thermo.transpose()?, dump: dump.transpose()? })
    }

    /// Writes a row of totals, if they are wanted; says whether they are.
    pub fn row(&mut self, thermo: &Thermo) -> Result<bool, RunError> {
        match &mut self.thermo {
            None => Ok(false),
            Some(file) => file.row(thermo).map(|()| true),
        }
    }

    /// Writes a frame of the dump.
    pub fn frame(&mut self, simulation: &Simulation) -> Result<(), RunError> {
        match &mut self.dump {
            None => Ok(()),
            Some(file) => file.attempt(|file| write_frame(simulation, file)),
        }
    }

    /// How long each file is.
    pub fn lengths(&mut self) -> BTreeMap<String, u64> {
        self.files().map(|file| (file.name().to_owned(), file.length())).collect()
    }

    /// Brings everything to the disk.
    pub fn sync(&mut self) -> Result<(), RunError> {
        self.files().try_for_each(|file| file.sync())
    }

    fn files(&mut self) -> impl Iterator<Item = &mut GrowingFile> {
        self.thermo.as_mut().map(ThermoFile::file).into_iter().chain(&mut self.dump)
    }
}

/// What an earlier run, or an earlier end of this one, left is not of this one.
fn remove_last(folder: &Path) -> Result<(), RunError> {
    for name in LAST {
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(RunError::output(&path)(error)),
            _ => {}
        }
    }
    Ok(())
}
