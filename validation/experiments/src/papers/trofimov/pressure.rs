//! Figures 2, 3, 6 and 7: pressures with and without the corrected density.

use super::density::compare_line;
use super::{FIT_DENSITIES, K2, K3, K3_CORRECTED, K4, LENNARD_JONES, fluid, point};
use crate::ExperimentError;
use crate::calibrate::DUMMY_SLOPE;
use crate::papers::case::{Reproduction, line};
use crate::papers::context::{Context, mean_field, with_parameters};
use psidpd_observe::Measured;

/// p/p_theory at several densities, with the plot of both.
fn pressures(
    context: &Context,
    outcome: &mut Reproduction,
    model: &str,
    densities: &[f64],
) -> Result<Vec<(f64, Measured)>, ExperimentError> {
    let theory = mean_field(model, 1.0)?;
    let mut points = Vec::new();
    let mut shares = Vec::new();
    for rho in densities {
        let p = context.bulk(&format!("rho{rho}"), &fluid(model), &[*rho])?.pressure();
        points.push((*rho, p));
        shares.push((*rho, p.times(1.0 / theory.pressure(&[*rho]))));
    }
    let last = densities.last().copied().unwrap_or(10.0);
    let wanted = line(0.5, last, |rho| theory.pressure(&[rho]));
    outcome.plot(
        "pressure",
        "Pressure",
        ["density", "pressure"],
        &[("measured", points)],
        &[("wanted", wanted)],
    );
    Ok(shares)
}

fn too_low(
    context: &Context,
    outcome: &mut Reproduction,
    model: &str,
    share: f64,
) -> Result<(), ExperimentError> {
    for (rho, p) in pressures(context, outcome, model, &[3.0, 6.0, 10.0])? {
        let missing = Measured { value: 1.0 - p.value, error: p.error };
        outcome.at_least(format!("share of the pressure that is missing at density {rho}"), missing, share);
    }
    Ok(())
}

pub fn fig2(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    too_low(context, outcome, K3, 0.20)
}

pub fn fig3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    too_low(context, outcome, K4, 0.40)
}

fn agrees(context: &Context, outcome: &mut Reproduction, model: &str) -> Result<(), ExperimentError> {
    for (rho, p) in pressures(context, outcome, model, &[4.0, 6.0, 8.0, 10.0])? {
        // The paper states an error of 1 % of the pressure.
        outcome.equal(format!("pressure over the wanted one at density {rho}"), p, 1.0, 0.01);
    }
    Ok(())
}

pub fn fig6(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    agrees(context, outcome, K3_CORRECTED)
}

pub fn fig7(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // The first guess rho~ = rho: at each density the power law k = 2 of the strength 1.05 psi'(rho).
    let theory = mean_field(LENNARD_JONES, 1.0)?;
    let mut points = Vec::new();
    for rho in FIT_DENSITIES {
        let strength = DUMMY_SLOPE * theory.excess_slopes(0, &[rho])[0];
        let model = with_parameters(K2, &[("A", strength)])?;
        points.push(point(&context.bulk(&format!("first-rho{rho}"), &fluid(&model), &[rho])?, rho));
    }
    compare_line(outcome, &points, 1.39, 1.062);
    agrees(context, outcome, LENNARD_JONES)
}
