use super::StateError;
use crate::checkpoint::{Caller, CheckpointError};
use crate::device::DeviceError;
use psidpd_core::document::FileError;
use psidpd_core::engine::{EngineError, NoEnergy, ReachError};
use psidpd_core::model::expression::TooLarge;
use psidpd_formats::files::PathError;
use psidpd_formats::memory::MemoryError;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    #[error("the initial state is not usable: {0}")]
    State(String),
    #[error(
        "the box is {height} wide between two faces, less than twice the range {range} of the \
         thermostat: a particle would meet two images of the same neighbour, and both pairs would \
         share their noise; use a larger box, or switch the thermostat off"
    )]
    BoxTooNarrow { height: f64, range: f64 },
    #[error(transparent)]
    NoEnergy(#[from] NoEnergy),
    #[error(transparent)]
    Reach(#[from] ReachError),
    #[error("the time step must be a positive number, is {0}")]
    TimeStep(f64),
    #[error("step {step}: {source}")]
    Engine { step: u64, source: EngineError },
    #[error(
        "step {step}: the velocity of particle {tag} is not finite: the time step is likely too large \
         for these forces"
    )]
    Velocity { step: u64, tag: i32 },
    #[error(
        "step {step}: the pressure of drag and noise is not finite: the drag is too strong for double precision, or \
         the time step too large for the drag"
    )]
    Impulses { step: u64 },
    #[error(
        "step {step}: particle {tag} moved {distance:.3e} in one step, further than across the box: \
         the time step is likely too large for these forces"
    )]
    Runaway { step: u64, tag: i32, distance: f64 },
    #[error(
        "step {step}: particle {tag} is more than 2^31 boxes away from its start, beyond the largest box count"
    )]
    Uncounted { step: u64, tag: i32 },
    #[error(
        "step {step}: the fluid has been hotter than 2 kT since step {since} and is at {ratio:.1} kT, though the thermostat \
         had time to cool it: dt = {dt} is likely too large for its forces with {integrator}; use a smaller dt, or an integrator that allows larger ones (docs/integrators.md)"
    )]
    TooHot { step: u64, since: u64, ratio: f64, dt: f64, integrator: String },
    #[error(
        "stage \"{stage}\" stopped: {cause}; the state of step {good} is in {}{}",
        saved.display(),
        if *checkpoint { ", and in the checkpoint in the same folder" } else { "" }
    )]
    Stopped {
        stage: String,
        #[source]
        cause: Box<RunError>,
        good: u64,
        saved: PathBuf,
        checkpoint: bool,
    },
    #[error("the run stopped after step {step}: {cause}")]
    Halted {
        step: u64,
        #[source]
        cause: Box<RunError>,
        checkpoint: Option<u64>,
    },
    #[error("{} holds a run that is not finished{}", folder.display(), reached(.step))]
    Unfinished { folder: PathBuf, step: Option<u64> },
    #[error("{} holds a finished run{}", folder.display(), if *other { " of another scene" } else { "" })]
    Finished { folder: PathBuf, other: bool },
    #[error("the run would replace {}, which its scene reads", path.display())]
    OwnInput { path: PathBuf },
    #[error("{} is there, and no checkpoint tells of a run that made it", path.display())]
    InTheWay { path: PathBuf },
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(transparent)]
    Memory(#[from] MemoryError),
    #[error("another run is writing to {}", folder.display())]
    Busy { folder: PathBuf },
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    #[error(transparent)]
    Format(#[from] psidpd_formats::FormatError),
    #[error("{} cannot be written: {}", .0.path.display(), .0.cause)]
    Output(#[from] PathError),
}

impl From<StateError> for RunError {
    fn from(error: StateError) -> RunError {
        RunError::State(error.message)
    }
}

impl RunError {
    /// Whether a run stopped after its start; otherwise it did not start.
    pub fn is_stop(&self) -> bool {
        matches!(
            self,
            RunError::Stopped { .. }
                | RunError::Halted { .. }
                | RunError::Engine { .. }
                | RunError::Velocity { .. }
                | RunError::Impulses { .. }
                | RunError::Runaway { .. }
                | RunError::Uncounted { .. }
                | RunError::TooHot { .. }
        )
    }

    /// Whether writing a file failed, in contrast to the physics.
    pub(super) fn is_output(&self) -> bool {
        matches!(self, RunError::Output(_) | RunError::Format(_))
    }

    /// Advice that the message does not contain.
    pub fn help(&self, caller: Caller) -> Option<String> {
        let (over, go_on) = (caller.start_over(), caller.go_on());
        Some(match self {
            RunError::Stopped { checkpoint: true, .. } => format!(
                "to try again from there, give another scene `[initial]` with `kind = \"checkpoint\"`, and a \
                 smaller dt or softer forces; or {over}"
            ),
            RunError::Halted { checkpoint: Some(step), .. } => {
                format!("the checkpoint of step {step} is good: when the cause is gone, {go_on}")
            }
            RunError::Halted { checkpoint: None, .. } => {
                format!("there is no checkpoint yet: when the cause is gone, {over}")
            }
            RunError::Unfinished { .. } => format!("{go_on}, or {over}"),
            RunError::Finished { other: false, .. } if caller == Caller::Options => {
                format!("prolong it with --resume --steps +N, choose another folder, or {over}")
            }
            RunError::Finished { .. } | RunError::InTheWay { .. } => {
                format!("choose another folder, or {over}")
            }
            RunError::OwnInput { .. } => "choose another folder, or take a copy of the file".into(),
            RunError::Busy { .. } => "wait for its end, or choose another folder".into(),
            RunError::Checkpoint(error) => error.help(caller),
            RunError::Device(error) => return error.help().map(str::to_owned),
            _ => return None,
        })
    }
}

fn reached(step: &Option<u64>) -> String {
    step.map_or(" (its checkpoint cannot be read)".into(), |step| {
        format!(" (its checkpoint is of step {step})")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// Advice names the options of its caller and no others.
    #[test]
    fn advice_is_that_for_the_caller() {
        let folder = PathBuf::from("f");
        let errors = [
            RunError::Finished { folder: folder.clone(), other: true },
            RunError::Unfinished { folder, step: Some(3) },
            RunError::Checkpoint(CheckpointError::absent(Path::new("f"))),
        ];
        for (caller, has, lacks) in [
            (Caller::Options, "--overwrite", "overwrite=True"),
            (Caller::Python, "overwrite=True", "--overwrite"),
            (Caller::Neither, "remove the folder", "overwrite"),
        ] {
            for error in &errors {
                let help = error.help(caller).unwrap();
                assert!(help.contains(has) && !help.contains(lacks), "{caller:?}: {help}");
            }
        }
    }
}
