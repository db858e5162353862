//! Figures 1, 2 and 6: the van der Waals fluid, in mean field and homogeneous.

use crate::ExperimentError;
use crate::papers::case::{Reproduction, curve, line, points};
use crate::papers::context::{Context, Fluid, mean_field, with_parameters};
use crate::shipped::VAN_DER_WAALS;
use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, critical_point};

/// x_c = b ρ_c and kT_c b/a, the paper's eqs (14)–(16).
fn critical(alpha: f64) -> [f64; 2] {
    // x_c = [α − 1 + √(1 + ⅔α + α²)]/(4α); 1/3 in the limit α → 0.
    let x = if alpha == 0.0 {
        1.0 / 3.0
    } else {
        (alpha - 1.0 + (1.0 + 2.0 / 3.0 * alpha + alpha * alpha).sqrt()) / (4.0 * alpha)
    };
    [x, x * (2.0 + 3.0 * alpha * x) * (1.0 - x).powi(2)]
}

pub fn fig1(_: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let (b, a) = (0.016, 1.9 * 0.016);
    let mut hot = Vec::new();
    let mut lines = Vec::new();
    for alpha in [0.0, 5.0] {
        let text = with_parameters(VAN_DER_WAALS, &[("alpha3", alpha)])?;
        let [x, t] = critical(alpha);
        let (rho, kt) = (x / b, t * a / b);
        let model = Model::parse("model.toml", &text)?;
        let found = critical_point(&|kt| Ok(model.at(kt)?), [0.2 * kt, 3.0 * kt])?;
        outcome.read(format!("kT_c b/a, alpha_3 = {alpha}"), found.parameter * b / a, [t, 1e-6 * t]);
        outcome.read(format!("b rho_c, alpha_3 = {alpha}"), found.density * b, [x, 1e-4 * x]);
        let inverse = |share: f64, rho: f64| -> Result<f64, ExperimentError> {
            Ok(rho * mean_field(&text, share * kt)?.pressure_slope(&[rho]))
        };
        let cold = 1.0 / inverse(0.8, rho)?;
        outcome.at_most(format!("compressibility at 0.8 T_c and rho_c, alpha_3 = {alpha}"), cold, 0.0);
        hot.push(1.0 / inverse(1.1, rho)?);
        let theory = mean_field(&text, 1.1 * kt)?;
        let hotter = line(0.2, 1.6, |s| 1.0 / (s * rho * theory.pressure_slope(&[s * rho])));
        lines.push(curve(&format!("alpha_3 = {alpha}"), hotter));
    }
    outcome.at_most("compressibility at 1.1 T_c and rho_c: alpha_3 = 5 over 0", hot[1] / hot[0], 1.0);
    outcome.plot("compressibility", "1.1 T_c", ["density over rho_c", "compressibility"], lines);
    Ok(())
}

/// Where a quantity that rises with temperature changes its sign, by bisection.
fn root(
    mut low: f64,
    mut high: f64,
    f: impl Fn(f64) -> Result<f64, ExperimentError>,
) -> Result<f64, ExperimentError> {
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if f(middle)? > 0.0 { high = middle } else { low = middle }
    }
    Ok(0.5 * (low + high))
}

pub fn fig2(_: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let (b, a) = (0.016, 1.9 * 0.016);
    let mut lines = Vec::new();
    for alpha in [0.0, 5.0] {
        let text = with_parameters(VAN_DER_WAALS, &[("alpha3", alpha)])?;
        // kT b/a of the equation of state with p = 0, and of the bracket of eq. (29) with no tension.
        let pressure = |x: f64| (1.0 - x) * x * (1.0 + alpha * x);
        let tension = |x: f64| (1.0 - x).powi(2) * (1.0 + 2.0 * alpha * x);
        for x in [0.2, 0.4, 0.6] {
            let at = [x / b];
            let zero =
                |f: &dyn Fn(&MeanField) -> f64| root(1e-3, 10.0, |y| Ok(f(&mean_field(&text, y * a / b)?)));
            let p = zero(&|theory| theory.pressure(&at))?;
            let t = zero(&|theory| -theory.gradient_coefficients(&at)[0])?;
            let of = format!("at b rho = {x}, alpha_3 = {alpha}");
            outcome.read(format!("kT b/a without pressure {of}"), p, [pressure(x), 1e-6]);
            outcome.read(format!("kT b/a without tension {of}"), t, [tension(x), 1e-6]);
        }
        lines.push(curve(&format!("p = 0, alpha_3 = {alpha}"), line(0.0, 1.0, pressure)));
        lines.push(curve(&format!("no tension, alpha_3 = {alpha}"), line(0.0, 1.0, tension)));
    }
    outcome.plot("lines", "Pressure and tension vanish", ["b rho", "kT b/a"], lines);
    Ok(())
}

/// The homogeneous fluid.
pub fn fig6(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // The equation of state with the printed parameters: a = 1.9 b, alpha_3 = 5.
    let (kt, b) = (2.5, 0.016);
    let pressure = |rho: f64| rho * kt / (1.0 - b * rho) - 1.9 * b * rho * rho * (1.0 + 5.0 * b * rho);
    let fluid = Fluid { kt, edge: 7.0, ..Fluid::of(VAN_DER_WAALS) };
    let measured = context.pressures("rho", &fluid, &[10.0, 20.0, 30.0, 40.0])?;
    for &(rho, p) in &measured {
        // The paper has "only small deviations" and no number: that of reading its figure, 2 % of the ideal part.
        let ideal = rho * kt / (1.0 - b * rho);
        outcome.read(format!("pressure at density {rho}"), p, [pressure(rho), 0.02 * ideal]);
    }
    let series = vec![points("measured", &measured), curve("equation of state", line(2.0, 45.0, pressure))];
    outcome.plot("pressure", "Van der Waals, kT = 2.5", ["density", "pressure"], series);
    Ok(())
}
