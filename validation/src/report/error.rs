//! The error type of this module.

use crate::files::WriteError;

/// What can go wrong while making or writing a report.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say it")]
pub enum ReportError {
    #[error("cannot draw the plot: {0}")]
    Plot(String),
    #[error("cannot convert results to or from JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error(transparent)]
    Write(#[from] WriteError),
}
