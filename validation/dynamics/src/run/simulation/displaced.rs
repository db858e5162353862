//! Forces at displaced positions, which approximate the gradient of the squared forces.

use super::{RunError, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::COMPONENTS;

impl Simulation {
    /// Replaces the forces by `F(x̃)`, `x̃ = x + c F(x)/m`, for a kick of the particles at `x`.
    ///
    /// The two evaluations compute forces alone. If a sum of momentum is recorded, the second computes a virial too.
    /// The virial of forces `F̃` between the particles at `x` is `W(x̃) − Σ (x̃ − x) ⊗ F̃`, with the
    /// conservative part of `F̃`.
    pub(in crate::run) fn displaced_forces(&mut self, c: f64) -> Result<(), RunError> {
        self.compute(Want::FORCES, None)?;
        self.add_external_forces();
        self.displace(c);
        let made = self.compute(Want { virial: self.records_sum(), ..Want::FORCES }, None);
        let record = made.is_ok() && self.is_recording();
        let recorded = record.then(|| (self.particles.now().x.clone(), self.forces().to_vec()));
        self.add_external_forces();
        self.step_back();
        if let Some((x, forces)) = recorded {
            let virial = if self.records_sum() { self.virial_from(&x, &forces) } else { [0.0; 6] };
            self.record_forces(virial, Some(x));
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
}
