//! The weights that the search and the forces list pairs with.

use crate::engine::plan::ThermostatPlan;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::plane::list::WeightTables;

/// The amplitude `√(½ Δt γ)`, the inverse range and the exponent of `w_R`, by pairs of species.
pub fn weights(plan: &ThermostatPlan, dt: f64) -> WeightTables<f64> {
    let table =
        |values: &[f64], of: &dyn Fn(f64) -> f64| SpeciesPairTable::new(values.iter().map(|x| of(*x)));
    let acts = |e: f64| plan.exponent.iter().zip(&plan.gamma).all(|(x, gamma)| *gamma == 0.0 || *x == e);
    WeightTables {
        species: plan.gamma.len().isqrt(),
        amplitude: table(&plan.gamma, &|gamma| (0.5 * dt * gamma).sqrt()),
        // For a range of zero every pair is beyond the range.
        inverse_range: table(&plan.range, &|r| {
            if r > 0.0 { 1.0 / r } else { f64::MAX }
        }),
        exponent: match () {
            () if acts(1.0) => Exponent::One,
            () if acts(2.0) => Exponent::Two,
            () => Exponent::Any(table(&plan.exponent, &|e| e)),
        },
    }
}
