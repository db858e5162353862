//! Section V: two compressible Huggins fluids, mixing (Table III) and demixing (Figures 9 and 10).

use super::{DEMIXING, fluid};
use crate::ExperimentError;
use crate::calibrate::Point;
use crate::papers::case::{Reproduction, bare, curve, extreme, layers, points};
use crate::papers::context::{Context, Fluid, mean_field, with_parameters};
use crate::run::Observed;
use crate::shipped::HUGGINS;
use psidpd_observe::Measured;

pub fn table3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = context.bulk("e1.6", &fluid(HUGGINS), &[8.0, 8.0])?;
    // One digit after the point is printed, and no error.
    outcome.equal("pressure", observed.pressure(), [954.5, 0.05]);
    // With the integrator of the paper, at its step, from all forces and the velocities at the ends of steps.
    let changes: &[&str] = context.pick(
        &["integrator=self-consistent", "box=6.0"],
        &["integrator=self-consistent", "box=[8.0, 8.0, 16.0]", "equilibrate=400"],
    );
    let theirs = Fluid { changes, ..fluid(HUGGINS) };
    let same = context.bulk("self-consistent", &theirs, &[8.0, 8.0])?.scalar("pressure", "total");
    outcome.equal("pressure by the paper's integrator", same, [954.5, 0.05]);
    let names = ["A".to_owned(), "B".to_owned()];
    let point = Point::of(&observed, &names, &[8.0, 8.0]);
    for (k, (at, of, offset)) in
        [("A", "A", 1.57), ("A", "B", 0.13), ("B", "A", 0.13), ("B", "B", 1.57)].into_iter().enumerate()
    {
        let missing = Measured::from(8.0).minus(point.means[k]);
        outcome.equal(format!("rho - <n> of {of} at {at}"), missing, [offset, 0.005]);
    }
    let theory = mean_field(HUGGINS, 1.0)?.pressure(&[8.0, 8.0]);
    outcome.equal("pressure of the theory", theory, [969.4, 0.05]);
    Ok(())
}

const SCENE: &str = include_str!("../../../../scenes/full/huggins-demixing.toml");

/// Two layers across z, which are there from the start in small runs.
fn demixed(context: &Context, strength: f64) -> Result<Observed, ExperimentError> {
    let context = context.shared("trofimov-demixing");
    let model = with_parameters(DEMIXING, &[("e_AA", strength)])?;
    let scene = context.pick(
        "kT = 1.0\nseed = 1\nbox = [4.0, 4.0, 16.0]\ndensity = 16.0\ndt = 0.01\nequilibrate = 2500\nsteps = 3500\n\
         [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 8.0\nspecies = \"A\"\nmin_distance = 0.2\n\
         [[part]]\nshape = \"layer\"\nface = \"zhi\"\nthickness = 8.0\nspecies = \"B\"\nmin_distance = 0.2\n\
         [output]\nthermo = 0\n[observe]\nevery = 20\ntemperature = true\ndensity_profile = { recentre = \"A\" }\n\
         composition_profile = { recentre = \"A\" }\n",
        SCENE,
    );
    context.shipped(&format!("e{strength}"), &model, scene, &[])
}

/// Fraction of A in the layer of B and in that of A, which is in the middle of the profile: a quarter of the box amid
/// each.
fn phases(observed: &Observed) -> [Measured; 2] {
    layers(&observed.profile("composition_profile", "fraction_A"))
}

/// Compositions of coexisting phases in mean field at the density of the mixture, as the paper has its critical point.
fn binodal(strength: f64) -> Result<[f64; 2], ExperimentError> {
    let theory = mean_field(&with_parameters(DEMIXING, &[("e_AA", strength)])?, 1.0)?;
    Ok(theory.composition_binodal(16.0)?.composition)
}

pub fn fig9(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = demixed(context, 1.9)?;
    let density = |column| observed.profile("density_profile", column);
    let total = density("density");
    // The total density of the figure is flat, but for a dip that can be seen: within a tenth.
    outcome.at_least("lowest density over the mean", extreme(&total, -1.0).times(1.0 / 16.0), 0.9);
    outcome.at_most("highest density over the mean", extreme(&total, 1.0).times(1.0 / 16.0), 1.1);
    let [poor, rich] = phases(&observed);
    // Two layers: either is purer than the mixture by more than can be chance.
    outcome.at_most("fraction of A in the layer of B", poor, 0.4);
    outcome.at_least("fraction of A in the layer of A", rich, 0.6);
    let all = [("total", total), ("A", density("density_A")), ("B", density("density_B"))];
    let lines = all.map(|(name, density)| curve(name, bare(&density))).to_vec();
    outcome.plot("density", "e_AA = 1.9", ["z", "density"], lines);
    Ok(())
}

pub fn fig10(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let strengths = context.pick(&[1.9, 2.1, 2.3][..], &[1.8, 1.9, 2.0, 2.1, 2.2, 2.3][..]);
    let mut found = Vec::new();
    for strength in strengths {
        let [poor, rich] = phases(&demixed(context, *strength)?);
        let theory = binodal(*strength)?;
        // "A good agreement", and no numbers: one in a hundred can be read in the figure.
        for (phase, measured, value) in [("poorer", poor, theory[0]), ("richer", rich, theory[1])] {
            let name = format!("{phase} phase at e_AA = {strength}, beside mean field");
            outcome.own(name, measured, [value, 0.01]);
        }
        found.extend([(*strength, poor), (*strength, rich)]);
    }
    let strengths = || (0..=32).map(|k| 1.68 + 0.02 * f64::from(k));
    let side = |side: usize| strengths().filter_map(|e| Some((e, binodal(e).ok()?[side]))).collect();
    let series = vec![points("measured", &found), curve("binodal", side(0)), curve("other side", side(1))];
    outcome.plot("binodal", "Compressible Huggins mixture", ["e_AA", "fraction of A"], series);
    Ok(())
}
