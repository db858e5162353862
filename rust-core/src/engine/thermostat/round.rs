/// The data that a solution in rounds with other ranks waits for.
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
