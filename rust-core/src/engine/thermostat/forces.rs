//! Drag and noise as forces on the particles of a host.

use super::PairThermostat;
use super::noise_of;
use super::pass::{Wide, add_to_host};
use crate::engine::sweep::Pool;

impl PairThermostat {
    /// Adds drag at the velocities `v`, or the random force, or both, to `force`; returns their
    /// virial, if it is requested.
    pub fn add_forces(
        &mut self,
        pool: &Pool,
        v: &[[f64; 3]],
        drag: bool,
        noise: bool,
        force: &mut [[f64; 3]],
    ) -> [f64; 6] {
        self.assert_pairs();
        let PairThermostat { planes, lists, labels, set, sums, kt, .. } = self;
        let of_pairs = if noise { noise_of(self.noise, labels, *kt) } else { None };
        sums.gather(pool, lists.order(), v);
        if !drag {
            sums.p.fill(Wide::ZERO);
        }
        sums.compute(pool, *set, planes, of_pairs);
        let [of_drag, of_noise] = if self.kept.virial { self.virials(pool, noise) } else { [[0.0; 6]; 2] };
        // Frozen particles receive forces like others; the integrator does not move them.
        add_to_host(pool, &self.lists.place, &self.sums.all, -2.0 / self.dt, force);
        std::array::from_fn(|c| of_drag[c] + of_noise[c])
    }
}
