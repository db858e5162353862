use std::path::{Path, PathBuf};

/// Why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say it")]
pub enum CheckpointError {
    #[error("the checkpoint {} cannot be read: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{} is no checkpoint of psidpd", path.display())]
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
        "{} has {found} bytes, fewer than the {expected} that the checkpoint {} counts on",
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
}

impl CheckpointError {
    pub(super) fn unreadable(path: &Path) -> impl FnOnce(std::io::Error) -> CheckpointError + '_ {
        move |source| CheckpointError::Unreadable { path: path.to_owned(), source }
    }

    /// There is none in `folder`.
    pub(super) fn absent(folder: &Path) -> CheckpointError {
        let path = folder.join(super::store::NEWEST);
        let source = std::io::ErrorKind::NotFound.into();
        CheckpointError::Unreadable { path, source }
    }

    /// What can be done.
    pub fn help(&self) -> &'static str {
        match self {
            CheckpointError::Foreign { .. } => {
                "go on with the scene and model that the run was started with, or start over with --overwrite"
            }
            CheckpointError::Version { .. } => {
                "go on with the version of psidpd that wrote it, or start over with --overwrite"
            }
            CheckpointError::Edited { .. } => {
                "put the file back as the run left it, or start over with --overwrite"
            }
            _ => "start over with --overwrite",
        }
    }
}

/// The first few differences.
fn list(differences: &[String]) -> String {
    const MOST: usize = 5;
    let shown = differences.iter().take(MOST).cloned().collect::<Vec<_>>().join("; ");
    match differences.len().saturating_sub(MOST) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}
