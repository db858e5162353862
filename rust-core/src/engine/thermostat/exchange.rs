//! The state of a solution in rounds with other ranks.

#[derive(Debug, Clone, Copy, Default)]
pub struct Exchange {
    /// Number of owned particles.
    pub owned: usize,
    pub round: Round,
    /// Squared norm of the first residual of this rank.
    pub first: f64,
}

/// The data that the solution waits for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Round {
    #[default]
    Start,
    /// Directions of ghosts.
    Direction,
    /// The totals of the first residual and of the curvature.
    Curvature,
    /// Velocities of ghosts at the midpoint.
    Middle,
}
