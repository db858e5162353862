use std::path::{Path, PathBuf};

/// Why a file of a run cannot be read or made into a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say it")]
pub enum OutputError {
    #[error("{} cannot be read: {cause}", path.display())]
    Read {
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error(transparent)]
    Lammps(#[from] crate::lammps::LammpsError),
    #[error("{}, line {line}: {message}", path.display())]
    Xyz { path: PathBuf, line: usize, message: String },
    #[error("{}: {message}", path.display())]
    Content { path: PathBuf, message: String },
    #[error("{}: {cause}", path.display())]
    Json {
        path: PathBuf,
        #[source]
        cause: serde_json::Error,
    },
    #[error("{}: {message}", path.display())]
    Picture { path: PathBuf, message: String },
    #[error("{0}")]
    Request(String),
    #[error(transparent)]
    Write(#[from] crate::files::WriteError),
}

impl OutputError {
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> OutputError + '_ {
        move |cause| OutputError::Read { path: path.to_owned(), cause }
    }
}
