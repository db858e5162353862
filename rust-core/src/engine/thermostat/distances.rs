//! The distances of listed pairs, from the lengths of their vectors.
//!
//! With `|g| = √(½ Δt γ) (1 − r/R)^e` the distance is `r = R (1 − (|g|/√(½ Δt γ))^{1/e})`. It is only wanted in steps whose virial is, so
//! that a number for each pair would be memory that most steps do not use. A relative error ε of `|g|` becomes one of `R ε/e` of `r`: 10⁻⁷ in
//! single precision.

use crate::engine::plan::ThermostatPlan;

/// A distance below which pairs are taken to have it, in ranges. Rounding errors are larger.
const LEAST: f64 = 1e-9;

/// The distances of the pairs for one time.
#[derive(Debug)]
pub struct Distances<'a> {
    /// By pairs of species.
    weights: Vec<Weight>,
    species: usize,
    /// Species of the sorted particles; empty with one species.
    of_particles: &'a [u8],
}

/// The weight `a (1 − r/R)^e` of a pair of species.
#[derive(Debug)]
struct Weight {
    inverse_amplitude: f64,
    range: f64,
    exponent: f64,
}

impl Distances<'_> {
    pub fn new<'a>(plan: &ThermostatPlan, dt: f64, of_particles: &'a [u8]) -> Distances<'a> {
        let weight = |k: usize| Weight {
            inverse_amplitude: (0.5 * dt * plan.gamma[k]).sqrt().recip(),
            range: plan.range[k],
            exponent: plan.exponent[k],
        };
        let weights = (0..plan.gamma.len()).map(weight).collect();
        Distances { weights, species: plan.gamma.len().isqrt(), of_particles }
    }

    /// The ratio `r/|g|` of a pair of sorted particles; 1 of a pair at one point.
    #[inline(always)]
    pub fn per_length(&self, i: usize, j: usize, g: [f64; 3]) -> f64 {
        let pair = match self.species {
            1 => 0,
            count => usize::from(self.of_particles[i]) * count + usize::from(self.of_particles[j]),
        };
        let Weight { inverse_amplitude, range, exponent } = self.weights[pair];
        let length = (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
        if length == 0.0 {
            return 1.0;
        }
        let weight = length * inverse_amplitude;
        let left = if exponent == 1.0 { weight } else { weight.powf(exponent.recip()) };
        range * (1.0 - left).max(LEAST) / length
    }
}
