//! Figure 6: the homogeneous van der Waals fluid.

use crate::ExperimentError;
use crate::models::VAN_DER_WAALS;
use crate::papers::case::{Reproduction, line};
use crate::papers::context::{Context, Fluid};

pub fn fig6(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // The equation of state with the printed parameters: a = 1.9 b, alpha_3 = 5.
    let (kt, b) = (2.5, 0.016);
    let pressure = |rho: f64| rho * kt / (1.0 - b * rho) - 1.9 * b * rho * rho * (1.0 + 5.0 * b * rho);
    let fluid = Fluid { model: VAN_DER_WAALS, kt, dt: 0.01, edge: 7.0, observe: "" };
    let mut points = Vec::new();
    for rho in [10.0, 20.0, 30.0, 40.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid, &[rho])?.pressure();
        // The paper has "only small deviations" and no number: that of reading its figure, 2 % of the ideal part.
        let ideal = rho * kt / (1.0 - b * rho);
        outcome.equal(format!("pressure at density {rho}"), p, pressure(rho), 0.02 * ideal);
        points.push((rho, p));
    }
    let published = line(2.0, 45.0, pressure);
    outcome.plot(
        "pressure",
        "Van der Waals, kT = 2.5",
        ["density", "pressure"],
        &[("measured", points)],
        &[("equation of state", published)],
    );
    Ok(())
}
