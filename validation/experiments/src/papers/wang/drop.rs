//! Figures 6 to 11: drops in their vapour. (5 is a picture of one; 7 and 9 are taken from other papers.)

use crate::ExperimentError;
use crate::papers::case::{Reproduction, bare, curve, points};
use crate::papers::context::Context;
use crate::run::Observed;
use crate::shipped::SPLINE;
use psidpd_observe::Measured;

const SCENES: [(usize, &str); 7] = [
    (2828, include_str!("../../../../scenes/full/spline-drop-2828.toml")),
    (3766, include_str!("../../../../scenes/full/spline-drop-3766.toml")),
    (4922, include_str!("../../../../scenes/full/spline-drop-4922.toml")),
    (5960, include_str!("../../../../scenes/full/spline-drop-5960.toml")),
    (7910, include_str!("../../../../scenes/full/spline-drop-7910.toml")),
    (11950, include_str!("../../../../scenes/full/spline-drop-11950.toml")),
    (16312, include_str!("../../../../scenes/full/spline-drop-16312.toml")),
];

/// The tension by Laplace's law, and its last printed digit.
const LAPLACE: [f64; 2] = [3.245, 0.0005];
/// The density of the liquid, "about 12.5".
const LIQUID: [f64; 2] = [12.5, 0.05];

fn drop(context: &Context, which: usize) -> Result<Observed, ExperimentError> {
    let context = context.shared("wang-drop");
    let (count, scene) = SCENES[which];
    // Smaller drops come to rest sooner, and need more samples for the same error.
    let steps = format!("steps={}", 36_000_000 / count);
    let changes = ["equilibrate=2000", &steps, "output.dump=0", "observe.every=20"];
    context.shipped(&format!("drop-{count}"), SPLINE, scene, &changes)
}

pub fn fig6(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = drop(context, 3)?;
    let [liquid, vapour] = ["liquid", "vapour"].map(|column| observed.scalar("drop", column));
    outcome.equal("liquid density", liquid, LIQUID);
    // "About 0.3", and the densities "more than 400 times" apart: both cannot be.
    outcome.equal("vapour density, as printed", vapour, [0.3, 0.05]);
    outcome.at_least("liquid density over vapour density", liquid.over(vapour), 400.0);
    let density = points("density", &observed.profile("drop_profile", "density"));
    outcome.plot("density", "Drop of 5960", ["r", "density"], vec![density]);
    Ok(())
}

/// How far the surface reaches to either side: two of its widths, 1.3.
const SURFACE: f64 = 2.5;

/// Mean over shells of a function of normal and tangential pressure, by volume.
fn mean(observed: &Observed, from: f64, to: f64, f: impl Fn(f64, f64) -> f64) -> Measured {
    let [normal, tangential] =
        ["normal", "tangential"].map(|column| observed.profile("drop_profile", column));
    let (mut sum, mut variance, mut weight) = (0.0, 0.0, 0.0);
    for ((r, n), (_, t)) in normal.iter().zip(&tangential).filter(|((r, _), _)| (from..to).contains(r)) {
        let w = r * r;
        let spread = |dn: f64, dt: f64| f(n.value + dn, t.value + dt) - f(n.value, t.value);
        sum += w * f(n.value, t.value);
        variance += w * w * (spread(n.error, 0.0).powi(2) + spread(0.0, t.error).powi(2));
        weight += w;
    }
    Measured { value: sum / weight, error: variance.sqrt() / weight }
}

pub fn fig8(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = drop(context, 3)?;
    let radius = observed.scalar("drop", "radius").value;
    // Beyond two widths of the surface; a hundredth of the peak can be read in the figure.
    let readable = 0.03;
    let bulk = |from, to| mean(&observed, from, to, |n, t| n - t);
    outcome.read("P_n - P_t in the liquid", bulk(0.0, radius - SURFACE), [0.0, readable]);
    outcome.read("P_n - P_t in the vapour", bulk(radius + SURFACE, 9.5), [0.0, readable]);
    let [normal, tangential] =
        ["normal", "tangential"].map(|column| observed.profile("drop_profile", column));
    let bin = normal.get(1).map_or(f64::NAN, |(r, _)| r - normal[0].0);
    let both = normal.iter().zip(&tangential);
    let difference: Vec<(f64, Measured)> = both.map(|((r, n), (_, t))| (*r, n.minus(*t))).collect();
    let around = || difference.iter().filter(|(r, _)| (r - radius).abs() < SURFACE).map(|(_, d)| d);
    let value = bin * around().map(|d| d.value).sum::<f64>();
    let error = bin * around().map(|d| d.error * d.error).sum::<f64>().sqrt();
    // Through the middle of the drop, as the paper does it, once across the surface.
    outcome.equal("integral of P_n - P_t across the surface", [value, error], [3.320, 0.0005]);
    let difference = vec![points("P_N − P_T", &difference)];
    outcome.plot("difference", "Drop of 5960", ["r", "P_N − P_T"], difference);
    Ok(())
}

pub fn fig10(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = drop(context, 3)?;
    let (inside, outside) = (observed.scalar("drop", "inside"), observed.scalar("drop", "outside"));
    outcome.at_most("pressure outside over that inside", outside.times(1.0 / inside.value), 0.01);
    let edge = observed.scalar("drop", "radius").value;
    let surface = mean(&observed, edge - 0.2, edge + 0.4, |n, t| (n + 2.0 * t) / 3.0);
    outcome.at_most("pressure in the surface", surface, 0.0);
    let column = |name| curve(name, bare(&observed.profile("drop_profile", name)));
    outcome.plot("pressure", "Drop of 5960", ["r", "pressure"], vec![column("normal"), column("tangential")]);
    Ok(())
}

pub fn fig11(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let which: &[usize] = context.pick(&[0, 3], &[0, 1, 2, 3, 4, 5, 6]);
    let mut found = Vec::new();
    for k in which {
        let observed = drop(context, *k)?;
        let (count, _) = SCENES[*k];
        // Eq. (17): all particles in the liquid.
        let liquid = observed.scalar("drop", "liquid").value;
        let radius = (3.0 * count as f64 / (4.0 * std::f64::consts::PI * liquid)).cbrt();
        found.push((2.0 / radius, observed.scalar("drop", "laplace")));
    }
    // A straight line through the origin, weighted by the errors.
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, p) in &found {
        let weight = p.error.powi(-2);
        xy += weight * x * p.value;
        xx += weight * x * x;
    }
    let tension = Measured { value: xy / xx, error: xx.powf(-0.5) };
    outcome.equal("tension by Laplace's law", tension, LAPLACE);
    for ((count, _), (x, p)) in which.iter().map(|k| SCENES[*k]).zip(&found) {
        // "A straight line through the origin".
        outcome.own(format!("pressure of {count} particles beside the line"), *p, tension.times(*x));
    }
    let published = curve("3.245 · 2/R", vec![(0.0, 0.0), (0.6, 0.6 * LAPLACE[0])]);
    let series = vec![points("measured", &found), published];
    outcome.plot("laplace", "Laplace's law", ["2/R", "pressure difference"], series);
    Ok(())
}
