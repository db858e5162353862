//! Checkpoints: one file holds all data that the rest of a run depends on.
//!
//! A run keeps two checkpoints in its folder, the newest in `checkpoint` and the previous one in
//! `checkpoint.old`. A new checkpoint is written to a third file, synced to the disk and renamed, so that one
//! whole checkpoint survives a kill or a power failure at any moment. The layout of the file is
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `psidpdCK` |
//! | 4 | version of the format, little-endian |
//! | 4 | CRC-32 of the payload |
//! | 8 | length of the payload |
//! | … | [`Checkpoint`] in the [postcard](https://postcard.jamesmunns.com/wire-format) format |
//!
//! Floating-point numbers are stored as their eight bytes. Postcard is not self-describing: a change of
//! [`Checkpoint`], or of what it holds, needs a new [`VERSION`].

mod error;
mod format;
mod identity;
mod store;
mod totals;
mod written;

pub use error::{Caller, CheckpointError};
pub use format::{VERSION, parse};
pub use identity::Identity;
pub use store::{Found, Store};
pub use totals::{Means, Sums, Thermo};
pub use written::Written;

use crate::particles::State;
use psidpd_core::document::open_regular;
use psidpd_observe::flux::Drag;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

const NEWEST: &str = "checkpoint";

/// The file of rows of totals.
pub const ROWS: &str = "thermo.csv";

/// All data that the rest of a run depends on, and that its files will tell.
///
/// Particle arrays keep the order of the run: sums of forces depend on it by rounding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    pub program: String,
    /// The instruction set of the pair forces: sums of forces depend on it by rounding.
    pub instructions: String,
    pub identity: Identity,
    /// Whether the run has ended, with all its files written.
    pub finished: bool,
    /// Number of the present step; it keys the noise.
    pub step: u64,
    pub position: Position,
    pub state: State,
    /// Forces of the present step, thermostat included: the next step begins with them.
    pub forces: Vec<[f64; 3]>,
    pub held: Held,
    /// The largest displacement of a trial move, as tuned so far; `None` without Monte Carlo.
    pub max_move: Option<f64>,
    /// Evaluations of ψ below and above the bounds of a density.
    pub out_of_bounds: [u64; 2],
    /// The totals of the last thermo row.
    pub last: Option<Thermo>,
    /// Sums over the thermo rows of the stage.
    pub sums: Sums,
    /// What there was before the last row of a run, which is written whatever the interval of rows: a run that is prolonged does
    /// not have it.
    pub before_end: Option<BeforeEnd>,
    /// The length and checksum of each file that grows with the run, by the file's name.
    pub files: BTreeMap<String, Written>,
    /// The accumulated data of observables, in a format of their own; empty without observables.
    pub observers: Vec<u8>,
}

impl Checkpoint {
    /// Makes it that of a run with the same steps so far and more to come.
    pub fn prolong(&mut self, identity: Identity) {
        self.identity = identity;
        self.finished = false;
        self.files = self.files_to_prolong();
        if let Some(BeforeEnd { sums, last, .. }) = self.before_end.take() {
            (self.sums, self.last) = (sums, last);
        }
    }

    /// What a longer run keeps of the files.
    pub fn files_to_prolong(&self) -> BTreeMap<String, Written> {
        let rows = self.before_end.as_ref().and_then(|end| end.rows);
        let mut files = self.files.clone();
        files.extend(rows.map(|rows| (ROWS.to_owned(), rows)));
        files
    }
}

/// What the thermostat did when it last acted, for steps before it acts again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Held {
    /// Virial of its mean force.
    pub virial: [f64; 6],
    /// Mean drag of the pairs; empty if nobody records it.
    #[serde(with = "shared")]
    pub drag: Vec<Arc<Drag>>,
}

/// What is shared is written like other things.
mod shared {
    use super::{Arc, Deserialize, Drag};
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer>(drag: &[Arc<Drag>], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(drag.iter().map(|drag| &**drag))
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<Arc<Drag>>, D::Error> {
        Ok(Vec::<Drag>::deserialize(from)?.into_iter().map(Arc::new).collect())
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BeforeEnd {
    pub sums: Sums,
    pub last: Option<Thermo>,
    /// What is written of the file of rows, if there is one.
    pub rows: Option<Written>,
}

/// The place of a run in its stages.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Position {
    pub stage: usize,
    /// Whether the initial forces of the stage have been computed.
    pub entered: bool,
    /// Number of completed steps of the stage.
    pub done: u64,
    pub begin: f64,
    pub time: f64,
}

/// Reads the particles of a checkpoint as the start of another run. `path` is a checkpoint, or the folder of
/// a run: then `checkpoint` in it is read, or, if that is damaged, `checkpoint.old`.
///
/// The caller checks whether the particles fit a model, as for any other state.
pub fn read_state(path: &Path) -> Result<State, CheckpointError> {
    let checkpoint = if path.is_dir() {
        Store::new(path).find(|_| Ok(()))?.ok_or_else(|| CheckpointError::absent(path))?.checkpoint
    } else {
        format::read(open_regular(path).map_err(CheckpointError::unreadable(path))?, path)?
    };
    Ok(checkpoint.state)
}

#[cfg(test)]
mod tests;
