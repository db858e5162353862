//! What can be known of a model before it runs: what will be computed, what mean field says, and what
//! cannot work.

mod cost;
mod findings;
mod timestep;
mod viscosity;
mod warnings;

pub use cost::{Cost, cost};
pub use findings::{Findings, Severity, Warning};
pub use timestep::{StepEstimate, Steps, UnknownStep, estimates};
pub use viscosity::{Flow, flow, flow_of_scene};
pub use warnings::uncalibrated;

use crate::ExperimentError;
use psidpd_core::engine::Plan;
use psidpd_core::model::{Fluid, Model};
use psidpd_core::theory::{MeanField, TheoryError};
use psidpd_dynamics::prediction;

/// Checks a model at a temperature and at the number density of each species; `None` leaves out what depends on these.
pub fn check(model: &Model, kt: f64, densities: Option<&[f64]>) -> Result<Findings, ExperimentError> {
    let fluid: Fluid = model.at(kt)?;
    if let Some(densities) = densities
        && densities.len() != fluid.species.len()
    {
        return Err(ExperimentError::Densities { given: densities.len(), species: fluid.species.len() });
    }
    let plan = Plan::new(&fluid)?;
    // Mean field starts from a free energy, which a law of stated slopes does not have, and from integrals of the pair
    // potentials, which those that rise too steeply do not have.
    let (theory, no_theory) =
        match fluid.stated_slopes().map_or_else(|| MeanField::new(&fluid).map(Some), |_| Ok(None)) {
            Ok(theory) => (theory, None),
            Err(reason @ (TheoryError::NotIntegrable(..) | TheoryError::TooLarge(_))) => (None, Some(reason)),
            Err(other) => return Err(other.into()),
        };
    let at = theory.as_ref().zip(densities);
    let stability = at.map(|(theory, rho)| theory.stability(rho));
    let pressure = at.map(|(theory, rho)| theory.pressure(rho));
    let state = warnings::State { densities, pressure, stability: stability.as_ref(), no_theory };
    let one = |rho: &[f64]| (rho.len() == 1).then(|| rho[0]);
    let prediction = prediction::predict(&fluid, densities.and_then(one));
    let mut found = warnings::all(&fluid, &state)?;
    if prediction.as_ref().and_then(|p| p.freezing).is_some_and(|f| f.is_certain()) {
        found.push(warnings::crystal());
        found.sort_by_key(|w| std::cmp::Reverse(w.severity));
    }
    Ok(Findings {
        title: model.title.clone(),
        reference: model.reference.clone(),
        plan: plan.to_string(),
        kt,
        pressure,
        pressure_slope: at.map(|(theory, rho)| theory.pressure_slope(rho)),
        stability: stability.map(Into::into),
        densities: densities.map(<[f64]>::to_vec),
        steps: Vec::new(),
        unknown_steps: Vec::new(),
        cost: None,
        flow: flow(&fluid, 1.0, densities.and_then(one)),
        theory: prediction.map_or(Vec::new(), |p| p.summary()),
        warnings: found,
    })
}

#[cfg(test)]
mod tests;
