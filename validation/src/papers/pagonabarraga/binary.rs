//! Figures 10 and 11: the binary mixture at half of its critical temperature, from phases apart.

use super::BINARY;
use crate::bulk::Observed;
use crate::observe::Measured;
use crate::papers::case::{Outcome, bare, exact, layers, profile, ratio};
use crate::papers::context::{Context, PaperError, mean_field};

const SCENE: &str = include_str!("../../../scenes/full/binary-2d.toml");
const RUN: &str = "binary";
/// kT = T_c/2, and the density of the scene.
const KT: f64 = 4.0;
const RHO: f64 = 10.0;

fn mixture(context: &Context) -> Result<(Context, Observed), PaperError> {
    let context = context.shared("pagonabarraga-binary");
    let changes: &[crate::papers::context::Change] = &[
        (&["equilibrate"], 3000.into()),
        (&["steps"], 12_000.into()),
        (&["output", "dump"], 0.into()),
        (&["observe", "every"], 20.into()),
    ];
    let scene = format!("{SCENE}msd = {{ length = {} }}\n", context.pick(300, 2000));
    let observed = context.shipped(RUN, BINARY, &scene, changes)?;
    Ok((context, observed))
}

/// The fraction of A along y, from the middle of its layer.
struct Layers {
    fraction: Vec<(f64, Measured)>,
    /// Fractions of A amid the layers of B and of A.
    phases: [Measured; 2],
    /// From 10 to 90 %, averaged over both interfaces.
    width: f64,
}

fn composition(observed: &Observed) -> Layers {
    let fraction = profile(observed, "composition_profile", "fraction_A");
    let phases = layers(&fraction);
    let [b, a] = phases.map(|p| p.value);
    let bin = fraction.get(1).map_or(f64::NAN, |(y, _)| y - fraction[0].0);
    let between = fraction.iter().filter(|(_, c)| (0.1..0.9).contains(&((c.value - b) / (a - b)))).count();
    Layers { phases, width: 0.5 * bin * between as f64, fraction }
}

pub fn fig10(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let (context, observed) = mixture(context)?;
    outcome.equal("kinetic temperature", observed.temperature(), KT, 0.05);
    let width = composition(&observed).width;
    let mut lines = Vec::new();
    for (species, column) in [("A", "msd_A"), ("B", "msd_B")] {
        let msd = profile(&observed, "msd", column);
        if let Some((_, last)) = msd.last() {
            let share = last.times(1.0 / (width * width));
            // "Much larger than the interfacial width", of which the displacement is a root.
            outcome.at_least(format!("mean-square displacement of {species} over width squared"), share, 4.0);
        }
        lines.push((species, bare(&msd)));
    }
    outcome.plot("msd", "Mean-square displacements", ["time", "msd"], &[], &lines);
    let rows = context.thermo(RUN, ["time", "temperature", "pressure"])?;
    let series = |k: usize| rows.iter().map(|row| (row[0], row[k])).collect();
    outcome.plot("temperature", "Binary mixture", ["time", "kT"], &[], &[("kinetic", series(1))]);
    outcome.plot(
        "pressure",
        "Binary mixture",
        ["time", "pressure"],
        &[],
        &[("mean of xx and yy", series(2))],
    );
    Ok(outcome)
}

pub fn fig11(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let (_, observed) = mixture(context)?;
    let layers = composition(&observed);
    let theory = mean_field(BINARY, KT)?;
    let binodal = theory.composition_binodal(RHO)?;
    // "Goes basically to zero"; mean field has 2 %. One in a hundred can be read in the figure.
    outcome.equal("fraction of A where B is", layers.phases[0], binodal.composition[0], 0.01);
    outcome.equal("fraction of A where A is", layers.phases[1], binodal.composition[1], 0.01);
    // "Keeps its width within r_c".
    outcome.at_most("width from 10 to 90 %", exact(layers.width), 1.0);
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
    Ok(outcome)
}
