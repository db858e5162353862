//! Measures by runs: a slab of each liquid, and layers of both.

use super::merge::{self, Liquid};
use super::{Instrument, Layers, Slab, Sought};
use crate::model::slabs::{
    self, ALONG, FILM, Run, SETTLE, Setting, Units, mean, nearest, part, seeds_of_result, slab,
};
use crate::run::Observed;
use crate::{ExperimentError, Trouble};
use psidpd_core::model::Model;
use psidpd_formats::files::{Existing, write_bytes};
use psidpd_observe::Measured;
use std::path::Path;

/// Thermal times that layers of the search and of the result last.
const SEARCH: f64 = 250.0;
const RESULT: f64 = 700.0;

/// The middles of the lower and the upper layer, with vapour below, above, and the height of the box.
const MIDDLES: [f64; 2] = [4.0, 9.0];
const HEIGHT: f64 = 13.0;

pub struct Runs<'a> {
    sought: &'a Sought,
    folder: &'a Path,
    /// Of each liquid, with a density that is a guess, then that of its slab.
    units: [Units; 2],
    /// The mass of the second species.
    mass: f64,
}

impl<'a> Runs<'a> {
    pub fn new(sought: &'a Sought, folder: &'a Path) -> Result<Runs<'a>, ExperimentError> {
        let [a, b] = &sought.liquids;
        let (_, mass) = merge::units([a, b])?;
        // The merged file is read before anything runs.
        Model::parse("mixture.toml", &merge::text([a, b], sought.kt, 1.0, "")?)?.at(sought.kt)?;
        let of = |liquid: &Liquid, mass: f64, k: usize| {
            let density = sought.densities.map(|all| all[k]);
            let named = [liquid.name.as_str(), "--densities"];
            slabs::settled((&liquid.model, mass, density), sought.kt, sought.seed, named)
        };
        let units = [of(a, 1.0, 0)?, of(b, mass, 1)?];
        Ok(Runs { sought, folder, units, mass })
    }

    /// The units of a box with both liquids.
    fn both(&self) -> Units {
        let [a, b] = self.units;
        Units { range: a.range.max(b.range), dt: a.dt.min(b.dt), ..a }
    }

    /// The run of both layers with this attraction between them.
    fn layers(&self, (cross, seed): (f64, u64), time: f64, file: &str) -> Result<Run, ExperimentError> {
        let [a, b] = &self.sought.liquids;
        let units = self.both();
        let model = self.folder.join(file);
        let text = merge::text([a, b], self.sought.kt, cross, "")?;
        write_bytes(&model, Existing::Replace, text.as_bytes())?;
        let layer = |k: usize| {
            let name = &self.sought.liquids[k].name;
            let shape = slab(FILM, Some(MIDDLES[k]), &units) + &format!("species = \"{name}\"\n");
            part(&shape, self.units[k].density)
        };
        // Heavy particles take longer.
        let slow = self.mass.max(1.0).sqrt();
        let setting = Setting {
            title: "Layers of two liquids".into(),
            lines: format!("\n[masses]\n{} = {:?}\n", b.name, self.mass),
            parts: layer(0) + "\n" + &layer(1),
            observe: "every = 5\nstress_profile = { axis = \"z\", bins = 130, recentre = false }\n\
                      composition_profile = { axis = \"z\", bins = 65, recentre = false, every = 50 }\n"
                .into(),
            ..units.setting([ALONG, ALONG, HEIGHT], [SETTLE, time].map(|time| slow * time))
        };
        Ok(Run { setting, model, kt: self.sought.kt, seed })
    }

    fn slabs(&self) -> [Run; 2] {
        let of = |k: usize| Run {
            setting: Setting::slab(&self.units[k]),
            model: self.sought.liquids[k].file.clone(),
            kt: self.sought.kt,
            seed: self.sought.seed,
        };
        [of(0), of(1)]
    }

    fn results(&self, cross: f64, round: u64) -> Result<[Run; 2], ExperimentError> {
        let [a, b, _] = seeds_of_result(self.sought.seed, round);
        let run = |seed: u64| Runs::layers(self, (cross, seed), RESULT, "result.toml");
        Ok([run(a)?, run(b)?])
    }

    fn measured(&self, runs: &[Run]) -> Result<[Layers; 2], Trouble> {
        let found = slabs::run(runs, self.folder)?;
        Ok([0, 1].map(|k| read(&found[k], self.both().range, &self.sought.liquids[0].name)))
    }
}

/// The tension and what is dissolved, of layers of which that of the species `first` is the lower.
fn read(observed: &Observed, range: f64, first: &str) -> Layers {
    let integral = observed.profile("stress_profile", "integral");
    let fractions = observed.profile("composition_profile", &format!("fraction_{first}"));
    let [lower, upper] = MIDDLES.map(|middle| nearest(&integral, middle * range));
    // Parts of a sum over independent slices.
    let error = (upper.error.powi(2) - lower.error.powi(2)).abs().sqrt();
    let [in_first, in_second] = MIDDLES.map(|middle| nearest(&fractions, middle * range));
    Layers {
        tension: Measured { value: upper.value - lower.value, error },
        dissolved: [Measured::from(1.0).minus(in_first), in_second],
    }
}

impl Instrument for Runs<'_> {
    fn alone(&mut self) -> Result<[Slab; 2], Trouble> {
        let found = slabs::run(&self.slabs(), self.folder)?;
        let alone = [0, 1].map(|k| Slab::of(&found[k]));
        self.units.iter_mut().zip(&alone).for_each(|(units, slab)| units.learn(slab));
        Ok(alone)
    }

    fn layers(&mut self, cross: [f64; 2]) -> Result<[Layers; 2], Trouble> {
        let run = |k: usize| Runs::layers(self, (cross[k], self.sought.seed), SEARCH, &format!("{k}.toml"));
        self.measured(&[run(0)?, run(1)?])
    }

    fn result(&mut self, cross: f64, round: u64) -> Result<Layers, Trouble> {
        let [a, b] = self.measured(&self.results(cross, round)?)?;
        let dissolved = [0, 1].map(|k| mean([a.dissolved[k], b.dissolved[k]]));
        Ok(Layers { tension: mean([a.tension, b.tension]), dissolved })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::observation::Kind;
    use psidpd_observe::{Observation, Series};

    const LIQUID: &str = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
        [excess_free_energy]\nF = \"1.5*n^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = -25.0\n\
        range = RANGE\n[[thermostat]]\ngamma = 6.0\nrange = RANGE\n[units]\nlength = 1e-9\nmass = MASS\nenergy = 4e-21\n";

    /// In a box of height 26, of lengths twice as long: the integral is 1.5 in the lower layer, at 8, and 5.5 in the upper, at 18,
    /// where a tenth of the particles is of the first liquid; in the lower a fiftieth is of the second.
    #[test]
    fn layers_of_known_stress_and_composition_are_read() {
        let places: Vec<f64> = (0..130).map(|k| 0.2 * f64::from(k) + 0.1).collect();
        let profile = |name: &str, column: &str, of: &dyn Fn(f64) -> [f64; 2]| {
            let values = places.iter().map(|z| Measured::from(of(*z)));
            Observation::new(name, name, Kind::Profile, &Series::new(1))
                .against("z", "length", places.clone())
                .column(column, "1", values)
        };
        let integral = |z: f64| [if z < 13.0 { 1.5 } else { 5.5 }, if z < 13.0 { 0.03 } else { 0.05 }];
        let fraction = |z: f64| if z < 13.0 { [0.98, 0.002] } else { [0.1, 0.004] };
        let observed = Observed(vec![
            profile("stress_profile", "integral", &integral),
            profile("composition_profile", "fraction_oil", &fraction),
        ]);
        let Layers { tension, dissolved: [second, first] } = read(&observed, 2.0, "oil");
        assert!((tension.value - 4.0).abs() < 1e-12 && (tension.error - 0.04).abs() < 1e-12, "{tension:?}");
        assert!((second.value - 0.02).abs() < 1e-12 && (second.error - 0.002).abs() < 1e-12, "{second:?}");
        assert!((first.value - 0.1).abs() < 1e-12 && (first.error - 0.004).abs() < 1e-12, "{first:?}");
    }

    /// Liquids of ranges 1 and 2, the second four times as heavy: the box is in units of the longer range, the time is twice as
    /// long, each liquid has its place, its density and its mass, and results have seeds of their own.
    #[test]
    fn scenes_have_both_liquids() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str, range: &str, mass: &str| {
            let file = folder.path().join(format!("{name}.toml"));
            std::fs::write(&file, LIQUID.replace("RANGE", range).replace("MASS", mass)).unwrap();
            Liquid::open(name, &file).unwrap()
        };
        let liquids = [of("water", "1.0", "1e-25"), of("oil", "2.0", "4e-25")];
        let sought = Sought { liquids, kt: 0.7, densities: None, tension: 0.01, seed: 7 };
        let unit = |range: f64, density: f64, dt: f64| Units { kt: 0.7, range, density, dt };
        let units = [unit(1.0, 6.0, 0.04), unit(2.0, 0.5, 0.02)];
        let runs = Runs { sought: &sought, folder: folder.path(), units, mass: 4.0 };
        let made = runs.layers((0.6, 9), 100.0, "both.toml").unwrap();
        let scene = made.scene().unwrap();
        assert_eq!((made.seed, scene.stages[2].dt), (9, 0.02));
        assert_eq!(scene.domain.lengths(), [12.0, 12.0, 26.0]);
        assert_eq!((&scene.mass[..], scene.seed, scene.kt), (&[1.0, 4.0][..], 9, 0.7));
        let lasts = |name: &str| {
            let stage = scene.stages.iter().find(|stage| stage.name == name).unwrap();
            stage.steps as f64 * stage.dt
        };
        // Thermal times 2 range/√kT.
        let time = 2.0 * 2.0 / 0.7f64.sqrt();
        assert!((lasts("measure") / (100.0 * time) - 1.0).abs() < 1e-3, "{}", lasts("measure"));
        assert!((lasts("settle") / (SETTLE * time) - 1.0).abs() < 1e-3, "{}", lasts("settle"));
        // The lower layer, about 8, is water at a density of 6, the upper, about 18, oil at one of 0.5.
        let state = scene.initial_state();
        for (species, middle, density) in [(0, 8.0, 6.0), (1, 18.0, 0.5)] {
            let own = state.x.iter().zip(&state.species).filter(|(_, s)| **s == species);
            let heights: Vec<f64> = own.map(|(x, _)| x[2]).collect();
            let mean = heights.iter().sum::<f64>() / heights.len() as f64;
            let expected = density * 2.0 * FILM * 144.0;
            assert!((heights.len() as f64 / expected - 1.0).abs() < 0.15, "{species}: {}", heights.len());
            assert!((mean - middle).abs() < 0.3, "{species}: {mean}");
        }
        let [_, slab] = runs.slabs();
        assert_eq!((slab.seed, &slab.model), (7, &folder.path().join("oil.toml")));
        let slab = slab.scene().unwrap();
        assert_eq!(slab.domain.lengths(), [12.0, 12.0, 24.0]);
        // An oil of ranges 2: a slab 12 thick of its density.
        let count = slab.initial.count() as f64;
        assert!((count / (0.5 * 12.0 * 144.0) - 1.0).abs() < 0.15, "{count}");
        let seeds: Vec<u64> =
            (0..2).flat_map(|round| runs.results(0.6, round).unwrap().map(|run| run.seed)).collect();
        assert_eq!(seeds, [1007, 1008, 1017, 1018]);
    }
}
