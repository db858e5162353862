use super::{PathBuf, PathError};
use psidpd_dynamics::run::StateError;

/// The errors of verbs themselves.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    #[error("{} is an input of this verb and would be overwritten: choose another place for the results", .0.display())]
    WrittenOver(PathBuf),
    /// The state in a data file does not fit the model.
    #[error("{}{}: {error}", path.display(), line.map_or(String::new(), |line| format!(", line {line}")))]
    NoState { path: PathBuf, line: Option<usize>, error: StateError },
    #[error(transparent)]
    Path(#[from] PathError),
    #[error("there is no case {0}: psidpd reproduce --list shows all")]
    UnknownCase(String),
    /// The results of a finished run cannot be written.
    #[error("the run in {} is finished, but {cause}", folder.display())]
    Unwritten { folder: PathBuf, cause: PathError },
    /// The work is done, but its output is lost.
    #[error("standard output cannot be written, and a part of the output is lost: {0}")]
    Lost(std::io::Error),
}
