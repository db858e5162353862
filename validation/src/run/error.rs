use crate::checkpoint::{CheckpointError, Unwritten};
use crate::particles::StateError;
use psidpd_core::document::FileError;
use psidpd_core::engine::EngineError;
use psidpd_core::model::expression::TooLarge;
use std::path::{Path, PathBuf};

/// Why a run cannot start, or stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The model or the scene does not hold at the temperature of a run.
    #[error(transparent)]
    File(#[from] FileError),
    /// A derivative of ψ is too large to compile.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// The particles are no valid state of the model.
    #[error("the initial state is not usable: {0}")]
    State(String),
    /// Two images of a particle would share the noise of a pair.
    #[error(
        "the box is {height} wide between two faces, less than twice the range {range} of the \
         thermostat: a particle would meet two images of the same neighbour, and both pairs would \
         share their noise; use a larger box, or switch the thermostat off"
    )]
    BoxTooNarrow {
        /// The smallest width.
        height: f64,
        /// Range of the random force.
        range: f64,
    },
    /// A range is many times the box.
    #[error(
        "the range {range} is {:.1} times the width {height} of the box between two faces: particles would meet \
         {images:.1e} images of each other, which take about {gigabytes:.1} GB; use a larger box or a shorter range",
        range / height
    )]
    Reach {
        /// The longest range of the model.
        range: f64,
        /// The smallest width.
        height: f64,
        /// How many images there would be.
        images: f64,
        /// What they would take.
        gigabytes: f64,
    },
    /// A time step that is not a positive number.
    #[error("the time step must be a positive number, is {0}")]
    TimeStep(f64),
    /// The forces of a step cannot be had.
    #[error("step {step}: {source}")]
    Engine {
        /// Number of the step.
        step: u64,
        /// What and which particle.
        source: EngineError,
    },
    /// A velocity became NaN or infinite.
    #[error(
        "step {step}: the velocity of particle {tag} is not finite: the time step is likely too large \
         for these forces"
    )]
    Velocity {
        /// Number of the step.
        step: u64,
        /// Which particle.
        tag: i32,
    },
    /// A particle moved further than across the whole box in one step.
    #[error(
        "step {step}: particle {tag} moved {distance:.3e} in one step, further than across the box: \
         the time step is likely too large for these forces"
    )]
    Runaway {
        /// Number of the step.
        step: u64,
        /// Which particle.
        tag: i32,
        /// How far.
        distance: f64,
    },
    /// The temperature is far from that of the thermostat, and stays there.
    #[error(
        "step {step}: the fluid has been hotter than 2 kT since step {since} and is at {ratio:.1} kT, though the thermostat \
         had time to cool it: dt = {dt} is likely too large for its forces with {integrator}; use a smaller dt, or an integrator \
         that bears larger ones (docs/integrators.md)"
    )]
    TooHot {
        /// Number of the step.
        step: u64,
        /// Step of the first sample that was too hot.
        since: u64,
        /// The temperature in units of that of the thermostat.
        ratio: f64,
        /// Δt.
        dt: f64,
        /// How steps are made.
        integrator: String,
    },
    /// The physics of a run failed; the last good state is on disk.
    #[error(
        "stage \"{stage}\" stopped: {cause}; the state of step {good} is in {}{}",
        saved.display(),
        if *checkpoint { ", and in the checkpoint beside it" } else { "" }
    )]
    Stopped {
        /// Name of the stage.
        stage: String,
        /// Why.
        #[source]
        cause: Box<RunError>,
        /// Step of the last good state.
        good: u64,
        /// Where it is.
        saved: PathBuf,
        /// Whether it could also be written as a checkpoint.
        checkpoint: bool,
    },
    /// A run could not write one of its files on the way.
    #[error("the run stopped after step {step}: {cause}")]
    Halted {
        /// Step that the run had reached.
        step: u64,
        /// Which file, and why.
        #[source]
        cause: Box<RunError>,
        /// Step of the checkpoint that is on disk.
        checkpoint: Option<u64>,
    },
    /// The folder holds a run that did not reach its end.
    #[error("{} holds a run that is not finished{}", folder.display(), reached(.step))]
    Unfinished {
        /// The folder.
        folder: PathBuf,
        /// The step that its checkpoint is of, if that can be read.
        step: Option<u64>,
    },
    /// The folder is in use.
    #[error("another run is writing to {}", folder.display())]
    Busy {
        /// The folder.
        folder: PathBuf,
    },
    /// A run cannot be taken up again.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A data file cannot be written.
    #[error(transparent)]
    Lammps(#[from] crate::lammps::LammpsError),
    /// A description or a picture of a run cannot be written.
    #[error(transparent)]
    Picture(#[from] crate::output::OutputError),
    /// A file or folder cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl From<StateError> for RunError {
    fn from(error: StateError) -> RunError {
        RunError::State(error.0)
    }
}

impl From<Unwritten> for RunError {
    fn from(Unwritten { path, source }: Unwritten) -> RunError {
        RunError::Output { path, source }
    }
}

impl RunError {
    /// Whether a run stopped on its way, rather than could not start.
    pub fn is_stop(&self) -> bool {
        matches!(
            self,
            RunError::Stopped { .. }
                | RunError::Halted { .. }
                | RunError::Engine { .. }
                | RunError::Velocity { .. }
                | RunError::Runaway { .. }
                | RunError::TooHot { .. }
        )
    }

    /// Whether a file is the trouble, not the physics.
    pub(super) fn is_output(&self) -> bool {
        matches!(self, RunError::Output { .. } | RunError::Picture(_) | RunError::Lammps(_))
    }

    /// What can be done about it, where that is not in the message.
    pub fn help(&self) -> Option<String> {
        match self {
            RunError::Stopped { checkpoint: true, .. } => Some(
                "to try again from there, give another scene `[initial]` with `kind = \"checkpoint\"`, and a \
                 smaller dt or softer forces; to start over, --overwrite"
                    .into(),
            ),
            RunError::Halted { checkpoint: Some(step), .. } => Some(format!(
                "the checkpoint of step {step} is good: when the cause is gone, go on with --resume"
            )),
            RunError::Halted { checkpoint: None, .. } => {
                Some("there is no checkpoint yet: when the cause is gone, start over".into())
            }
            RunError::Unfinished { .. } => Some("go on with --resume, or start over with --overwrite".into()),
            RunError::Busy { .. } => Some("wait for its end, or choose another folder".into()),
            RunError::Checkpoint(error) => Some(error.help().into()),
            _ => None,
        }
    }

    pub(super) fn output(path: &Path) -> impl FnOnce(std::io::Error) -> RunError + '_ {
        move |source| RunError::Output { path: path.to_owned(), source }
    }
}

fn reached(step: &Option<u64>) -> String {
    step.map_or(" (its checkpoint cannot be read)".into(), |step| {
        format!(" (its checkpoint is of step {step})")
    })
}
