//! Pairs from the host, for hosts that know more about pairs than where the particles are.

use super::{Engine, Particles};
use crate::engine::error::EngineError;
use crate::engine::pairs::Newton;

/// The pairs of one step, as the host lists them: at least all within the cut-off of the model, those
/// of two owned particles once, those of an owned particle `i` and a ghost `j` on either side.
///
/// Pairs that are not listed do not interact. `factor` scales a pair's conservative interaction:
/// `U = Σ ψ(n_i) + Σ s φ` with `n_i = Σ s w`. Drag and noise act at full strength, so that the
/// thermostat keeps its temperature whatever the factors.
#[derive(Debug, Clone, Copy)]
pub struct PairsOfHost<'a> {
    /// The first particle of each pair, owned.
    pub i: &'a [i32],
    /// The second.
    pub j: &'a [i32],
    /// Strengths; empty if all are one.
    pub factor: &'a [f64],
}

impl Engine {
    /// As [`Engine::densities`], with the host's pairs in place of the engine's search.
    ///
    /// # Errors
    /// As [`Engine::densities`]; also an index out of range.
    pub fn densities_of_pairs(
        &mut self,
        particles: &Particles,
        listed: &PairsOfHost,
        newton: Newton,
    ) -> Result<(), EngineError> {
        self.take_species(particles)?;
        self.owned = particles.owned;
        let (all, owned) = (particles.x.len(), particles.owned);
        let scaled = !listed.factor.is_empty();
        if listed.i.len() != listed.j.len() || (scaled && listed.factor.len() != listed.i.len()) {
            return Err(EngineError::Host("the arrays of a pair list have different lengths"));
        }
        for (k, x) in particles.x.iter().enumerate() {
            if self.species[k] >= 0 && !x.iter().all(|c| c.is_finite()) {
                return Err(EngineError::Position { tag: particles.tag[k] });
            }
        }
        self.pairs.clear(owned, newton);
        let cutoff_squared = self.plan.cutoff() * self.plan.cutoff();
        let dimensions = self.plan.dimensions();
        for (k, (i, j)) in listed.i.iter().zip(listed.j).enumerate() {
            let (i, j) = (*i as usize, *j as usize);
            if i >= owned || j >= all {
                return Err(EngineError::Host("a pair list names a particle that is not there"));
            }
            if self.species[i] < 0 || self.species[j] < 0 {
                continue;
            }
            let (a, b) = (particles.x[i], particles.x[j]);
            let d = std::array::from_fn(|c| if c < dimensions { a[c] - b[c] } else { 0.0 });
            if d.iter().map(|c: &f64| c * c).sum::<f64>() >= cutoff_squared {
                continue;
            }
            if scaled {
                self.pairs.push_scaled(i, j, d, listed.factor[k], particles.tag, &self.species);
            } else {
                self.pairs.push(i, j, d, particles.tag, &self.species);
            }
        }
        self.counts.search += 1;
        self.sum_densities();
        self.evaluate_excess(particles.tag)
    }
}
