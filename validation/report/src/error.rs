use psidpd_formats::files::WriteError;

/// An error while a report is made or written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    #[error("cannot draw the plot: {0}")]
    Plot(String),
    #[error("cannot convert results to or from JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error(transparent)]
    Write(#[from] WriteError),
}
