//! Figures 1, 2, 3, 6 and 7: pressures, with and without the corrected density.

use super::density::compare_line;
use super::{FIT_DENSITIES, K2, K4, LENNARD_JONES, fluid, point};
use crate::ExperimentError;
use crate::calibrate::DUMMY_SLOPE;
use crate::papers::case::{Reproduction, curve, line, points};
use crate::papers::context::{Context, mean_field, with_parameters};
use psidpd_observe::Measured;

/// What the quadratic equation of state cannot have.
pub fn fig1(_: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let ratio = |model: &str, rho: f64| -> Result<f64, ExperimentError> {
        let theory = mean_field(model, 1.0)?;
        Ok(rho * theory.pressure_slope(&[rho]) / theory.pressure(&[rho]))
    };
    for rho in [1.0, 3.0, 10.0, 100.0] {
        outcome.at_most(format!("stiffness over pressure, k = 2, density {rho}"), ratio(K2, rho)?, 2.0);
    }
    outcome.at_least("stiffness over pressure, k = 4, density 10", ratio(K4, 10.0)?, 3.9);
    let theory = mean_field(K2, 1.0)?;
    let densities = || (1..=100).map(|step| 0.05 * f64::from(step));
    let pressure = |rho: f64| theory.pressure(&[rho]);
    let stiffness = densities().map(|rho| (pressure(rho), rho * theory.pressure_slope(&[rho]))).collect();
    let twice = densities().map(|rho| (pressure(rho), 2.0 * pressure(rho))).collect();
    let lines = vec![curve("p = rho kT + 10 rho²", stiffness), curve("slope 2", twice)];
    outcome.plot("stiffness", "Inverse compressibility", ["pressure", "1/compressibility"], lines);
    Ok(())
}

/// p/p_theory at several densities, with the plot of both.
fn pressures(
    context: &Context,
    outcome: &mut Reproduction,
    model: &str,
    densities: &[f64],
) -> Result<Vec<(f64, Measured)>, ExperimentError> {
    let theory = mean_field(model, 1.0)?;
    let pressure = |rho: f64| theory.pressure(&[rho]);
    let measured = context.pressures("rho", &fluid(model), densities)?;
    // All end at density 10.
    let series = vec![points("measured", &measured), curve("wanted", line(0.5, 10.0, pressure))];
    outcome.plot("pressure", "Pressure", ["density", "pressure"], series);
    Ok(measured.into_iter().map(|(rho, p)| (rho, p.times(1.0 / pressure(rho)))).collect())
}

pub fn too_low(
    context: &Context,
    outcome: &mut Reproduction,
    model: &str,
    share: f64,
) -> Result<(), ExperimentError> {
    for (rho, p) in pressures(context, outcome, model, &[3.0, 6.0, 10.0])? {
        let missing = Measured::from(1.0).minus(p);
        outcome.at_least(format!("share of the pressure that is missing at density {rho}"), missing, share);
    }
    Ok(())
}

pub fn agrees(context: &Context, outcome: &mut Reproduction, model: &str) -> Result<(), ExperimentError> {
    for (rho, p) in pressures(context, outcome, model, &[4.0, 6.0, 8.0, 10.0])? {
        // The paper states an error of 1 % of the pressure.
        outcome.equal(format!("pressure over the wanted one at density {rho}"), p, [1.0, 0.01]);
    }
    Ok(())
}

pub fn fig7(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // The first guess rho~ = rho: at each density the power law k = 2 of the strength 1.05 psi'(rho).
    let theory = mean_field(LENNARD_JONES, 1.0)?;
    let mut found = Vec::new();
    for rho in FIT_DENSITIES {
        let strength = DUMMY_SLOPE * theory.excess_slopes(0, &[rho])[0];
        let model = with_parameters(K2, &[("A", strength)])?;
        found.push(point(&context.bulk(&format!("first-rho{rho}"), &fluid(&model), &[rho])?, rho));
    }
    compare_line(outcome, &found, 1.39, 1.062);
    agrees(context, outcome, LENNARD_JONES)
}
