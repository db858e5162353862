//! Checkpoints: all that the rest of a run depends on, in one file.
//!
//! A run keeps two of them in its folder, `checkpoint` and `checkpoint.old`, the one before. A new one is
//! written beside them, brought to the disk and renamed, so that a run killed at any moment, or a machine
//! that loses its power, leaves one that is whole. The file is
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
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The name of the newest checkpoint in the folder of a run.
const NEWEST: &str = "checkpoint";

/// All that the rest of a run depends on, and that its files will tell.
///
/// Particle arrays are in the order that the run had them in: sums of forces depend on it by rounding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Version of the program that wrote it.
    pub program: String,
    /// The instruction set that its forces were computed with: sums of forces depend on it by rounding.
    pub instructions: String,
    /// Of which scene and model.
    pub identity: Identity,
    /// Whether the run is at its end, and its files are all written.
    pub finished: bool,
    /// Number of the present step; it keys the noise.
    pub step: u64,
    /// Where that is in the stages.
    pub position: Position,
    /// The particles.
    pub state: State,
    /// Forces of the present step, thermostat included: those that the next step begins with.
    pub forces: Vec<[f64; 3]>,
    /// The furthest trial move that was found; `None` without Monte Carlo.
    pub max_move: Option<f64>,
    /// Evaluations of ψ below and above the bounds of a density.
    pub out_of_bounds: [u64; 2],
    /// The last totals.
    pub last: Option<Thermo>,
    /// Sums over the thermo rows of the stage.
    pub sums: Sums,
    /// What had been written to each file that grows with the run, by its name.
    pub files: BTreeMap<String, Written>,
    /// What observables remember, in a format of their own; empty without any.
    pub observers: Vec<u8>,
}

/// Where in its stages a run is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Position {
    /// Index of the stage.
    pub stage: usize,
    /// Whether the forces that the stage starts with have been computed.
    pub entered: bool,
    /// Steps of the stage that are made.
    pub done: u64,
    /// Time at which the stage began.
    pub begin: f64,
    /// The present time.
    pub time: f64,
}

/// The particles of a checkpoint, for another run to start from. `path` is the checkpoint, or the folder
/// of a run: then `checkpoint` in it is read, or, if that is damaged, `checkpoint.old`.
///
/// Whether the particles are a state of a model is for the caller to check, as for any other state.
///
/// # Errors
/// There is no checkpoint, it is damaged, or of another version of the format.
pub fn read_state(path: &Path) -> Result<State, CheckpointError> {
    let checkpoint = if path.is_dir() {
        Store::new(path).find(|_| Ok(()))?.ok_or_else(|| CheckpointError::absent(path))?.checkpoint
    } else {
        format::read(path)?
    };
    Ok(checkpoint.state)
}

#[cfg(test)]
mod tests;
