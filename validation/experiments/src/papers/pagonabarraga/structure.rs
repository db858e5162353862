//! Eq. (31): the length l₀ on which structure develops, and the structure factor.

use super::QUADRATIC;
use super::groot_warren::groot_warren;
use crate::ExperimentError;
use crate::models::LINEAR;
use crate::papers::case::{Reproduction, bare, difference, exact, profile};
use crate::papers::context::{Context, mean_field};
use psidpd_observe::Measured;
use std::f64::consts::PI;

pub fn minimum(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut lines = Vec::new();
    for (kernel, model) in [("quadratic", QUADRATIC), ("linear", LINEAR)] {
        let theory = mean_field(model, 1.0)?;
        let [second, fourth] = theory.kernel_moments()[0];
        let length = 2.0 * PI * (fourth / (12.0 * second)).sqrt();
        // "Of order of the interaction range": between half of it and twice.
        outcome.at_least(format!("l_0, {kernel} kernel"), exact(length), 0.5);
        outcome.at_most(format!("l_0, {kernel} kernel, from above"), exact(length), 2.0);
        let observe = "structure_factor = { range = 15.0 }";
        let observed = groot_warren(context, kernel, model, 3.0, observe)?;
        let s = profile(&observed, "structure_factor", "s");
        let near = |k: f64| s.iter().min_by(|a, b| (a.0 - k).abs().total_cmp(&(b.0 - k).abs()));
        // A minimum at 2π/l₀ is lower than S at the longest wave.
        if let (Some(first), Some(at)) = (s.first(), near(2.0 * PI / length)) {
            let rise: Measured = difference(at.1, first.1);
            outcome.at_most(format!("S(2 pi/l_0) - S at the longest wave, {kernel} kernel"), rise, 0.0);
        }
        lines.push((if kernel == "linear" { "linear kernel" } else { "quadratic kernel" }, bare(&s)));
    }
    outcome.plot("structure", "S(k) at density 3", ["k", "S"], &[], &lines);
    Ok(())
}
