//! `[output]`: the files that a run writes.

use super::{FileError, Section, Value};

/// Steps between rows, frames and pictures; 0 writes none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    pub thermo: u64,
    pub dump: u64,
    pub xyz: u64,
    pub gsd: u64,
    pub vtk: u64,
    pub snapshot: u64,
    /// Steps between checkpoints; 0 writes one at the end of a run only, even of a run that stops early. By
    /// default one is written every ten minutes.
    pub checkpoint: Option<u64>,
}

impl Default for Output {
    fn default() -> Output {
        Output { thermo: 100, dump: 0, xyz: 0, gsd: 0, vtk: 0, snapshot: 0, checkpoint: None }
    }
}

impl Output {
    /// Whether a file gets the particles at the end of a step.
    pub fn writes_particles(&self, step: u64) -> bool {
        let intervals = [self.dump, self.xyz, self.gsd, self.vtk, self.snapshot];
        intervals.into_iter().any(|interval| every(interval, step))
    }
}

/// Whether a step is a multiple of an interval, of which 0 means never.
pub fn every(interval: u64, step: u64) -> bool {
    interval > 0 && step.is_multiple_of(interval)
}

pub fn read(root: &Section) -> Result<Output, FileError> {
    let default = Output::default();
    let Some(section) = root.read("output", Value::section)? else { return Ok(default) };
    let steps = |key: &str, left_out: u64| Ok(section.read(key, Value::count)?.unwrap_or(left_out));
    Ok(Output {
        thermo: steps("thermo", default.thermo)?,
        dump: steps("dump", default.dump)?,
        xyz: steps("xyz", default.xyz)?,
        gsd: steps("gsd", default.gsd)?,
        vtk: steps("vtk", default.vtk)?,
        snapshot: steps("snapshot", default.snapshot)?,
        checkpoint: section.read("checkpoint", Value::count)?,
    })
}
