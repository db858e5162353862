//! `[output]`.

use psidpd_core::document::{FileError, Section};

/// What a run writes beside its final state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// Steps between rows of `thermo.csv`; 0 for none.
    pub thermo: u64,
    /// Steps between frames of `dump.lammpstrj`; 0 for none.
    pub dump: u64,
    /// Steps between frames of `trajectory.xyz`; 0 for none.
    pub xyz: u64,
    /// Steps between pictures in `snapshots/`; 0 for none.
    pub snapshot: u64,
    /// Steps between checkpoints; 0 for none but at the end of a run, however it ends. By default they
    /// come every ten minutes.
    pub checkpoint: Option<u64>,
}

impl Default for Output {
    fn default() -> Output {
        Output { thermo: 100, dump: 0, xyz: 0, snapshot: 0, checkpoint: None }
    }
}

/// Reads what is written.
pub fn read(root: &Section) -> Result<Output, FileError> {
    let mut output = Output::default();
    let Some(value) = root.get("output") else { return Ok(output) };
    let section = value.section()?;
    let intervals = [
        ("thermo", &mut output.thermo),
        ("dump", &mut output.dump),
        ("xyz", &mut output.xyz),
        ("snapshot", &mut output.snapshot),
    ];
    for (key, interval) in intervals {
        if let Some(value) = section.get(key) {
            *interval = value.count()?.value;
        }
    }
    if let Some(value) = section.get("checkpoint") {
        output.checkpoint = Some(value.count()?.value);
    }
    section.finish()?;
    Ok(output)
}
