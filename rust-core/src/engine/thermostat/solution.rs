//! The approximate solution of an implicit update, and how far it has come.

use super::pass::Wide;

#[derive(Debug, Clone, Default)]
pub struct Solution {
    /// The change of velocity of each sorted particle.
    pub change: Vec<Wide>,
    pub residual: Vec<Wide>,
    pub progress: Progress,
}

/// State of a solution; all ranks have the same.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// Squared norm of the present residual.
    pub now: f64,
    pub tolerance: f64,
    /// Drag per mass of the first residual, or 1 if that is more.
    pub drag: f64,
    /// Squared norm at which iterations end.
    pub enough: f64,
    /// Iterations so far.
    pub iterations: usize,
}
