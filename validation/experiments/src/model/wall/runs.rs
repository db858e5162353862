//! Measures by runs: a slab of the liquid, films on a wall, and a ridge.

use super::scene::{HEIGHT, wall};
use super::search::attracts;
use super::{Film, Instrument, Slab, Sought, conditions};
use crate::model::slabs::{self, FILM, Run, Setting, Units, mean, nearest, seeds_of_result};
use crate::run::Observed;
use crate::{ExperimentError, Trouble};
use psidpd_observe::Measured;
use std::path::Path;

/// Thermal times that films of the search and of the result last.
const SEARCH: f64 = 250.0;
const RESULT: f64 = 500.0;

pub struct Runs<'a> {
    sought: &'a Sought,
    folder: &'a Path,
    /// The units; their density is a guess, then that of the slab.
    units: Units,
}

impl<'a> Runs<'a> {
    pub fn new(sought: &'a Sought, folder: &'a Path) -> Result<Runs<'a>, ExperimentError> {
        let Sought { model, kt, .. } = sought;
        if model.species().len() != 1 || model.dimensions() != 3 {
            return Err(conditions("a wall is sought for a model of one species in three dimensions".into()));
        }
        let fluid = model.at(*kt)?;
        if !attracts(&fluid) {
            return Err(conditions(
                "the pair potentials of the model do not attract, so that no strength of a wall makes liquids wet it; the density of its \
                 matter may, `density` of [[wall]]"
                    .into(),
            ));
        }
        let units =
            slabs::settled((model, 1.0, sought.density), *kt, sought.seed, ["this model", "--density"])?;
        Ok(Runs { sought, folder, units })
    }

    /// Runs settings of the liquid side by side, each from its seed.
    fn run(&self, settings: Vec<(Setting, u64)>) -> Result<Vec<Observed>, Trouble> {
        let (model, kt) = (&self.sought.model_file, self.sought.kt);
        let of = |(setting, seed)| Run { setting, model: model.clone(), kt, seed };
        slabs::run(&settings.into_iter().map(of).collect::<Vec<_>>(), self.folder)
    }

    fn film(&self, strength: f64, time: f64) -> Setting {
        Setting::film(strength, time, &self.units)
    }

    fn tensions(&self, observed: &Observed) -> Film {
        let integral = observed.profile("stress_profile", "integral");
        let ideal = observed.profile("stress_profile", "ideal");
        let whole = observed.scalar("stress_profile_integral", "integral");
        let [height, film] = [HEIGHT, FILM].map(|length| length * self.units.range);
        split((&integral, whole), &ideal, [height, film], self.units.density * self.units.kt)
    }
}

/// Tensions of the wall from the integral of `P_N − P_T` up to each height, and the whole of it: below the middle of the film, and beside
/// the vapour. Where the film is tells the part of the particles in the pressure, which is `of_liquid` in the liquid: it may have gone
/// over to the upper wall.
pub fn split(
    (integral, whole): (&[(f64, Measured)], Measured),
    ideal: &[(f64, Measured)],
    [height, film]: [f64; 2],
    of_liquid: f64,
) -> Film {
    let below = |z: f64| nearest(integral, z);
    // The variance of the whole is that of both parts.
    let above = |z: f64| {
        let error = (whole.error.powi(2) - below(z).error.powi(2)).abs().sqrt();
        Measured { value: whole.value - below(z).value, error }
    };
    let mean = |low: f64, high: f64| {
        let slices = ideal.iter().filter(|(z, _)| (low..high).contains(z)).map(|(_, p)| p.value);
        let (count, sum) = slices.fold((0, 0.0), |(count, sum), p| (count + 1, sum + p));
        sum / f64::from(count.max(1))
    };
    // Behind the gap that a wall leaves; a film that went away in the run has less there.
    let [near, far] = [0.06 * film, 0.26 * film];
    let (low, high) = (mean(near, far), mean(height - far, height - near));
    let gap = 0.5 * (height - film);
    let (liquid, vapour) = if low >= high {
        (below(0.5 * film), above(height - gap))
    } else {
        (above(height - 0.5 * film), below(gap))
    };
    let touches = low.max(high) > 0.75 * of_liquid;
    // From the wall with the film to its middle, beside the density there.
    let up = |z: f64| if low >= high { z } else { height - z };
    let bulk = if low >= high {
        mean(0.4 * film, 0.6 * film)
    } else {
        mean(height - 0.6 * film, height - 0.4 * film)
    };
    let missing =
        ideal.iter().filter(|(z, _)| up(*z) < 0.5 * film).map(|(_, p)| 1.0 - p.value / bulk).sum::<f64>();
    let surface = missing * height / ideal.len().max(1) as f64;
    Film { liquid: touches.then_some(liquid), vapour, surface: if touches { surface } else { 0.0 } }
}

/// The mean of two films; without a liquid if one has left the wall.
pub fn both(films: [Film; 2]) -> Film {
    let liquid = match films.map(|film| film.liquid) {
        [Some(a), Some(b)] => Some(mean([a, b])),
        _ => None,
    };
    let surface = 0.5 * (films[0].surface + films[1].surface);
    Film { liquid, vapour: mean(films.map(|film| film.vapour)), surface }
}

impl Instrument for Runs<'_> {
    fn units(&self) -> Units {
        self.units
    }

    fn slab(&mut self) -> Result<Slab, Trouble> {
        let seed = self.sought.seed;
        let found =
            self.run([seed, seed.wrapping_add(1)].map(|seed| (Setting::slab(&self.units), seed)).into())?;
        let [a, b] = [0, 1].map(|k| Slab::of(&found[k]));
        let slab = Slab { tension: mean([a.tension, b.tension]), density: mean([a.density, b.density]) };
        self.units.learn(&slab);
        Ok(slab)
    }

    fn films(&mut self, strengths: [f64; 2]) -> Result<[Film; 2], Trouble> {
        let found =
            self.run(strengths.map(|strength| (self.film(strength, SEARCH), self.sought.seed)).into())?;
        Ok([0, 1].map(|k| self.tensions(&found[k])))
    }

    fn result(&mut self, strength: f64, surface: f64, round: u64) -> Result<(Film, Measured), Trouble> {
        let seeds = seeds_of_result(self.sought.seed, round);
        let lines = wall(strength, &self.units, "\"zlo\"");
        let found = self.run(vec![
            (self.film(strength, RESULT), seeds[0]),
            (self.film(strength, RESULT), seeds[1]),
            (Setting::ridge(self.sought.angle, surface, &lines, &self.units), seeds[2]),
        ])?;
        let films = [0, 1].map(|k| self.tensions(&found[k]));
        Ok((both(films), found[2].scalar("contact_angle", "angle")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::{Kind, Observation, Series};

    /// A film of a liquid of density 6 at kT = 0.7 on the lower wall, of ranges of 2: its particles have a pressure of 4.2, which is
    /// that of the liquid, so it touches; the tensions are those of the integral on either side of its surface.
    #[test]
    fn films_of_known_stress_are_read() {
        let model = psidpd_core::model::Model::parse("m.toml", crate::shipped::SET6).unwrap();
        let sought =
            Sought { model_file: "m.toml".into(), model, kt: 0.7, density: None, angle: 60.0, seed: 1 };
        let units = Units { kt: 0.7, range: 2.0, density: 6.0, dt: 0.1 };
        let runs = Runs { sought: &sought, folder: Path::new(""), units };
        let places: Vec<f64> = (0..110).map(|k| 0.2 * f64::from(k) + 0.1).collect();
        let film =
            |pressure: f64, from: f64| {
                let ideal = |z: &f64| if (from..10.0).contains(z) { pressure } else { 0.0 };
                let profile = Observation::new("stress_profile", "", Kind::Profile, &Series::new(1))
                    .against("z", "length", places.clone())
                    .exact("integral", "", places.iter().map(|z| if *z < 10.0 { -3.0 } else { 4.0 }))
                    .exact("ideal", "", places.iter().map(ideal));
                let whole = Observation::new("stress_profile_integral", "", Kind::Scalar, &Series::new(1))
                    .exact("integral", "", [4.5]);
                runs.tensions(&Observed(vec![profile, whole]))
            };
        let found = film(4.2, 0.0);
        assert_eq!((found.liquid.map(|l| l.value), found.vapour.value), (Some(-3.0), 0.5));
        // Less than three quarters of the liquid's: a film that has left.
        assert!(film(3.2, 0.0).liquid.is_some() && film(3.1, 0.0).liquid.is_none());
        // The surface of the liquid is as high above the face as its own density would have to be moved.
        assert!(found.surface.abs() < 1e-9 && (film(4.2, 0.6).surface - 0.6).abs() < 1e-9);
    }
}
