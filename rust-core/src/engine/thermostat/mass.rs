//! Masses, some of which are infinite.

/// The mass of a particle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mass {
    /// The mass, or 0 if it is infinite.
    pub inertia: f64,
    pub inverse: f64,
}

impl Mass {
    pub fn new(mass: f64) -> Mass {
        Mass { inertia: if mass.is_finite() { mass } else { 0.0 }, inverse: mass.recip() }
    }
}
