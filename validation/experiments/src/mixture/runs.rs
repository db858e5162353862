//! Measures by runs: a slab of each liquid, and layers of both.

use super::merge::{self, Liquid};
use super::{Alone, Instrument, Layers, Sought};
use crate::bulk::Observed;
use crate::liquid::Trouble;
use crate::slabs::{ALONG, FILM, Run, SETTLE, Setting, Units, mean, part, slab};
use crate::{ExperimentError, slabs};
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
            edges: [ALONG, ALONG, HEIGHT],
            lines: format!("\n[masses]\n{} = {:?}\n", b.name, self.mass),
            parts: layer(0) + "\n" + &layer(1),
            settle: slow * SETTLE,
            time: slow * time,
            observe: "every = 5\nstress_profile = { axis = \"z\", bins = 130, recentre = false }\n\
                      composition_profile = { axis = \"z\", bins = 65, recentre = false, every = 50 }\n"
                .into(),
        };
        Ok(Run { setting, model, units, seed })
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

fn nearest(profile: &[(f64, Measured)], z: f64) -> Measured {
    let nearest = profile.iter().min_by(|a, b| (a.0 - z).abs().total_cmp(&(b.0 - z).abs()));
    nearest.map_or(Measured::NONE, |(_, value)| *value)
}

impl Instrument for Runs<'_> {
    fn alone(&mut self) -> Result<[Alone; 2], Trouble> {
        let [a, b] = &self.sought.liquids;
        let of = |(liquid, units): (&Liquid, &Units)| Run {
            setting: Setting::slab(units),
            model: liquid.file.clone(),
            units: *units,
            seed: self.sought.seed,
        };
        let runs = [(a, &self.units[0]), (b, &self.units[1])].map(of);
        let found = slabs::run(&runs, self.folder)?;
        let alone = [0, 1].map(|k| Alone {
            tension: found[k].scalar("surface_tension", "free_energy"),
            density: found[k].scalar("interface_width", "liquid"),
        });
        for (units, alone) in self.units.iter_mut().zip(&alone) {
            if alone.density.value > 0.0 {
                units.density = alone.density.value;
            }
        }
        Ok(alone)
    }

    fn layers(&mut self, cross: [f64; 2]) -> Result<[Layers; 2], Trouble> {
        let run = |k: usize| Runs::layers(self, (cross[k], self.sought.seed), SEARCH, &format!("{k}.toml"));
        self.measured(&[run(0)?, run(1)?])
    }

    fn result(&mut self, cross: f64, round: u64) -> Result<Layers, Trouble> {
        let seed = |k: u64| self.sought.seed.wrapping_add(1000 + 10 * round + k);
        let run = |k: u64| Runs::layers(self, (cross, seed(k)), RESULT, "result.toml");
        let [a, b] = self.measured(&[run(0)?, run(1)?])?;
        let dissolved = [0, 1].map(|k| mean([a.dissolved[k], b.dissolved[k]]));
        Ok(Layers { tension: mean([a.tension, b.tension]), dissolved })
    }
}
