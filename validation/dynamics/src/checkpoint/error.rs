use std::path::{Path, PathBuf};

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    #[error("the checkpoint {} cannot be read: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{} is not a checkpoint of psidpd", path.display())]
    Other { path: PathBuf },
    #[error(
        "the checkpoint {} is in version {found} of the format, and this program (psidpd {}) reads version {}",
        path.display(), env!("CARGO_PKG_VERSION"), super::VERSION
    )]
    Version { path: PathBuf, found: u32 },
    #[error("the checkpoint {} is truncated: {found} bytes of {expected}", path.display())]
    Truncated { path: PathBuf, found: u64, expected: u64 },
    #[error("the checkpoint {} is damaged: {what}", path.display())]
    Damaged { path: PathBuf, what: String },
    #[error(
        "{} has {found} bytes, fewer than the {expected} that it had at the checkpoint {}",
        file.display(), path.display()
    )]
    File { path: PathBuf, file: PathBuf, found: u64, expected: u64 },
    #[error(
        "the first {length} bytes of {} are not those that the run has written before the checkpoint {}: the file was changed",
        file.display(), path.display()
    )]
    Edited { path: PathBuf, file: PathBuf, length: u64 },
    #[error("the checkpoint {} is of another run: {}", path.display(), list(differences))]
    Foreign { path: PathBuf, differences: Vec<String> },
    #[error("the run of {} has {before} steps in its last stage, more than the {now} of this scene", path.display())]
    Shorter { path: PathBuf, before: u64, now: u64 },
    #[error("the run of {} cannot be prolonged from {before} to {now} steps in its last stage: {why}", path.display())]
    Fixed { path: PathBuf, before: u64, now: u64, why: &'static str },
}

/// The interface that a user called the program through; messages write options in its syntax.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Caller {
    /// A verb of the command line, with `--resume` and `--overwrite`.
    Options,
    /// A call in Python, with `resume=True` and `overwrite=True`.
    Python,
    /// A verb or function that has neither option.
    #[default]
    Neither,
}

impl Caller {
    pub fn start_over(self) -> &'static str {
        match self {
            Caller::Options => "start over with --overwrite",
            Caller::Python => "start over with overwrite=True",
            Caller::Neither => "remove the folder to start over",
        }
    }

    pub fn go_on(self) -> &'static str {
        match self {
            Caller::Options => "go on with --resume",
            Caller::Python => "go on with resume=True",
            Caller::Neither => "go on with `psidpd run --resume`",
        }
    }
}

impl CheckpointError {
    pub(super) fn unreadable(path: &Path) -> impl FnOnce(std::io::Error) -> CheckpointError + '_ {
        move |source| CheckpointError::Unreadable { path: path.to_owned(), source }
    }

    /// Whether the checkpoint is whole, and not one that the run can go on from.
    pub(super) fn is_of_another_run(&self) -> bool {
        use CheckpointError::{Fixed, Foreign, Shorter};
        matches!(self, Foreign { .. } | Shorter { .. } | Fixed { .. })
    }

    pub fn absent(folder: &Path) -> CheckpointError {
        let path = folder.join(super::NEWEST);
        let source = std::io::ErrorKind::NotFound.into();
        CheckpointError::Unreadable { path, source }
    }

    pub fn help(&self, caller: Caller) -> String {
        let over = caller.start_over();
        match self {
            CheckpointError::Foreign { .. } => {
                format!("go on with the scene and model that the run was started with, or {over}")
            }
            CheckpointError::Shorter { before, .. } => match caller {
                Caller::Options => format!("go on with --resume --steps {before}, or {over}"),
                _ => format!("go on with {before} steps, or {over}"),
            },
            CheckpointError::Fixed { .. } => {
                format!(
                    "begin another run at this one, by `[initial]` with `kind = \"checkpoint\"`, or {over}"
                )
            }
            CheckpointError::Version { .. } => {
                format!("go on with the version of psidpd that wrote it, or {over}")
            }
            CheckpointError::Edited { .. } => format!("put the file back as the run left it, or {over}"),
            _ => over.into(),
        }
    }
}

fn list(differences: &[String]) -> String {
    const MOST: usize = 5;
    let shown = differences.iter().take(MOST).cloned().collect::<Vec<_>>().join("; ");
    match differences.len().saturating_sub(MOST) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}
