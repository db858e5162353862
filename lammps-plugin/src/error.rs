//! The error type of the styles.

use psidpd_core::engine::{EngineError, ThreadCount};

/// An error, as the text that LAMMPS prints.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StyleError(pub(crate) String);

impl From<EngineError> for StyleError {
    fn from(error: EngineError) -> StyleError {
        StyleError(error.to_string())
    }
}

impl From<ThreadCount> for StyleError {
    fn from(error: ThreadCount) -> StyleError {
        StyleError(error.to_string())
    }
}
