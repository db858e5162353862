//! The force of drag and noise on particles of infinite mass, like those of a wall.
//!
//! They take the opposite of what the midpoint rule gives their partners, so that their sum is exactly the momentum that the
//! others lost.

use super::PairThermostat;
use super::noise_of;
use crate::engine::sweep::Pool;

impl PairThermostat {
    /// Sets whether later updates by the midpoint rule find the forces on particles of infinite mass.
    pub fn ask_for_forces_on_fixed(&mut self, on: bool) {
        self.on_fixed.is_asked = on;
        self.on_fixed.force.clear();
    }

    /// The mean force of drag and noise on each particle of infinite mass, over the time of the last update by the midpoint
    /// rule; zero for others. Empty if nobody asked for it.
    pub fn forces_on_fixed(&self) -> &[[f64; 3]] {
        &self.on_fixed.force
    }

    /// Sums the forces at the vectors of the last `gather`.
    pub(super) fn sum_forces_on_fixed(&mut self, pool: &Pool, owned: usize) {
        if !self.on_fixed.is_asked {
            return;
        }
        let PairThermostat { planes, lists, labels, sums, masses, set, kt, dt, on_fixed, .. } = self;
        sums.compute(pool, *set, planes, noise_of(self.noise, labels, *kt));
        on_fixed.force.clear();
        on_fixed.force.resize(owned, [0.0; 3]);
        let order = lists.order();
        for ((host, sum), mass) in order.iter().zip(&sums.all).zip(masses) {
            let Some(force) = on_fixed.force.get_mut(*host as usize) else { continue };
            if mass.inverse == 0.0 {
                *force = std::array::from_fn(|c| -2.0 / *dt * sum[c]);
            }
        }
    }
}
