//! Drag and noise as forces on the particles of a host.

use super::PairThermostat;
use super::pass::{Sums, Wide, add_to_host, virial};
use crate::engine::sweep::Pool;

impl PairThermostat {
    /// Adds drag at the velocities `v`, or the random force, or both, to `force`; returns their
    /// virial, if distances were stored.
    pub fn add_forces(
        &mut self,
        pool: &Pool,
        v: &[[f64; 3]],
        drag: bool,
        noise: bool,
        force: &mut [[f64; 3]],
    ) -> [f64; 6] {
        self.assert_pairs();
        let PairThermostat { planes, lists, set, sums, kt, dt, .. } = self;
        let factor = 2.0 / *dt;
        let noise = if noise { kt.sqrt() } else { 0.0 };
        sums.gather(pool, lists.order(), v);
        if !drag {
            sums.p.fill(Wide::ZERO);
        }
        sums.compute(pool, *set, planes, noise);
        let virial = virial(pool, planes, sums, noise, factor);
        // Frozen particles receive forces like others; the integrator does not move them.
        let all: Vec<Wide> = Sums::halves(&mut sums.of_plane, planes)
            .flat_map(|(own, below)| {
                let below = below.iter().chain(std::iter::repeat(&Wide::ZERO));
                own.iter().zip(below).map(|(a, b)| Wide([0, 1, 2, 3].map(|c| a[c] + b[c])))
            })
            .collect();
        add_to_host(pool, &lists.place, &all, -factor, force);
        virial
    }
}
