//! Figures 10 and 11: the binary mixture at half of its critical temperature, from phases apart.

use super::BINARY;
use crate::ExperimentError;
use crate::bulk::Observed;
use crate::papers::case::{Reproduction, bare, exact, layers, profile, ratio};
use crate::papers::context::{Context, mean_field};
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
    let changes: &[crate::papers::context::Change] = &[
        (&["equilibrate"], 3000.into()),
        (&["steps"], 40_000.into()),
        (&["output", "dump"], 0.into()),
        (&["observe", "every"], 20.into()),
    ];
    context.shared("pagonabarraga-binary").shipped(name, BINARY, scene, changes)
}

fn mixture(context: &Context) -> Result<Observed, ExperimentError> {
    run(context, RUN, &format!("{SCENE}msd = {{ length = {} }}\n", context.pick(300, 2000)))
}

/// The tension by the stress of the layers, at half of the critical temperature of mean field and above.
pub fn tensions(context: &Context) -> Result<Vec<(f64, Measured)>, ExperimentError> {
    // Of two interfaces.
    let tension = |o: &Observed| o.scalar("stress_profile_integral", "integral").times(0.5);
    let mut all = vec![(KT, tension(&mixture(context)?))];
    for (kt, name, scene) in WARMER {
        all.push((kt, tension(&run(context, name, scene)?)));
    }
    Ok(all)
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
    let fraction = profile(observed, "composition_profile", "fraction_A");
    let phases = layers(&fraction);
    let [b, a] = phases.map(|p| p.value);
    let place = |level: f64, side: f64| crossing(&fraction, b + level * (a - b), side);
    let widths = [-1.0, 1.0].map(|side| {
        let [outer, inner] = [0.1, 0.9].map(|level| place(level, side));
        Measured { value: side * (outer.value - inner.value), error: outer.error.hypot(inner.error) }
    });
    let width = Measured {
        value: 0.5 * (widths[0].value + widths[1].value),
        error: 0.5 * widths[0].error.hypot(widths[1].error),
    };
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
    outcome.equal("kinetic temperature", observed.temperature(), KT, 0.05);
    let width = composition(&observed).width;
    let mut lines = Vec::new();
    for (species, column) in [("A", "msd_A"), ("B", "msd_B")] {
        let msd = profile(&observed, "msd", column);
        if let Some((_, last)) = msd.last() {
            let share = last.times(1.0 / (width.value * width.value));
            // "Much larger than the interfacial width", of which the displacement is a root.
            outcome.at_least(format!("mean-square displacement of {species} over width squared"), share, 4.0);
        }
        lines.push((species, bare(&msd)));
    }
    outcome.plot("msd", "Mean-square displacements", ["time", "msd"], &[], &lines);
    let rows = context.shared("pagonabarraga-binary").thermo(RUN, ["time", "temperature", "pressure"])?;
    let series = |k: usize| rows.iter().map(|row| (row[0], row[k])).collect();
    outcome.plot("temperature", "Binary mixture", ["time", "kT"], &[], &[("kinetic", series(1))]);
    outcome.plot(
        "pressure",
        "Binary mixture",
        ["time", "pressure"],
        &[],
        &[("mean of xx and yy", series(2))],
    );
    Ok(())
}

pub fn fig11(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = mixture(context)?;
    let layers = composition(&observed);
    let theory = mean_field(BINARY, KT)?;
    let binodal = theory.composition_binodal(RHO)?;
    // "Goes basically to zero"; mean field has 2 %. One in a hundred can be read in the figure.
    for (place, k) in [("B", 0), ("A", 1)] {
        let expected = Measured { value: binodal.composition[k], error: 0.01 };
        outcome.own(format!("fraction of A where {place} is, beside mean field"), layers.phases[k], expected);
    }
    // "Keeps its width within r_c". In a box L wide, waves of an interface in two dimensions add to the square of its
    // width in proportion to L, kT L/(12 γ) to the variance of its place; the paper does not say how wide its box is.
    outcome.at_most("width from 10 to 90 %, in a box 10 wide", layers.width, 1.0);
    let narrow = SCENE.replace("box     = [10.0, ", "box     = [3.0, ");
    let narrow = composition(&run(context, "binary-narrow", &narrow)?).width;
    outcome.at_most("in a box 3 wide", narrow, 1.0);
    outcome.at_most(
        "without waves: squares at both widths extrapolated to none",
        without_waves([layers.width, narrow]),
        1.0,
    );
    // The dip of the density "is not large compared with the typical fluctuations": of a square of edge r_c.
    let density = profile(&observed, "density_profile", "density");
    let lowest = density.iter().map(|(_, d)| *d).min_by(|a, b| a.value.total_cmp(&b.value));
    let fluctuation =
        (KT / theory.pressure_slope(&[RHO * binodal.composition[0], RHO * binodal.composition[1]]) / RHO)
            .sqrt();
    if let Some(lowest) = lowest {
        let dip = ratio(lowest, exact(RHO));
        let dip = Measured { value: (1.0 - dip.value) / fluctuation, error: dip.error / fluctuation };
        outcome.at_most("dip of the density over its fluctuations", dip, 2.0);
    }
    let lines = [
        ("fraction of A", bare(&layers.fraction)),
        ("density over its mean", density.iter().map(|(y, d)| (*y, d.value / RHO)).collect()),
    ];
    outcome.plot("profiles", "Binary mixture", ["y", "fraction, density"], &[], &lines);
    Ok(())
}
