use std::path::{Path, PathBuf};

/// Why a file cannot be read, written or made into a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    #[error("{}, line {line}: {message}", path.display())]
    Xyz { path: PathBuf, line: usize, message: String },
    #[error("{}: {message}", path.display())]
    Content { path: PathBuf, message: String },
    #[error("{0}")]
    Request(String),
    #[error(transparent)]
    File(#[from] PathError),
}

impl FormatError {
    /// Makes the error of `map_err` for the content of a file.
    pub fn content<E: ToString>(path: &Path) -> impl FnOnce(E) -> FormatError {
        move |fault| FormatError::Content { path: path.to_owned(), message: fault.to_string() }
    }
}

/// Why an operation on a file or folder failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {}: {cause}", path.display())]
pub struct PathError {
    pub action: &'static str,
    pub path: PathBuf,
    #[source]
    pub cause: std::io::Error,
}

impl PathError {
    /// Makes the error of `map_err` for an operation on `path`.
    pub fn at(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> PathError {
        move |cause| PathError { action, path: path.to_owned(), cause }
    }
}
