//! The weights that the search and the forces list pairs with.

use crate::engine::plan::ThermostatPlan;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::plane::list::WeightTables;

/// The amplitude `√(½ Δt γ)`, the inverse range and the exponent of `w_R`, by pairs of species.
pub fn weights(plan: &ThermostatPlan, dt: f64) -> WeightTables<f64> {
    WeightTables {
        species: plan.gamma.len().isqrt(),
        amplitude: SpeciesPairTable::new(plan.gamma.iter().map(|gamma| (0.5 * dt * gamma).sqrt())),
        inverse_range: WeightTables::inverse_ranges(&plan.range),
        exponent: plan.exponent_of_weights(),
    }
}
