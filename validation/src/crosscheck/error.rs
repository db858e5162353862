use crate::files::WriteError;
use crate::lammps::LammpsError;
use crate::observe::{DriftError, ProfileError, StatisticsError, TensionError};
use crate::report::ReportError;
use crate::run::RunError;
use psidpd_core::document::FileError;
use psidpd_core::engine::EngineError;
use psidpd_core::model::PresetError;
use psidpd_core::model::expression::TooLarge;
use std::path::PathBuf;

/// Why the validation could not be carried out. A check that fails is no error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ValidateError {
    /// LAMMPS is missing, or stopped.
    #[error(transparent)]
    Lammps(#[from] LammpsError),
    /// The native runner stopped.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A report cannot be made.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A model file is wrong.
    #[error(transparent)]
    File(#[from] FileError),
    /// Coefficients make no model.
    #[error(transparent)]
    Preset(#[from] PresetError),
    /// The engine stopped.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A formula is too large.
    #[error(transparent)]
    Formula(#[from] TooLarge),
    /// A fluid cannot be tabulated.
    #[error(transparent)]
    Eam(#[from] crate::export::eam::EamError),
    /// A series has no error bar.
    #[error("{what}: {source}")]
    Statistics {
        /// Which series.
        what: String,
        /// Why.
        source: StatisticsError,
    },
    /// A density profile cannot be made.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// A surface tension cannot be had.
    #[error(transparent)]
    Tension(#[from] TensionError),
    /// A drift cannot be had.
    #[error(transparent)]
    Drift(#[from] DriftError),
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// LAMMPS wrote something else than its deck asks for.
    #[error("{path}: {problem}")]
    Output {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
}

impl ValidateError {
    /// For `map_err` of file operations on `path`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> ValidateError {
        let path = path.into();
        move |source| ValidateError::Io { path, source }
    }
}
