//! Masses in the order of cells.

use super::pass::fill;
use psidpd_threads::Pool;

/// The masses of sorted particles.
#[derive(Debug, Clone, Default)]
pub struct Masses {
    /// Mass of each particle; 0 where it is infinite.
    pub inertia: Vec<f64>,
    pub inverse: Vec<f64>,
}

impl Masses {
    /// Sorts the masses of the host's particles, which may be infinite.
    pub fn sort(&mut self, pool: &Pool, order: &[u32], mass: impl Fn(usize) -> f64 + Sync) {
        fill(pool, &mut self.inverse, order, |k| mass(k).recip());
        fill(pool, &mut self.inertia, order, |k| {
            let m = mass(k);
            if m.is_finite() { m } else { 0.0 }
        });
    }
}
