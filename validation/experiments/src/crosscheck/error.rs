use psidpd_core::document::FileError;
use psidpd_core::engine::EngineError;
use psidpd_core::model::PresetError;
use psidpd_core::model::expression::TooLarge;
use psidpd_dynamics::run::RunError;
use psidpd_formats::files::WriteError;
use psidpd_lammps_host::LammpsError;
use psidpd_observe::{DriftError, ProfileError, StatisticsError, TensionError};
use psidpd_report::ReportError;
use std::path::PathBuf;

/// Why the validation could not be carried out. A check that fails is no error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ValidateError {
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
    Eam(#[from] psidpd_lammps_host::export::eam::EamError),
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
    #[error("{path}: {problem}")]
    Output { path: PathBuf, problem: String },
}

impl ValidateError {
    /// For `map_err` of file operations on `path`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> ValidateError {
        let path = path.into();
        move |source| ValidateError::Io { path, source }
    }
}
