use crate::text::TextError;
use std::path::{Path, PathBuf};

/// Why a file cannot be read, written or made into a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Text { path: PathBuf, source: TextError },
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
    Write(#[from] WriteError),
}

impl FormatError {
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> FormatError {
        FormatError::io("read", path)
    }

    /// Makes the error of `map_err` for a file operation.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> FormatError {
        let path = path.to_owned();
        move |source| FormatError::Io { action, path, source }
    }
}

#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {cause}", path.display())]
pub struct WriteError {
    pub path: PathBuf,
    #[source]
    pub cause: std::io::Error,
}

impl WriteError {
    /// Makes the error of `map_err` for operations that write `path`.
    pub fn at(path: &Path) -> impl FnOnce(std::io::Error) -> WriteError + '_ {
        move |cause| WriteError { path: path.to_owned(), cause }
    }
}
