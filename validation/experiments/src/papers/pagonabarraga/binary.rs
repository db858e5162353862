//! Figures 10 to 12: the binary mixture, from phases apart.

use super::BINARY;
use crate::ExperimentError;
use crate::papers::case::{Reproduction, bare, curve, extreme, layers, points};
use crate::papers::context::{Context, edited, mean_field};
use crate::run::Observed;
use psidpd_core::model::Model;
use psidpd_observe::Measured;

const SCENE: &str = include_str!("../../../../scenes/full/binary-2d.toml");
const WARMER: [(f64, &str, &str); 2] = [
    (6.0, "binary-kt6", include_str!("../../../../scenes/full/binary-2d-kt6.toml")),
    (7.0, "binary-kt7", include_str!("../../../../scenes/full/binary-2d-kt7.toml")),
];
const RUN: &str = "binary";
/// kT = T_c/2, and the density of the scene.
const KT: f64 = 4.0;
const RHO: f64 = 10.0;
/// Widths of the box along the interface: that of the scene, and that which the paper's other slabs have.
const BOXES: [f64; 2] = [10.0, 3.0];

fn run(context: &Context, name: &str, scene: &str) -> Result<Observed, ExperimentError> {
    let changes = ["equilibrate=3000", "steps=40000", "output.dump=0", "observe.every=20"];
    context.shared("pagonabarraga-binary").shipped(name, BINARY, scene, &changes)
}

fn mixture(context: &Context) -> Result<Observed, ExperimentError> {
    let msd = context.pick("observe.msd={ length = 300 }", "observe.msd={ length = 2000 }");
    run(context, RUN, &edited(SCENE, &[msd])?)
}

/// The fraction of A along y, from the middle of its layer.
struct Layers {
    fraction: Vec<(f64, Measured)>,
    /// Fractions of A amid the layers of B and of A.
    phases: [Measured; 2],
    /// From 10 to 90 % of the way from one phase to the other, averaged over both interfaces.
    width: Measured,
}

fn composition(observed: &Observed) -> Layers {
    let fraction = observed.profile("composition_profile", "fraction_A");
    let phases = layers(&fraction);
    let [b, a] = phases.map(|p| p.value);
    let place = |level: f64, side: f64| crossing(&fraction, b + level * (a - b), side);
    let widths = [-1.0, 1.0].map(|side| {
        let [outer, inner] = [0.1, 0.9].map(|level| place(level, side));
        outer.minus(inner).times(side)
    });
    let width = widths[0].plus(widths[1]).times(0.5);
    Layers { phases, width, fraction }
}

/// Where a profile that falls from its middle to both ends passes `level`, on the side of negative or positive places:
/// the mean of the first and the last such place.
fn crossing(profile: &[(f64, Measured)], level: f64, side: f64) -> Measured {
    let of_side = |y: f64| y * side > 0.0;
    let passes = |pair: &&[(f64, Measured)]| {
        of_side(pair[0].0) && of_side(pair[1].0) && (pair[0].1.value < level) != (pair[1].1.value < level)
    };
    let places: Vec<Measured> = profile
        .windows(2)
        .filter(passes)
        .map(|pair| {
            let [(from, low), (to, high)] = [pair[0], pair[1]];
            let slope = (high.value - low.value) / (to - from);
            Measured { value: from + (level - low.value) / slope, error: low.error / slope.abs() }
        })
        .collect();
    match &places[..] {
        [] => Measured::NONE,
        [first, .., last] => Measured {
            value: 0.5 * (first.value + last.value),
            error: first.error.max(last.error).max(0.5 * (last.value - first.value).abs()),
        },
        [only] => *only,
    }
}

/// The width that `w² = w₀² + c L` has at L = 0, of widths in both boxes.
fn without_waves([wide, narrow]: [Measured; 2]) -> Measured {
    let [l, s] = BOXES;
    let square = |w: Measured| Measured { value: w.value * w.value, error: 2.0 * w.value * w.error };
    let (wide, narrow) = (square(wide).times(-s / (l - s)), square(narrow).times(l / (l - s)));
    let (value, error) = ((wide.value + narrow.value).max(0.0).sqrt(), wide.error.hypot(narrow.error));
    // Where the square is smaller than its error, the root of that is what is known.
    Measured { value, error: (0.5 * error / value).min(error.sqrt()) }
}

pub fn fig10(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = mixture(context)?;
    outcome.read("kinetic temperature", observed.temperature(), [KT, 0.05]);
    let width = composition(&observed).width;
    let mut lines = Vec::new();
    for (species, column) in [("A", "msd_A"), ("B", "msd_B")] {
        let msd = observed.profile("msd", column);
        if let Some((_, last)) = msd.last() {
            let share = last.times(1.0 / (width.value * width.value));
            // "Much larger than the interfacial width", of which the displacement is a root.
            outcome.at_least(format!("mean-square displacement of {species} over width squared"), share, 4.0);
        }
        lines.push(curve(species, bare(&msd)));
    }
    outcome.plot("msd", "Mean-square displacements", ["time", "msd"], lines);
    context.shared("pagonabarraga-binary").plot_thermo(RUN, "Binary mixture", outcome)
}

pub fn fig11(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = mixture(context)?;
    let layers = composition(&observed);
    let theory = mean_field(BINARY, KT)?;
    let binodal = theory.composition_binodal(RHO)?;
    // "Goes basically to zero"; mean field has 2 %. One in a hundred can be read in the figure.
    for (place, k) in [("B", 0), ("A", 1)] {
        let name = format!("fraction of A where {place} is, beside mean field");
        outcome.own(name, layers.phases[k], [binodal.composition[k], 0.01]);
    }
    // "Keeps its width within r_c". In a box L wide, waves of an interface in two dimensions add to the square of its
    // width in proportion to L, kT L/(12 γ) to the variance of its place; the paper does not say how wide its box is.
    outcome.at_most("width from 10 to 90 %, in a box 10 wide", layers.width, 1.0);
    let narrow = edited(SCENE, &["box=[3.0, 20.0]"])?;
    let narrow = composition(&run(context, "binary-narrow", &narrow)?).width;
    outcome.at_most("in a box 3 wide", narrow, 1.0);
    let without = without_waves([layers.width, narrow]);
    outcome.at_most("without waves: squares at both widths extrapolated to none", without, 1.0);
    // The dip of the density "is not large compared with the typical fluctuations": of a square of edge r_c.
    let density = observed.profile("density_profile", "density");
    let fluctuation = (KT / theory.pressure_slope(&binodal.composition.map(|x| RHO * x)) / RHO).sqrt();
    let dip = Measured::from(1.0).minus(extreme(&density, -1.0).over(RHO)).over(fluctuation);
    outcome.at_most("dip of the density over its fluctuations", dip, 2.0);
    let density = density.iter().map(|(y, d)| (*y, d.value / RHO)).collect();
    let lines = vec![curve("fraction of A", bare(&layers.fraction)), curve("density over its mean", density)];
    outcome.plot("profiles", "Binary mixture", ["y", "fraction, density"], lines);
    Ok(())
}

/// The tension, in mean field and measured.
pub fn fig12(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // kT_c = rho (lambda - lambda_A) = 10 · 0.8.
    let model = Model::parse("model.toml", BINARY)?;
    let tension = |kt: f64| -> Result<f64, ExperimentError> {
        Ok(mean_field(BINARY, kt)?.composition_interface(RHO, 400)?.tension)
    };
    let critical =
        psidpd_core::theory::composition_critical_point(&|kt| Ok(model.at(kt)?), RHO, [2.0, 20.0])?;
    outcome.read("kT_c", critical.parameter, [8.0, 1e-4]);
    // γ ∝ (1 − T/T_c)^(3/2), eq. (40).
    let [near, nearer] = [0.04, 0.02];
    let exponent =
        (tension(8.0 * (1.0 - near))? / tension(8.0 * (1.0 - nearer))?).ln() / (near / nearer).ln();
    outcome.read("exponent of the tension", exponent, [1.5, 0.02]);
    // The paper multiplies mean field by a number of its own, so that only the fall with temperature can be compared.
    // Of two interfaces.
    let by_stress = |o: Observed| o.scalar("stress_profile_integral", "integral").times(0.5);
    let mut measured = vec![(KT / 8.0, by_stress(mixture(context)?))];
    for (kt, name, scene) in WARMER {
        measured.push((kt / 8.0, by_stress(run(context, name, scene)?)));
    }
    if let [(_, cold), .., (_, warm)] = measured[..] {
        outcome.at_least("tension by the stress at T = T_c/2", cold, 0.0);
        outcome.at_most("what it gains up to T = 7 T_c/8", warm.minus(cold), 0.0);
    }
    let temperatures = (0..20).map(|k| 3.0 + 0.25 * f64::from(k));
    let theory =
        temperatures.map(|kt| Ok((kt / 8.0, tension(kt)?))).collect::<Result<_, ExperimentError>>()?;
    let series = vec![points("by the stress", &measured), curve("mean field", theory)];
    outcome.plot("tension", "Binary mixture", ["T/T_c", "tension"], series);
    Ok(())
}
