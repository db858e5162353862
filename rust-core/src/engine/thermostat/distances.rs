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

    /// The number of the pair of species of two sorted particles.
    #[inline(always)]
    pub fn kind(&self, i: usize, j: usize) -> u16 {
        match self.species {
            1 => 0,
            count => u16::from(self.of_particles[i]) * count as u16 + u16::from(self.of_particles[j]),
        }
    }

    /// The ratio `r/|g|` of a pair of sorted particles; 1 of a pair at one point.
    #[inline(always)]
    pub fn per_length(&self, i: usize, j: usize, [x, y, z]: [f64; 3]) -> f64 {
        let length = (x * x + y * y + z * z).sqrt();
        self.weights[usize::from(self.kind(i, j))].per_length::<false>(length)
    }

    /// The same of pairs with vectors of the components `x`, `y` and `z`, by their pairs of species, to as many `ratios`.
    #[inline(always)]
    pub fn per_lengths<const N: usize>(
        &self,
        [x, y, z]: &[[f64; N]; 3],
        kinds: &[u16],
        ratios: &mut [f64; N],
    ) {
        let lengths =
            x.iter().zip(y).zip(z).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).zip(&mut *ratios);
        match &self.weights[..] {
            [weight] if weight.exponent == 1.0 => {
                lengths.take(kinds.len()).for_each(|(length, to)| *to = weight.per_length::<true>(length));
            }
            weights => lengths.zip(kinds).for_each(|((length, to), kind)| {
                *to = weights[usize::from(*kind)].per_length::<false>(length);
            }),
        }
    }
}

impl Weight {
    /// The ratio `r/|g|` at a length `|g|`.
    #[inline(always)]
    fn per_length<const LINEAR: bool>(&self, length: f64) -> f64 {
        let weight = length * self.inverse_amplitude;
        let left = match LINEAR || self.exponent == 1.0 {
            true => weight,
            false => weight.powf(self.exponent.recip()),
        };
        let ratio = self.range * (1.0 - left).max(LEAST) / length;
        if length > 0.0 { ratio } else { 1.0 }
    }
}
