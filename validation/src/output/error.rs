use std::path::{Path, PathBuf};

/// Why a file of a run cannot be read or made into a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A file cannot be read.
    #[error("{} cannot be read: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// A file of LAMMPS's formats is not one.
    #[error(transparent)]
    Lammps(#[from] crate::lammps::LammpsError),
    /// A line of an extended XYZ file is wrong.
    #[error("{}, line {line}: {message}", path.display())]
    Xyz {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A file holds no configuration that can be used.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A JSON file is not what it should be.
    #[error("{}: {cause}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Why, with line and column.
        #[source]
        cause: serde_json::Error,
    },
    /// A picture cannot be packed or unpacked.
    #[error("{}: {message}", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// A picture cannot be drawn as asked.
    #[error("{0}")]
    Request(String),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] crate::files::WriteError),
}

impl OutputError {
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> OutputError + '_ {
        move |cause| OutputError::Read { path: path.to_owned(), cause }
    }
}
