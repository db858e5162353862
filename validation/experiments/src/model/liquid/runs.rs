//! Measures by runs: the homogeneous liquid at three densities, a slab of it in its vapour, and two flows side by side.

use super::fluid::{Drag, Strengths, USUAL, text};
use super::instrument::{Care, Equilibrium, Flow, Instrument};
use super::sheet::Liquid;
use crate::model::slabs::{self, Setting};
use crate::model::steps::{self, ADVISED, FIRST};
use crate::run::Observed;
use crate::{ExperimentError, Trouble};
use psidpd_core::model::Model;
use psidpd_dynamics::trial::{Composition, Piece};
use psidpd_formats::files::{Existing, write_bytes};
use psidpd_observe::Measured;
use std::path::Path;

/// Times that runs last, in r_c √(m/kT): the homogeneous liquid, the slab, the flow.
const TIMES: [f64; 3] = [25.0, 100.0, 300.0];
/// How many times longer those of the result are.
const LONGER: f64 = 3.0;
/// A tension has about the same error in these units whatever it is: the slab of the result of a smaller one than this lasts longer by the
/// square of how much smaller it is, up to four times, so that the error is below the tolerance.
const FAINT: f64 = 4.5;

/// Densities of the homogeneous liquid, over that of the goals.
const DENSITIES: [f64; 3] = [0.97, 1.0, 1.03];

const PARTICLES: f64 = 600.0;

/// The slab, in r_c.
const AREA: f64 = 6.0;
const THICKNESS: f64 = 7.0;
const HEIGHT: f64 = 14.0;

/// A diffusion coefficient below this, in r_c √(kT/m), is that of a solid: Warren's set 6 has 0.034, and the solid of three times its
/// attraction, ordered or not, less than 0.002.
const SOLID: f64 = 0.006;

/// Two flows side by side: edges of the box, and the highest velocity. Liquids are thinned by shear, by the square of its rate: water of
/// three molecules in a particle has a viscosity of 30.5 at a velocity of 0.4, 33.3 at 0.2 and 34.4 at 0.1.
const CHANNEL: [f64; 3] = [5.0, 5.0, 12.0];
const VELOCITY: f64 = 0.15;

pub struct Runs<'a> {
    pub liquid: &'a Liquid,
    pub folder: &'a Path,
    pub seed: u64,
}

impl Runs<'_> {
    /// Writes the model, and gives it.
    fn model(&self, fluid: &Strengths, drag: &Drag) -> Result<Model, ExperimentError> {
        let (path, text) = (self.folder.join("liquid.toml"), text(self.liquid, fluid, drag, ""));
        write_bytes(&path, Existing::Keep, text.as_bytes())?;
        Ok(Model::parse_in(&path, &text)?)
    }

    fn piece(&self, model: &Model) -> Result<Piece, Trouble> {
        let densities = [self.liquid.goals.density];
        let of = Composition { model, masses: &[1.0], kt: 1.0, densities: &densities, seed: self.seed };
        match Piece::settled(&of)? {
            Ok(piece) => Ok(piece),
            Err(why) => Err(Trouble::Stopped(why.to_string())),
        }
    }

    fn dt(&self, model: &Model) -> Result<f64, Trouble> {
        Ok(steps::dt(&self.piece(model)?))
    }

    /// The longest step with errors of about a percent.
    pub fn longest_step(&self, fluid: &Strengths, drag: &Drag) -> Result<Option<f64>, Trouble> {
        let piece = self.piece(&self.model(fluid, drag)?)?;
        Ok(piece.longest(ADVISED)?.map(|(dt, _)| dt))
    }

    fn seed(&self, care: Care) -> u64 {
        match care {
            Care::Search => self.seed,
            Care::Result(seed) => self.seed.wrapping_add(1000).wrapping_add(seed),
        }
    }

    fn runs(&self, settings: Vec<Setting>, care: Care) -> Vec<slabs::Run> {
        let (model, seed) = (self.folder.join("liquid.toml"), self.seed(care));
        let run = |setting| slabs::Run { setting, model: model.clone(), kt: 1.0, seed };
        settings.into_iter().map(run).collect()
    }

    /// Runs scenes side by side; the last is the longest.
    fn run(&self, settings: Vec<Setting>, care: Care) -> Result<Vec<Observed>, Trouble> {
        let all = slabs::run(&self.runs(settings, care), self.folder)?;
        match all.iter().flat_map(|o| &o.0).find(|o| o.note.contains("are a crystal")) {
            Some(crystal) => Err(Trouble::Frozen(crystal.note.clone())),
            None => Ok(all),
        }
    }

    fn homogeneous(&self, share: f64, time: f64, dt: f64, observe: &str) -> Setting {
        let density = share * self.liquid.goals.density;
        Setting {
            title: "homogeneous liquid".into(),
            edges: [(PARTICLES / density).cbrt(); 3],
            parts: lattice(density),
            steps: [FIRST * dt, dt],
            times: [8.0, time],
            observe: observe.into(),
            ..Setting::default()
        }
    }

    /// Two flows of a liquid whose viscosity is about `guess`, and for a result the liquid at rest before them.
    fn flows(&self, guess: f64, dt: f64, care: Care) -> Vec<Setting> {
        let density = self.liquid.goals.density;
        // v = ρ a z (D − z)/2η in each half of width D.
        let half = 0.5 * CHANNEL[2];
        let acceleration = 8.0 * guess * VELOCITY / (density * half * half);
        let force =
            format!("[[body_force]]\nacceleration = [{acceleration:?}, 0.0, 0.0]\nreversed_along = \"z\"\n");
        let mut settings = vec![Setting {
            title: "two flows".into(),
            edges: CHANNEL,
            lines: force,
            parts: lattice(density),
            steps: [FIRST * dt, dt],
            times: [8.0 + density * half * half / guess, longer(care, TIMES[2])],
            observe: OF_FLOW.into(),
        }];
        if care != Care::Search {
            settings.insert(0, self.homogeneous(1.0, longer(care, TIMES[2]), dt, OF_MOTION));
        }
        settings
    }

    /// The scenes of [`Runs::flows`].
    #[cfg(test)]
    pub fn scenes_of_flows(
        &self,
        (fluid, drag): (&Strengths, &Drag),
        guess: f64,
        dt: f64,
        care: Care,
    ) -> Vec<psidpd_dynamics::scene::Scene> {
        self.model(fluid, drag).unwrap();
        let runs = self.runs(self.flows(guess, dt, care), care);
        runs.iter().map(|run| run.scene().unwrap()).collect()
    }
}

fn lattice(density: f64) -> String {
    format!("[initial]\nkind = \"lattice\"\ndensity = {density:?}\n")
}

fn longer(care: Care, time: f64) -> f64 {
    if care == Care::Search { time } else { LONGER * time }
}

/// How long the slab is measured for this tension.
pub fn slab_time(care: Care, tension: Option<f64>) -> f64 {
    let faint = match (care, tension) {
        (Care::Result(_), Some(tension)) => (FAINT / tension).powi(2).clamp(1.0, 4.0),
        _ => 1.0,
    };
    faint * longer(care, TIMES[1])
}

const OF_BULK: &str = "every = 5\npressure = true\nmsd = { every = 25, length = 10 }\n";
const OF_SLAB: &str = "every = 5\nsurface_tension = true\ninterface_width = { every = 25 }\n";
const OF_FLOW: &str = "every = 3\npoiseuille = true\n";
const OF_MOTION: &str = "msd = { every = 15, length = 10 }\n";

/// What the liquid at the three densities, of which the middle one is `density`, and its slab show.
fn read(found: &[Observed], density: f64) -> Result<Equilibrium, Trouble> {
    let [thin, wanted, dense] = [0, 1, 2].map(|k: usize| found[k].configurational_pressure());
    let slab = &found[3];
    let diffusion = found[1].scalar("diffusion", "diffusion").value;
    if diffusion < SOLID {
        let message = format!("particles stay in place, with a diffusion coefficient of {diffusion:.4}");
        return Err(Trouble::Frozen(message));
    }
    Ok(Equilibrium {
        pressure: wanted,
        stiffness: dense.minus(thin).times(1.0 / ((DENSITIES[2] - DENSITIES[0]) * density)),
        // Of the routes to the tension that with the least scatter.
        tension: slab.scalar("surface_tension", "free_energy"),
        liquid: slab.scalar("interface_width", "liquid"),
    })
}

impl Instrument for Runs<'_> {
    fn equilibrium(&mut self, fluid: &Strengths, care: Care) -> Result<Equilibrium, Trouble> {
        let dt = self.dt(&self.model(fluid, &USUAL)?)?;
        let density = self.liquid.goals.density;
        let mut settings: Vec<Setting> = DENSITIES
            .iter()
            .map(|share| self.homogeneous(*share, longer(care, TIMES[0]), dt, OF_BULK))
            .collect();
        settings.push(Setting {
            title: "slab".into(),
            edges: [AREA, AREA, HEIGHT],
            parts: format!(
                "[initial]\nkind = \"slab\"\naxis = \"z\"\nthickness = {THICKNESS:?}\ndensity = {density:?}\n"
            ),
            steps: [FIRST * dt, dt],
            times: [12.0, slab_time(care, self.liquid.goals.tension)],
            observe: OF_SLAB.into(),
            ..Setting::default()
        });
        read(&self.run(settings, care)?, density)
    }

    fn flow(&mut self, fluid: &Strengths, drag: &Drag, guess: f64, care: Care) -> Result<Flow, Trouble> {
        let dt = self.dt(&self.model(fluid, drag)?)?;
        let found = self.run(self.flows(guess, dt, care), care)?;
        let last = &found[found.len() - 1];
        let diffusion = match care {
            Care::Search => Measured::NONE,
            Care::Result(_) => found[0].scalar("diffusion", "diffusion"),
        };
        Ok(Flow { viscosity: last.scalar("poiseuille", "viscosity"), diffusion, dt })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::observation::Kind;
    use psidpd_observe::{Observation, Series};

    /// A liquid of density 5 whose pressure is −0.6, 0.3 and 1.2 at the three densities, 0.3 apart in all: a stiffness of 6.
    #[test]
    fn a_liquid_of_known_pressures_is_read_and_a_solid_is_not() {
        let number = |name: &str, column: &str, value: Measured| {
            Observation::new(name, name, Kind::Scalar, &Series::new(1)).column(column, "1", [value])
        };
        let of = |diffusion: f64| {
            let pressure = |value: f64| {
                let pressure = number("pressure", "configurational", [value, 0.03].into());
                Observed(vec![pressure, number("diffusion", "diffusion", diffusion.into())])
            };
            let slab = Observed(vec![
                number("surface_tension", "free_energy", [7.5, 0.2].into()),
                number("interface_width", "liquid", [5.1, 0.01].into()),
            ]);
            read(&[pressure(-0.6), pressure(0.3), pressure(1.2), slab], 5.0)
        };
        let Equilibrium { pressure, stiffness, tension, liquid } = of(0.03).unwrap();
        assert_eq!([pressure.value, pressure.error, tension.value, liquid.value], [0.3, 0.03, 7.5, 5.1]);
        assert!((stiffness.value - 6.0).abs() < 1e-12, "{stiffness:?}");
        assert!((stiffness.error - 0.03 * 2f64.sqrt() / 0.3).abs() < 1e-12, "{stiffness:?}");
        // What is not known is not said to be solid.
        assert!(of(0.0061).is_ok() && of(f64::NAN).is_ok());
        let Err(Trouble::Frozen(why)) = of(0.0059) else { panic!("a solid") };
        assert!(why.contains("0.0059"), "{why}");
    }
}
