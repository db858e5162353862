//! How far the solution of an implicit update has come.

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
