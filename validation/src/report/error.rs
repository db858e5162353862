//! The error type of this module.

use crate::files::WriteError;

/// What can go wrong while making or writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A plot could not be drawn.
    #[error("cannot draw the plot: {0}")]
    Plot(String),
    /// Results could not be turned into JSON, or read from it.
    #[error("cannot convert results to or from JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
