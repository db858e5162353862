use psidpd_formats::FormatError;
use psidpd_formats::files::PathError;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    #[error("cannot draw the plot: {0}")]
    Plot(String),
    #[error("cannot convert results to or from JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error(transparent)]
    Write(#[from] PathError),
    #[error(transparent)]
    Read(#[from] FormatError),
    #[error("{} is not the folder of a run: it has none of the files {files}", folder.display())]
    NoRun { folder: PathBuf, files: String },
}
