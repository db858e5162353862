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
    /// A run of a scene stopped; the last good state is on disk.
    #[error("stage \"{stage}\" stopped: {cause}; the state of step {good} is in {}", saved.display())]
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
    },
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

impl RunError {
    /// Whether a run stopped on its way, rather than could not start.
    pub fn is_stop(&self) -> bool {
        matches!(
            self,
            RunError::Stopped { .. }
                | RunError::Engine { .. }
                | RunError::Velocity { .. }
                | RunError::Runaway { .. }
        )
    }

    pub(super) fn output(path: &Path) -> impl FnOnce(std::io::Error) -> RunError + '_ {
        move |source| RunError::Output { path: path.to_owned(), source }
    }
}
