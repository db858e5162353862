//! One pair on its own, for hosts that ask about pairs.

use super::Engine;
use crate::model::pair::PairForm;

impl Engine {
    /// Pair energy, and conservative force along `ê_ij`, of the particles `i` and `j` at the distance
    /// `r`, of the given kinds.
    ///
    /// The energy is that of the terms that belong to pairs: `φ`, and ψ where it is linear in a
    /// density. The force also has the many-body part, with the slopes of ψ at the densities of the
    /// last evaluation; without those (`None`, or particles that were not there) it has not.
    pub fn single(&self, kinds: [i32; 2], r: f64, particles: Option<[usize; 2]>) -> (f64, f64) {
        match particles {
            Some(particles) => self.single_at(kinds, r, &self.slopes, particles),
            None => self.single_at(kinds, r, &[], [0, 0]),
        }
    }

    /// The same with the slopes of another evaluation, [`Plan::slope_width`](crate::engine::Plan::slope_width)
    /// for each particle.
    pub fn single_at(&self, kinds: [i32; 2], r: f64, slopes: &[f64], particles: [usize; 2]) -> (f64, f64) {
        let species = kinds.map(|k| usize::try_from(k).ok().and_then(|k| self.kinds.get(k)).copied());
        let [Some(a), Some(b)] = species else { return (0.0, 0.0) };
        let (Ok(a), Ok(b)) = (usize::try_from(a), usize::try_from(b)) else { return (0.0, 0.0) };
        let plan = &self.plan;
        let count = plan.species.len();
        let (mut energy, mut force) = (0.0, 0.0);
        for term in &plan.linear {
            let c = term.coefficients[a * count + b] + term.coefficients[b * count + a];
            energy += c * term.kernel.value(r);
            force -= c * term.force_kernel.slope(r);
        }
        for term in &plan.pairs {
            let acts = term.between == [a, b] || term.between == [b, a];
            if acts && r < term.potential.range() {
                let (phi, slope) = term.potential.at(r);
                energy += phi;
                force -= slope;
            }
        }
        let width = plan.slope_width();
        if width > 0 && particles.iter().all(|i| (i + 1) * width <= slopes.len()) {
            let [i, j] = particles.map(|i| i * width);
            for (k, d) in plan.passes.iter().enumerate() {
                let slope = slopes[i + k * count + b] + slopes[j + k * count + a];
                force -= slope * plan.densities[*d].force_kernel.slope(r);
            }
        }
        (energy, force)
    }
}
