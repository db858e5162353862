//! What an evaluation of forces was asked to list.

/// The pairs of an evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Listed {
    pub dt: f64,
    /// Whether distances are stored.
    pub virial: bool,
    /// Number of the host's particles.
    pub particles: usize,
}

impl Listed {
    /// Whether these pairs are those of `asked`, perhaps with distances beside.
    pub fn serves(self, asked: Listed) -> bool {
        self.dt == asked.dt && self.particles == asked.particles && (self.virial || !asked.virial)
    }
}
