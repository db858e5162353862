//! The error type of the styles.

use std::error::Error;
use std::fmt;

/// An error, as the text that LAMMPS prints. It is no [`Error`] itself: all errors become one.
#[derive(Debug, Clone, PartialEq)]
pub struct StyleError(pub(crate) String);

impl fmt::Display for StyleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl<E: Error> From<E> for StyleError {
    fn from(error: E) -> StyleError {
        StyleError(error.to_string())
    }
}
