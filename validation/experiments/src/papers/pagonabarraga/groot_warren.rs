//! Figures 3 to 5: the Groot–Warren fluid by ψ, with two kernels.

use super::QUADRATIC;
use crate::ExperimentError;
use crate::bulk::Observed;
use crate::models::{LINEAR, STANDARD};
use crate::papers::case::{Reproduction, bare, difference, line, profile};
use crate::papers::context::{Context, Fluid, with_parameters};
use psidpd_observe::Measured;

pub fn groot_warren(
    context: &Context,
    name: &str,
    model: &str,
    rho: f64,
    observe: &str,
) -> Result<Observed, ExperimentError> {
    let fluid = Fluid { model, kt: 1.0, dt: 0.01, edge: 6.0, observe };
    context.bulk(&format!("{name}-{rho}"), &fluid, &[rho])
}

pub fn fig3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // ψ = α a n with the quadratic kernel is the pair force of strength a′ = 30 α a/π, 3.5 % less than a.
    let a = 25.0 * 0.101 * 30.0 / std::f64::consts::PI;
    let pairwise = with_parameters(STANDARD, &[("a", a)])?;
    let [mut quadratic, mut linear, mut pairs] = [Vec::new(), Vec::new(), Vec::new()];
    for rho in [3.0, 8.0, 14.0] {
        let q = groot_warren(context, "quadratic", QUADRATIC, rho, "")?.pressure();
        let l = groot_warren(context, "linear", LINEAR, rho, "")?.pressure();
        let p = groot_warren(context, "pairwise", &pairwise, rho, "")?.pressure();
        outcome.own(format!("quadratic kernel beside the pair force, density {rho}"), q, p);
        let excess = Measured { value: (q.value - rho) / (a * rho * rho), error: q.error / (a * rho * rho) };
        if rho > 3.0 {
            outcome.equal(format!("alpha of the quadratic kernel, density {rho}"), excess, 0.101, 0.001);
        }
        quadratic.push((rho, q));
        linear.push((rho, l));
        pairs.push((rho, p));
    }
    let measured = [("quadratic kernel", quadratic), ("linear kernel", linear), ("pairwise force", pairs)];
    let published = line(2.0, 15.0, |rho| rho + 0.101 * a * rho * rho);
    outcome.plot(
        "pressure",
        "Groot–Warren",
        ["density", "pressure"],
        &measured,
        &[("rho kT + 0.101 a' rho²", published)],
    );
    Ok(())
}

/// ∫(g − 1)² d³r: how far from an ideal gas the fluid is, hole and shells together.
fn structure(observed: &Observed) -> (Measured, Vec<(f64, f64)>) {
    let g = profile(observed, "rdf", "g");
    let bin = g.get(1).map_or(0.0, |(r, _)| r - g[0].0);
    let (mut sum, mut variance) = (0.0, 0.0);
    for (r, g) in &g {
        let shell = 4.0 * std::f64::consts::PI * r * r * bin;
        sum += shell * (g.value - 1.0).powi(2);
        variance += (shell * 2.0 * (g.value - 1.0) * g.error).powi(2);
    }
    (Measured { value: sum, error: variance.sqrt() }, bare(&g))
}

fn compared(context: &Context, rho: f64, outcome: &mut Reproduction) -> Result<Measured, ExperimentError> {
    let rdf = "rdf = { range = 1.5, bins = 75 }";
    let (linear, g) = structure(&groot_warren(context, "linear", LINEAR, rho, rdf)?);
    let (quadratic, h) = structure(&groot_warren(context, "quadratic", QUADRATIC, rho, rdf)?);
    let lines = [("linear kernel", g), ("quadratic kernel", h)];
    outcome.plot("rdf", &format!("g(r) at density {rho}"), ["r", "g"], &[], &lines);
    Ok(difference(linear, quadratic))
}

const WHAT: &str = "integral of (g - 1)^2, linear minus quadratic";

pub fn fig4(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let difference = compared(context, 3.0, outcome)?;
    outcome.at_most(WHAT, difference, 0.0);
    Ok(())
}

pub fn fig5(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let difference = compared(context, 14.0, outcome)?;
    outcome.at_least(WHAT, difference, 0.0);
    Ok(())
}
