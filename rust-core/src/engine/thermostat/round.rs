/// The data that a solution in rounds with other ranks waits for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Round {
    #[default]
    Start,
    /// The total of the first residual.
    First,
    /// Directions of ghosts, with the squared norms of the residual at first and now.
    Direction { first: f64, now: f64 },
    /// The total of the curvature.
    Curvature { first: f64, now: f64 },
    /// The total of the residual.
    Residual { first: f64, now: f64 },
    /// Velocities of ghosts at the midpoint.
    Middle,
}
