//! Table 2, Figures 3 to 5: the interface between liquid and vapour.

use crate::ExperimentError;
use crate::fluids::{SET5, SET6, WarrenSet};
use crate::papers::case::{Reproduction, bare, curve, points};
use crate::papers::context::{Context, Fluid};
use crate::run::{Observed, SLAB};
use psidpd_observe::Measured;

const BIN: f64 = 0.05;
/// How far from the liquid the densities are of which the pressures give its compressibility; the third derivative of the
/// pressure makes 0.1 of this.
const NEAR: f64 = 0.2;
/// A parameter set, and for each temperature a density of the liquid to start from.
type Set = (WarrenSet, [(f64, f64); 3]);

const SETS: [Set; 2] =
    [(SET5, [(0.5, 5.3), (1.0, 5.08), (2.0, 4.6)]), (SET6, [(0.5, 6.3), (1.0, 6.05), (2.0, 5.6)])];

/// Eq. (19) with the slope between bins 0.25 wide, two apart: the largest of the profile and its mirror image.
fn width_by_bins(observed: &Observed) -> Measured {
    let density = observed.profile("density_profile", "density");
    let count = density.len();
    let wide = (0.25 / BIN) as usize;
    let mean = |from: usize| {
        let bins = (from..from + wide)
            .map(|k| 0.5 * (density[k % count].1.value + density[(2 * count - 1 - k) % count].1.value));
        bins.sum::<f64>() / wide as f64
    };
    let steepest =
        (0..count).map(|k| (mean(k) - mean(k + 2 * wide)).abs()).fold(0.0, f64::max) / (2.0 * 0.25);
    let shape = |column| observed.scalar("interface_width", column);
    let [liquid, vapour, fit] = ["liquid", "vapour", "width_slope"].map(shape);
    let value = (liquid.value - vapour.value) / steepest;
    // As well known, relatively, as the width from the slope of the fitted stretch.
    Measured { value, error: value * fit.error / fit.value }
}

/// A slab of a set between two surfaces; figures and the table share the runs.
fn slab(context: &Context, set: &WarrenSet, (kt, rho): (f64, f64)) -> Result<Observed, ExperimentError> {
    let context = context.shared("warren-slab");
    let height = context.pick(18.0, 30.0);
    let changes = [
        context.pick("box=[7.0, 7.0, 18.0]", "box=[10.0, 10.0, 30.0]"),
        &format!("kT={kt}"),
        context.pick("equilibrate=1500", "equilibrate=10000"),
        context.pick("steps=8000", "steps=100000"),
        &format!("initial.thickness={}", 0.5 * height),
        &format!("initial.density={rho}"),
        &format!("observe.density_profile={{ bins = {} }}", (height / BIN) as u32),
        "observe.surface_tension={ every = 20 }",
    ];
    context.scene(&format!("{}-kT{kt}", set.slug()), set.fluid.text, SLAB, &changes)
}

pub fn table2(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    for (of, slope) in [(SET5, [49.0, 2.0]), (SET6, [47.0, 2.0])] {
        let (set, [liquid, tension, width]) = (of.name, of.published());
        let observed = slab(context, &of, (1.0, liquid[0]))?;
        let shape = |column| observed.scalar("interface_width", column);
        outcome.equal(format!("liquid density of {set}"), shape("liquid"), liquid);
        outcome.equal(format!("width of {set}"), shape("width"), width);
        let by_bins = width_by_bins(&observed);
        outcome.equal(format!("width of {set}, slope between bins of 0.25"), by_bins, width);
        outcome.equal(format!("tension of {set}"), observed.scalar("surface_tension", "stress"), tension);
        // The paper has it from eq. (18), which is fitted to such pressures.
        let pressure = |rho: f64| -> Result<Measured, ExperimentError> {
            let name = format!("{}-rho{rho:.2}", of.slug());
            Ok(context.bulk(&name, &Fluid::of(of.fluid.text), &[rho])?.pressure())
        };
        let rise = pressure(liquid[0] + NEAR)?.minus(pressure(liquid[0] - NEAR)?).times(0.5 / NEAR);
        outcome.equal(format!("dp/drho of {set} at the density of its liquid"), rise, slope);
    }
    Ok(())
}

pub fn fig3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut plotted = Vec::new();
    for (of, states) in SETS {
        let set = of.name;
        let mut gaps = Vec::new();
        let mut ends = Vec::new();
        for state in states {
            let observed = slab(context, &of, state)?;
            let [vapour, liquid] =
                ["vapour", "liquid"].map(|column| observed.scalar("interface_width", column));
            if state.0 <= 1.0 {
                // "Virtually devoid of particles".
                outcome.at_most(format!("density of the vapour of {set} at kT = {}", state.0), vapour, 0.05);
            }
            gaps.push(liquid.minus(vapour));
            ends.extend([(vapour.value, state.0), (liquid.value, state.0)]);
        }
        for (pair, states) in gaps.windows(2).zip(states.windows(2)) {
            let name = format!("growth of the gap of {set} from kT = {} to {}", states[0].0, states[1].0);
            outcome.at_most(name, pair[1].minus(pair[0]), 0.0);
        }
        plotted.push(curve(set, ends));
    }
    outcome.plot("tie-lines", "Vapour and liquid", ["density", "kT"], plotted);
    Ok(())
}

pub fn fig4(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    for (of, states) in SETS {
        let set = of.name;
        let mut lines = Vec::new();
        for (state, name) in states.into_iter().zip(["kT = 0.5", "kT = 1", "kT = 2"]) {
            let observed = slab(context, &of, state)?;
            let density = observed.profile("density_profile", "density");
            // Two bins together, and both sides: as wide as the layers are told apart.
            let count = density.len();
            let of_four = |k: usize| [k, k + 1, count - 1 - k, count - 2 - k].map(|k| density[k].1.value);
            let smooth = (0..count / 2 - 1).map(|k| of_four(k).iter().sum::<f64>() / 4.0);
            let highest = smooth.fold(0.0, f64::max);
            let liquid = observed.scalar("interface_width", "liquid");
            let noise = density.iter().map(|(_, d)| d.error).fold(0.0, f64::max) / 2.0;
            let excess = Measured { value: highest / liquid.value - 1.0, error: noise / liquid.value };
            let what = format!("height of the layers of {set}, {name}");
            match state.0 < 0.75 {
                true => outcome.equal(what, excess, [0.10, 0.005]),
                false => outcome.at_most(what, excess, 0.02),
            }
            lines.push(curve(name, bare(&density)));
        }
        outcome.plot(format!("profiles-{}", of.slug()), &format!("Warren, {set}"), ["z", "density"], lines);
    }
    Ok(())
}

pub fn fig5(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut plotted = Vec::new();
    for (of, states) in SETS {
        let set = of.name;
        let (mut tensions, mut widths) = (Vec::new(), Vec::new());
        for state in states {
            let observed = slab(context, &of, state)?;
            tensions.push((state.0, observed.scalar("surface_tension", "stress")));
            widths.push((state.0, observed.scalar("interface_width", "width")));
        }
        for (t, w) in tensions.windows(2).zip(widths.windows(2)) {
            let steps = format!("of {set} from kT = {} to {}", t[0].0, t[1].0);
            outcome.at_most(format!("growth of the tension {steps}"), t[1].1.minus(t[0].1), 0.0);
            outcome.at_least(format!("growth of the width {steps}"), w[1].1.minus(w[0].1), 0.0);
        }
        plotted.push(points(&format!("tension, {set}"), &tensions));
        plotted.push(points(&format!("width, {set}"), &widths));
    }
    outcome.plot("temperature", "Warren", ["kT", "tension, width"], plotted);
    Ok(())
}
