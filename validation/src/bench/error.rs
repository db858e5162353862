use crate::export::eam::EamError;
use crate::files::WriteError;
use crate::lammps::LammpsError;
use crate::report::ReportError;
use crate::run::RunError;
use psidpd_core::document::FileError;
use std::path::PathBuf;

/// Why the benchmark could not be carried out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
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
    /// A fluid cannot be tabulated.
    #[error(transparent)]
    Eam(#[from] EamError),
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// What LAMMPS printed lacks its own timing.
    #[error("{what}: {problem} in what LAMMPS printed")]
    Output {
        /// Which run.
        what: String,
        /// What is missing.
        problem: &'static str,
    },
    /// A size that is too small: two images of a pair would share their noise.
    #[error("{0} particles are too few: the box must be at least three ranges wide; take 170 or more")]
    TooSmall(usize),
    /// The child process that measures memory failed.
    #[error("measuring memory: {0}")]
    Memory(String),
}

impl BenchError {
    /// For `map_err` of file operations on `path`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> BenchError {
        let path = path.into();
        move |source| BenchError::Io { path, source }
    }
}
