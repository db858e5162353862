//! Figure 2: the equation of state.

use super::EOS;
use crate::ExperimentError;
use crate::papers::case::{Reproduction, curve, line, points};
use crate::papers::context::{Context, Fluid, edited};

pub fn fig2(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let fluid = Fluid { edge: 8.0, ..Fluid::of(EOS) };
    let published = |rho: f64| rho / (1.0 - 0.0134 * rho) - 0.0333 * rho * rho;
    let [mut whole, mut halves] = [Vec::new(), Vec::new()];
    for rho in [2.0, 5.0, 10.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid, &[rho])?.configurational_pressure();
        // The last printed digits of b and a.
        let b = 0.00005 * (rho / (1.0 - 0.0134 * rho)).powi(2);
        let fit = [published(rho), b.hypot(0.00005 * rho * rho)];
        outcome.equal(format!("pressure at density {rho}"), p, fit);
        whole.push((rho, p));
        // Both strengths halved, or kT doubled and p in units of it.
        let half = edited(EOS, &["pair.1.strength=0.5"])?;
        let half = Fluid { model: &half, ..fluid };
        let p = context.bulk(&format!("half-rho{rho}"), &half, &[rho])?.configurational_pressure();
        outcome.equal(format!("pressure of half the potential at density {rho}"), p, fit);
        halves.push((rho, p));
    }
    let fit = curve("van der Waals fit of the paper", line(0.0, 11.0, published));
    let series = vec![points("measured", &whole), points("half the potential", &halves), fit];
    outcome.plot("pressure", "Spline potential", ["density", "pressure"], series);
    Ok(())
}
