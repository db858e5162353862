//! Section 11.2: pressure and compressibility of standard DPD.

use super::fluid;
use crate::ExperimentError;
use crate::papers::case::{Reproduction, line};
use crate::papers::context::Context;
use psidpd_observe::Measured;

/// a r_c⁴ of the model.
const A: f64 = 25.0;

pub fn alpha(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut points = Vec::new();
    for rho in [4.0, 6.0, 8.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid(), &[rho])?.pressure();
        let scale = 1.0 / (A * rho * rho);
        let mut excess = p;
        excess.value -= rho;
        outcome.equal(format!("alpha at density {rho}"), excess.times(scale), 0.101, 0.001);
        points.push((rho, p));
    }
    let published = line(3.0, 9.0, |rho| rho + 0.101 * A * rho * rho);
    outcome.plot(
        "pressure",
        "Standard DPD",
        ["density", "pressure"],
        &[("measured", points)],
        &[("rho kT + 0.101 a rho²", published)],
    );
    Ok(())
}

pub fn water(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let [low, high] = [2.5, 3.5];
    let a = context.bulk("below", &fluid(), &[low])?.pressure();
    let b = context.bulk("above", &fluid(), &[high])?.pressure();
    let slope =
        Measured { value: (b.value - a.value) / (high - low), error: a.error.hypot(b.error) / (high - low) };
    // 1 + 2 alpha a rho/kT with alpha = 0.101(1) is 16.15(15); water has 15.98.
    outcome.equal("dp/drho / kT at density 3", slope, 16.15, 0.15);
    Ok(())
}
