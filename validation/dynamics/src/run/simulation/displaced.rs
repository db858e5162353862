//! Forces at displaced positions, which approximate the gradient of the squared forces.

use super::{RunError, Simulation};
use psidpd_core::engine::pair_sums::COMPONENTS;
use psidpd_core::engine::{PeriodicBox, Want};
use psidpd_observe::flux::Displaced;

impl Simulation {
    /// Replaces the forces by `F(x̃)`, `x̃ = x + c F(x)/m`, for a kick of the particles at `x`.
    ///
    /// The two evaluations compute forces alone. If momentum is recorded, the second computes a virial too.
    /// The virial of forces `F̃` between the particles at `x` is `W(x̃) − Σ (x̃ − x) ⊗ F̃`, with the
    /// conservative part of `F̃`.
    pub(in crate::run) fn displaced_forces(&mut self, c: f64) -> Result<(), RunError> {
        self.compute(Want::FORCES, None)?;
        self.add_external_forces();
        self.displace(c);
        // A displaced particle may lie beyond a wall; its forces are those at its true position, not at the wall.
        let within = self.beyond_walls().map(|wide| self.particles.replace_domain(wide));
        let made = self.compute(Want { virial: self.is_recording(), ..Want::FORCES }, None);
        let wide = within.map(|within| self.particles.replace_domain(within));
        let record = made.is_ok() && self.is_recording();
        let recorded = record.then(|| (self.particles.now().x.clone(), self.forces().to_vec()));
        self.add_external_forces();
        self.step_back();
        if let Some((x, forces)) = recorded {
            let domain = wide.unwrap_or_else(|| self.particles.now().domain.clone());
            let virial = self.virial_from(&x, &forces);
            self.record_forces(virial, Some(Displaced { x, domain }));
        }
        made
    }

    /// The symmetric part of `W − Σ (x̃ − x) ⊗ F` of the last evaluation, whose positions were `to`.
    fn virial_from(&self, to: &[[f64; 3]], forces: &[[f64; 3]]) -> [f64; 6] {
        let mut virial = self.tally().virial;
        for ((to, x), f) in to.iter().zip(&self.particles.now().x).zip(forces) {
            let d = self.particles.now().domain.minimum_image(*to, *x);
            for (sum, (a, b)) in virial.iter_mut().zip(COMPONENTS) {
                *sum -= 0.5 * (d[a] * f[b] + d[b] * f[a]);
            }
        }
        virial
    }

    /// A box that holds all positions along directions with walls; `None` without walls.
    fn beyond_walls(&self) -> Option<PeriodicBox> {
        let (state, dimensions) = (self.particles.now(), self.dimensions());
        let domain = &state.domain;
        if domain.periodic()[..dimensions].iter().all(|periodic| *periodic) {
            return None;
        }
        let (mut low, mut lengths) = (domain.origin(), domain.lengths());
        for k in (0..dimensions).filter(|k| !domain.periodic()[*k]) {
            let ends =
                state.x.iter().fold([low[k], low[k] + lengths[k]], |[a, b], x| [a.min(x[k]), b.max(x[k])]);
            (low[k], lengths[k]) = (ends[0], ends[1] - ends[0]);
        }
        // Boxes with walls are never tilted. Positions that are not finite make this
        // `None`; the evaluation then refuses them.
        PeriodicBox::orthogonal(low, lengths, domain.periodic()).ok()
    }
}
