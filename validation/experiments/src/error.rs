use psidpd_core::document::FileError;
use psidpd_core::engine::EngineError;
use psidpd_core::model::PresetError;
use psidpd_core::model::expression::TooLarge;
use psidpd_dynamics::run::RunError;
use psidpd_formats::files::WriteError;
use psidpd_lammps_host::LammpsError;
use psidpd_lammps_host::export::eam::EamError;
use psidpd_lammps_host::export::lammps::DeckError;
use psidpd_observe::{DriftError, ProfileError, StatisticsError, TensionError};
use psidpd_report::ReportError;
use std::path::PathBuf;

/// Why an experiment could not be carried out. A check that fails is no error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    #[error(transparent)]
    Lammps(#[from] LammpsError),
    #[error(transparent)]
    Format(#[from] psidpd_formats::FormatError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Preset(#[from] PresetError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Formula(#[from] TooLarge),
    #[error(transparent)]
    Eam(#[from] EamError),
    #[error(transparent)]
    Deck(#[from] DeckError),
    #[error("{what}: {source}")]
    Statistics { what: String, source: StatisticsError },
    #[error(transparent)]
    Profile(#[from] ProfileError),
    #[error(transparent)]
    Tension(#[from] TensionError),
    #[error(transparent)]
    Drift(#[from] DriftError),
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    /// A file that LAMMPS wrote is not as it should be.
    #[error("{path}: {problem}")]
    Output { path: PathBuf, problem: String },
    /// What LAMMPS printed is not as it should be.
    #[error("{what}: {problem} in what LAMMPS printed")]
    Printed { what: String, problem: &'static str },
    #[error("{0} particles are too few: the box must be at least three ranges wide; take 170 or more")]
    TooSmall(usize),
    #[error("measuring memory: {0}")]
    Memory(String),
    /// No stage has a thermostat, whose temperature could be compared with.
    #[error(
        "no stage of the scene has a thermostat and a fixed temperature, so there is nothing to compare with"
    )]
    NoStage,
    /// The start or the reference stopped.
    #[error("{what}: {source}")]
    Stopped { what: String, source: Box<RunError> },
    #[error("the reference, {what}, is unstable: {why}; lower the dt of the scene")]
    Reference { what: String, why: String },
    /// A tolerance for what the scene does not measure.
    #[error(
        "--tolerance {0}: nothing of this name was measured; a scene measures densities by interface_width or drop, the \
         tension by surface_tension or drop, and viscosities by viscosity or poiseuille, in its [observe]"
    )]
    Unmeasured(String),
}

impl ExperimentError {
    /// For `map_err` of file operations on `path`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> ExperimentError {
        let path = path.into();
        move |source| ExperimentError::Io { path, source }
    }
}
