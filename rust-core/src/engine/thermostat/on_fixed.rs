//! What the midpoint rule finds of the forces on particles of infinite mass.

/// The forces on particles of infinite mass, if they are asked for.
#[derive(Debug, Default)]
pub struct OnFixed {
    pub is_asked: bool,
    /// The mean force over the time of the last update on each owned particle, in the order of the host; zero for others.
    pub force: Vec<[f64; 3]>,
}
