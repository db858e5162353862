use psidpd_core::document::FileError;
use psidpd_dynamics::run::RunError;
use psidpd_formats::files::WriteError;
use psidpd_lammps_host::LammpsError;
use psidpd_lammps_host::export::eam::EamError;
use psidpd_report::ReportError;
use std::path::PathBuf;

/// Why the benchmark could not be carried out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
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
    Eam(#[from] EamError),
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{what}: {problem} in what LAMMPS printed")]
    Output { what: String, problem: &'static str },
    #[error("{0} particles are too few: the box must be at least three ranges wide; take 170 or more")]
    TooSmall(usize),
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
