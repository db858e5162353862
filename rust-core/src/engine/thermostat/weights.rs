//! The weights that the search and the forces list pairs with.

use crate::engine::plan::ThermostatPlan;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::plane::list::WeightTables;

/// The amplitude `√(½ Δt γ)`, the inverse range and the exponent of `w_R`, by pairs of species.
pub fn weights(plan: &ThermostatPlan, dt: f64) -> WeightTables<f64> {
    // For a range of zero every pair is beyond the range.
    let inverse = |range: &f64| if *range > 0.0 { 1.0 / range } else { f64::MAX };
    WeightTables {
        species: plan.gamma.len().isqrt(),
        amplitude: SpeciesPairTable::new(plan.gamma.iter().map(|gamma| (0.5 * dt * gamma).sqrt())),
        inverse_range: SpeciesPairTable::new(plan.range.iter().map(inverse)),
        exponent: plan.exponent_of_weights(),
    }
}
