//! Figures 3 to 5 and eq. (31): the Groot–Warren fluid by ψ, with two kernels.

use super::QUADRATIC;
use crate::ExperimentError;
use crate::papers::case::{Reproduction, bare, curve, line, points};
use crate::papers::context::{Context, Fluid, mean_field, with_parameters};
use crate::run::Observed;
use crate::shipped::{LINEAR, STANDARD};
use psidpd_observe::Measured;
use std::f64::consts::PI;

fn groot_warren(
    context: &Context,
    name: &str,
    model: &str,
    rho: f64,
    changes: &[&str],
) -> Result<Observed, ExperimentError> {
    let fluid = Fluid { edge: 6.0, changes, ..Fluid::of(model) };
    context.bulk(&format!("{name}-{rho}"), &fluid, &[rho])
}

pub fn fig3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // ψ = α a n with the quadratic kernel is the pair force of strength a′ = 30 α a/π, 3.5 % less than a.
    let a = 25.0 * 0.101 * 30.0 / PI;
    let pairwise = with_parameters(STANDARD, &[("a", a)])?;
    let [mut quadratic, mut linear, mut pairs] = [Vec::new(), Vec::new(), Vec::new()];
    for rho in [3.0, 8.0, 14.0] {
        let q = groot_warren(context, "quadratic", QUADRATIC, rho, &[])?.pressure();
        let l = groot_warren(context, "linear", LINEAR, rho, &[])?.pressure();
        let p = groot_warren(context, "pairwise", &pairwise, rho, &[])?.pressure();
        outcome.own(format!("quadratic kernel beside the pair force, density {rho}"), q, p);
        let alpha = q.minus(rho).over(a * rho * rho);
        outcome.equal(format!("alpha of the quadratic kernel, density {rho}"), alpha, [0.101, 0.001]);
        quadratic.push((rho, q));
        linear.push((rho, l));
        pairs.push((rho, p));
    }
    let measured = [("quadratic kernel", quadratic), ("linear kernel", linear), ("pairwise force", pairs)];
    let published = line(2.0, 15.0, |rho| rho + 0.101 * a * rho * rho);
    let mut series = measured.map(|(name, measured)| points(name, &measured)).to_vec();
    series.push(curve("rho kT + 0.101 a' rho²", published));
    outcome.plot("pressure", "Groot–Warren", ["density", "pressure"], series);
    Ok(())
}

/// ∫(g − 1)² d³r: how far from an ideal gas the fluid is, hole and shells together.
fn structure(observed: &Observed) -> (Measured, Vec<(f64, f64)>) {
    let g = observed.profile("rdf", "g");
    let bin = g.get(1).map_or(0.0, |(r, _)| r - g[0].0);
    let (mut sum, mut variance) = (0.0, 0.0);
    for (r, g) in &g {
        let shell = 4.0 * PI * r * r * bin;
        sum += shell * (g.value - 1.0).powi(2);
        variance += (shell * 2.0 * (g.value - 1.0) * g.error).powi(2);
    }
    (Measured { value: sum, error: variance.sqrt() }, bare(&g))
}

fn compared(context: &Context, rho: f64, outcome: &mut Reproduction) -> Result<Measured, ExperimentError> {
    let rdf = &["observe.rdf={ range = 1.5, bins = 75 }"];
    let (linear, g) = structure(&groot_warren(context, "linear", LINEAR, rho, rdf)?);
    let (quadratic, h) = structure(&groot_warren(context, "quadratic", QUADRATIC, rho, rdf)?);
    let lines = vec![curve("linear kernel", g), curve("quadratic kernel", h)];
    outcome.plot("rdf", &format!("g(r) at density {rho}"), ["r", "g"], lines);
    Ok(linear.minus(quadratic))
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

/// Eq. (31): the length l₀ on which structure develops, and the structure factor.
pub fn minimum(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut lines = Vec::new();
    for (kernel, model) in [("quadratic", QUADRATIC), ("linear", LINEAR)] {
        let theory = mean_field(model, 1.0)?;
        let [second, fourth] = theory.kernel_moments()[0];
        let length = 2.0 * PI * (fourth / (12.0 * second)).sqrt();
        // "Of order of the interaction range": between half of it and twice.
        outcome.at_least(format!("l_0, {kernel} kernel"), length, 0.5);
        outcome.at_most(format!("l_0, {kernel} kernel, from above"), length, 2.0);
        let changes = &["observe.structure_factor={ range = 15.0 }"];
        let s = groot_warren(context, kernel, model, 3.0, changes)?.profile("structure_factor", "s");
        let near = |k: f64| s.iter().min_by(|a, b| (a.0 - k).abs().total_cmp(&(b.0 - k).abs()));
        // A minimum at 2π/l₀ is lower than S at the longest wave.
        if let (Some(first), Some(at)) = (s.first(), near(2.0 * PI / length)) {
            let name = format!("S(2 pi/l_0) - S at the longest wave, {kernel} kernel");
            outcome.at_most(name, at.1.minus(first.1), 0.0);
        }
        lines.push(curve(&format!("{kernel} kernel"), bare(&s)));
    }
    outcome.plot("structure", "S(k) at density 3", ["k", "S"], lines);
    Ok(())
}
