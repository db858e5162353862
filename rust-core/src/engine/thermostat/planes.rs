//! The pairs of one plane of cells, and their noise.

use crate::engine::plan::ThermostatPlan;
use crate::engine::sweep::PlanePairs;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::noise::{Law, PairNoise};
use psidpd_passes::plane::list::{PairList, WeightTables, pairs_of_each};
use std::ops::Range;

/// Pairs whose first particle is in one plane; the second is in the same plane or in the next.
#[derive(Debug, Clone, Default)]
pub struct Plane {
    pub found: PlanePairs,
    /// Noise of each pair.
    pub xi: Vec<f32>,
}

impl AsMut<PlanePairs> for Plane {
    fn as_mut(&mut self) -> &mut PlanePairs {
        &mut self.found
    }
}

/// The amplitude `√(½ Δt γ)`, the inverse range, which is extended by `margin`, and the
/// exponent of `w_R`, by pairs of species.
pub fn weights(plan: &ThermostatPlan, dt: f64, margin: f64) -> WeightTables {
    let table =
        |values: &[f64], of: &dyn Fn(f64) -> f64| SpeciesPairTable::new(values.iter().map(|x| of(*x) as f32));
    let acts = |e: f64| plan.exponent.iter().zip(&plan.gamma).all(|(x, gamma)| *gamma == 0.0 || *x == e);
    WeightTables {
        species: plan.gamma.len().isqrt(),
        amplitude: table(&plan.gamma, &|gamma| (0.5 * dt * gamma).sqrt()),
        // For a range of zero every pair is beyond the range.
        inverse_range: table(&plan.range, &|r| {
            if r > 0.0 { 1.0 / (r * (1.0 + margin)) } else { f64::from(f32::MAX) }
        }),
        exponent: match () {
            () if acts(1.0) => Exponent::One,
            () if acts(2.0) => Exponent::Two,
            () => Exponent::Any(table(&plan.exponent, &|e| e)),
        },
    }
}

/// The sorted index of the second particle of a pair, whose own index continues from a plane to the next.
pub fn second(own: &Range<usize>, next: &Range<usize>, j: u32) -> usize {
    let j = j as usize;
    j.checked_sub(own.len()).map_or(own.start + j, |k| next.start + k)
}

impl Plane {
    /// The sorted indices of the two particles of each pair, and the index of the pair in the list.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 3]> {
        let PlanePairs { own, next, list } = &self.found;
        pairs_of_each(&list.start).flat_map(move |(i, of_i)| {
            of_i.map(move |k| [own.start + i, second(own, next, list.pairs[k].j), k])
        })
    }

    /// Draws the noise of the pairs.
    pub fn draw(&mut self, noise: PairNoise, law: Law) {
        let PairList { pairs, tags: [a, b], .. } = &self.found.list;
        self.xi.resize(pairs.len(), 0.0);
        noise.fill(law, a, b, &mut self.xi);
    }
}
