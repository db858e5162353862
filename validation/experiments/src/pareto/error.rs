use psidpd_core::document::FileError;
use psidpd_dynamics::run::RunError;
use psidpd_formats::files::WriteError;
use psidpd_lammps_host::LammpsError;
use psidpd_lammps_host::export::lammps::DeckError;
use psidpd_report::ReportError;
use std::path::PathBuf;

/// Why speed cannot be held against error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParetoError {
    /// No stage has a thermostat, whose temperature could be compared with.
    #[error(
        "no stage of the scene has a thermostat and a fixed temperature, so there is nothing to compare with"
    )]
    NoStage,
    /// The start or the reference stopped.
    #[error("{what}: {source}")]
    Stopped {
        /// What was run.
        what: String,
        /// Why it stopped.
        source: Box<RunError>,
    },
    /// The reference is unstable.
    #[error("the reference, {what}, is unstable: {why}; lower the dt of the scene")]
    Reference {
        /// Its setting.
        what: String,
        /// How it ended.
        why: String,
    },
    /// A tolerance for what the scene does not measure.
    #[error(
        "--tolerance {0}: nothing of this name was measured; a scene measures densities by interface_width or drop, the \
         tension by surface_tension or drop, and viscosities by viscosity or poiseuille, in its [observe]"
    )]
    Unmeasured(String),
    /// The scene or its model.
    #[error(transparent)]
    File(#[from] FileError),
    /// A simulation cannot begin.
    #[error(transparent)]
    Run(#[from] RunError),
    /// LAMMPS is missing, or stopped.
    #[error(transparent)]
    Lammps(#[from] LammpsError),
    #[error(transparent)]
    Format(#[from] psidpd_formats::FormatError),
    /// A deck cannot be written.
    #[error(transparent)]
    Deck(#[from] DeckError),
    /// What LAMMPS printed is not understood.
    #[error("{what}: {problem} in what LAMMPS printed")]
    Output {
        /// Which run.
        what: String,
        /// What is missing.
        problem: &'static str,
    },
    /// A page cannot be made.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file or folder cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl ParetoError {
    /// For `map_err` of file operations on `path`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> ParetoError {
        let path = path.into();
        move |source| ParetoError::Io { path, source }
    }
}
