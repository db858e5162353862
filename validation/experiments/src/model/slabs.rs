//! Boxes that are run to measure a liquid: homogeneous ones, and those with slabs, films and ridges. Lengths are in ranges of the forces,
//! times in thermal units r √(m/kT).

use crate::model::seek::rounded;
use crate::model::steps::{self, FIRST};
use crate::run::Observed;
use crate::{ExperimentError, Trouble, run};
use psidpd_core::model::{Fluid, Model};
use psidpd_core::theory::MeanField;
use psidpd_dynamics::run::RunError;
use psidpd_dynamics::scene::Scene;
use psidpd_dynamics::trial::{Composition, Piece};
use psidpd_observe::Measured;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Edges along surfaces, and the thickness of a film or half of a slab.
pub const ALONG: f64 = 6.0;
pub const FILM: f64 = 5.0;

/// What settles, and how long a slab is measured.
pub const SETTLE: f64 = 40.0;
const SLAB: f64 = 300.0;

/// Nothing is kept but what is observed.
const OUTPUT: &str = "[output]\nthermo = 0\ncheckpoint = 0\n";

/// The liquid in units of its model, and the step that it is moved with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Units {
    pub kt: f64,
    /// The range of the forces.
    pub range: f64,
    /// The number density of the liquid.
    pub density: f64,
    pub dt: f64,
}

/// A liquid beside its vapour, in units of its model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Slab {
    pub tension: Measured,
    /// The number density of the liquid.
    pub density: Measured,
}

impl Slab {
    /// What a run of [`Setting::slab`] has observed.
    pub fn of(observed: &Observed) -> Slab {
        Slab {
            tension: observed.scalar("surface_tension", "free_energy"),
            density: observed.scalar("interface_width", "liquid"),
        }
    }
}

impl Units {
    /// A box with edges, and times to settle and to measure.
    pub fn setting(&self, edges: [f64; 3], times: [f64; 2]) -> Setting {
        Setting {
            edges: edges.map(|edge| shown(edge * self.range)),
            steps: [FIRST * self.dt, self.dt].map(rounded),
            times: times.map(|time| time * self.range / self.kt.sqrt()),
            ..Setting::default()
        }
    }

    /// Takes the density of the liquid from a slab of it.
    pub fn learn(&mut self, slab: &Slab) {
        if slab.density.value > 0.0 {
            self.density = slab.density.value;
        }
    }
}

/// A box, and where liquid is in it, in units of the model.
#[derive(Default)]
pub struct Setting {
    pub title: String,
    pub edges: [f64; 3],
    /// Lines behind those of the box.
    pub lines: String,
    /// The `[[part]]`s, or `[initial]`.
    pub parts: String,
    /// The first time steps and the others.
    pub steps: [f64; 2],
    /// What settles, and what is measured.
    pub times: [f64; 2],
    pub observe: String,
}

/// A length with three decimals.
pub fn shown(length: f64) -> f64 {
    (1e3 * length).round() / 1e3
}

/// The lines of a `[[part]]` of this shape.
pub fn part(shape: &str, density: f64) -> String {
    format!("[[part]]\n{shape}density = {:?}\nlattice = \"fcc\"\n", rounded(density))
}

/// The shape of a slab of this thickness about a height, or about the middle of the box.
pub fn slab(thickness: f64, at: Option<f64>, units: &Units) -> String {
    let shown = |length: f64| shown(length * units.range);
    let at = at.map_or(String::new(), |at| format!("at = {:?}\n", shown(at)));
    format!("shape = \"slab\"\nthickness = {:?}\n{at}", shown(thickness))
}

impl Setting {
    /// A slab of the liquid with two surfaces.
    pub fn slab(units: &Units) -> Setting {
        Setting {
            title: "A slab".into(),
            parts: part(&slab(FILM + 1.0, None, units), units.density),
            observe: "every = 5\nsurface_tension = true\ninterface_width = { every = 25 }\n".into(),
            ..units.setting([ALONG, ALONG, 2.0 * FILM + 2.0], [SETTLE, SLAB])
        }
    }

    /// The scene, with a model of this name and without the section on output.
    pub fn text(&self, model: &str, kt: f64, seed: u64) -> String {
        let head = format!(
            "title = \"{}\"\nmodel = {}\nkT    = {kt:?}\nseed  = {seed}\n\n[box]\nlengths  = {:?}\n{}\n{}",
            self.title,
            toml::Value::String(model.to_owned()),
            self.edges,
            self.lines,
            self.parts,
        );
        let stages = steps::stages(self.steps, self.times);
        head + &stages + "\n[observe]\nstages = [\"measure\"]\n" + &self.observe
    }
}

/// A setting with the file of its model, kT, and a seed.
pub struct Run {
    pub setting: Setting,
    pub model: PathBuf,
    pub kt: f64,
    pub seed: u64,
}

impl Run {
    pub fn scene(&self) -> Result<Scene, RunError> {
        let model = std::path::absolute(&self.model).unwrap_or_else(|_| self.model.clone());
        let text = self.setting.text(&model.display().to_string(), self.kt, self.seed) + OUTPUT;
        Ok(Scene::parse(&self.setting.title, &text, Path::new(""))?)
    }
}

/// Runs scenes side by side; the last is the longest.
pub fn run(runs: &[Run], folder: &Path) -> Result<Vec<Observed>, Trouble> {
    Ok(run::side_by_side(runs.iter().map(Run::scene).collect::<Result<_, _>>()?, folder)?)
}

/// The seeds of the runs of a result, none of which a search or another round has.
pub fn seeds_of_result(seed: u64, round: u64) -> [u64; 3] {
    [0, 1, 2].map(|number| seed.wrapping_add(1000 + 10 * round + number))
}

pub fn mean([a, b]: [Measured; 2]) -> Measured {
    a.plus(b).times(0.5)
}

/// The value of a profile at the place that is nearest.
pub fn nearest(profile: &[(f64, Measured)], z: f64) -> Measured {
    let nearest = profile.iter().min_by(|a, b| (a.0 - z).abs().total_cmp(&(b.0 - z).abs()));
    nearest.map_or(Measured::NONE, |(_, value)| *value)
}

/// The units of a liquid of one species with this mass, settled, at about this density or that of theory. `named` is what errors call it,
/// and the option that gives densities.
pub fn settled(
    (model, mass, density): (&Model, f64, Option<f64>),
    kt: f64,
    seed: u64,
    named: [&str; 2],
) -> Result<Units, ExperimentError> {
    let [name, option] = named;
    let fluid = model.at(kt)?;
    let none = || {
        let why = format!("theory knows no liquid of {name} beside its vapour: give the density, {option}");
        ExperimentError::Conditions(why)
    };
    let density = density.map_or_else(|| guess(&fluid), |density| Ok(Some(density)))?.ok_or_else(none)?;
    let of = Composition { model, masses: &[mass], kt, densities: &[density], seed };
    let piece = Piece::settled(&of)?.map_err(|why| ExperimentError::Conditions(format!("{name}: {why}")))?;
    Ok(Units { kt, range: fluid.cutoff(), density, dt: steps::dt(&piece) })
}

/// The density at which theory with correlations has no pressure.
fn guess(fluid: &Fluid) -> Result<Option<f64>, ExperimentError> {
    let theory = MeanField::new(fluid)?;
    let volume = fluid.cutoff().powi(3);
    Ok(theory.correlations()?.and_then(|c| c.zero_pressure_density([0.5 / volume, 200.0 / volume])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_results_have_seeds_of_their_own() {
        for seed in [0, 7, u64::MAX] {
            let search = [seed, seed.wrapping_add(1)];
            let mut all: Vec<u64> =
                (0..5).flat_map(|round| seeds_of_result(seed, round)).chain(search).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), 17);
        }
    }

    #[test]
    fn the_value_at_the_nearest_place_counts() {
        let profile: Vec<_> =
            (0..4).map(|k| (f64::from(k) - 0.5, Measured::from(f64::from(10 + k)))).collect();
        for (z, expected) in [(-3.0, 10.0), (-0.1, 10.0), (0.1, 11.0), (1.4, 12.0), (2.1, 13.0), (40.0, 13.0)]
        {
            assert_eq!(nearest(&profile, z).value, expected, "{z}");
        }
        assert!(nearest(&[], 1.0).value.is_nan());
    }

    /// Lengths four times as long make the density of a liquid 64 times as small, and time steps four times as long; its guess is that
    /// of Warren's liquid, 6.05, within a few percent.
    #[test]
    fn a_liquid_in_other_lengths_is_the_same() {
        let of = |length: f64| {
            let [a, b] =
                [-40.0 / length, 25.0 * 0.75f64.powi(4) * std::f64::consts::PI / 30.0 * length.powi(6)];
            let text = format!(
                "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = {:?}\n[excess_free_energy]\n\
                 F = \"{b:?}*n^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = {a:?}\nrange = {length:?}\n\
                 [[thermostat]]\ngamma = {:?}\nrange = {length:?}\n",
                0.75 * length,
                18.0 / length,
            );
            let model = Model::parse("m.toml", &text).unwrap();
            settled((&model, 1.0, None), 1.0, 1, ["m", "--density"]).unwrap()
        };
        let (short, long) = (of(1.0), of(4.0));
        assert!((short.density / 6.05 - 1.0).abs() < 0.08, "{short:?}");
        assert!((64.0 * long.density / short.density - 1.0).abs() < 1e-3 && long.range == 4.0, "{long:?}");
        assert!((long.dt / short.dt / 4.0 - 1.0).abs() < 0.1, "{short:?} {long:?}");
    }
}
