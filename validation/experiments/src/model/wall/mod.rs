//! A wall from its contact angle.
//!
//! The wall is a half-space of the liquid's own matter (`[[wall]]` of a scene), whose strength of attraction is free. By Young's law,
//! `γ_LV cos θ = γ_WV − γ_WL`, three tensions make the angle: that of the liquid's surface from a slab, and those of the wall below a film
//! and beside the vapour from the film's profile of stress. The strength is sought by such films ([`search`]); the angle of the result
//! is measured by longer ones from other seeds, and by a ridge of the liquid on the wall, whose shape knows nothing of stress.

mod ridge;
mod runs;
mod scene;
mod search;
#[cfg(test)]
mod tests;

pub use crate::model::slabs::{Slab, Units};
pub use search::Trial;

use crate::error::value_or_why;
use crate::model::seek::rounded;
use crate::{ExperimentError, Trouble};
use psidpd_core::model::Model;
use psidpd_formats::files::temporary_folder;
use psidpd_observe::Measured;
use serde::Serialize;
use std::path::PathBuf;

/// How far both angles may be from the wanted one, in degrees, beside their standard errors.
pub const TOLERANCE: f64 = 3.0;

/// Angles that are sought: beyond them a drop is a film or a sphere within the errors.
pub const ANGLES: [f64; 2] = [20.0, 160.0];

/// How often the result is measured and sought again.
const ROUNDS: u64 = 2;

#[derive(Debug, Clone)]
pub struct Sought {
    pub model_file: PathBuf,
    /// The liquid, of one species.
    pub model: Model,
    pub kt: f64,
    /// About the number density of the liquid; by theory if left out.
    pub density: Option<f64>,
    /// In degrees.
    pub angle: f64,
    pub seed: u64,
}

/// A film on the wall, with tensions in units of the model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Film {
    /// γ_WL; `None` if the film left the wall.
    pub liquid: Option<Measured>,
    /// γ_WV
    pub vapour: Measured,
    /// The height above the face of the surface without adsorption, up to which liquid of its density would have the particles that
    /// there are: the surface that the shape of a drop knows.
    pub surface: f64,
}

impl Film {
    /// `cos θ` by Young's law; `None` if the film left the wall.
    pub fn cosine(&self, slab: &Slab) -> Option<Measured> {
        self.liquid.map(|liquid| self.vapour.minus(liquid).over(slab.tension))
    }
}

/// What measures: runs, or in tests a wall that is known.
trait Instrument {
    fn units(&self) -> Units;
    fn slab(&mut self) -> Result<Slab, Trouble>;
    /// Films on walls with these strengths, one after the other or side by side.
    fn films(&mut self, strengths: [f64; 2]) -> Result<[Film; 2], Trouble>;
    /// The mean of two longer films from other seeds, and the angle, in degrees, at which a ridge meets the surface.
    fn result(&mut self, strength: f64, surface: f64, round: u64) -> Result<(Film, Measured), Trouble>;
}

/// A wall, and what was found of it.
#[derive(Debug, Serialize)]
pub struct Found {
    pub wanted: f64,
    /// The factor of the pair potentials between fluid and matter.
    pub strength: f64,
    pub slab: Slab,
    pub film: Option<Film>,
    /// θ in degrees by Young's law, and by the shape of a ridge.
    pub young: Measured,
    pub ridge: Measured,
    pub trials: Vec<Trial>,
    /// Why there is no such wall.
    pub refusal: Option<String>,
    pub good: bool,
    /// The liquid in units of its model, and the step of the runs.
    pub units: Units,
}

impl Found {
    /// Whether an angle is the wanted one, within the tolerance and a standard error that is no larger.
    pub fn meets(&self, angle: Measured) -> bool {
        angle.error <= TOLERANCE && (angle.value - self.wanted).abs() <= TOLERANCE + angle.error
    }
}

/// Finds the wall by runs.
///
/// # Errors
/// Fails if the model can have no such wall, or runs cannot be carried out. An angle that is missed is no error: see [`Found::refusal`].
pub fn wall(sought: &Sought, told: &mut dyn FnMut(&str)) -> Result<Found, ExperimentError> {
    let [least, most] = ANGLES;
    if !(least..=most).contains(&sought.angle) {
        return Err(conditions(format!("a contact angle from {least} to {most} degrees can be sought")));
    }
    let folder = temporary_folder()?;
    let mut runs = runs::Runs::new(sought, folder.path())?;
    wall_by(sought, &mut runs, told)
}

fn conditions(why: String) -> ExperimentError {
    ExperimentError::Conditions(why)
}

/// Finds the wall with what `instrument` measures.
fn wall_by(
    sought: &Sought,
    instrument: &mut dyn Instrument,
    told: &mut dyn FnMut(&str),
) -> Result<Found, ExperimentError> {
    let slab =
        value_or_why(instrument.slab())?.map_err(|why| conditions(format!("a slab of the liquid: {why}")))?;
    if slab.tension.value.is_nan() || slab.tension.value <= 0.0 {
        return Err(conditions(format!(
            "the slab has a tension of {:.2}: it is no liquid beside its vapour; lower kT, or give the density of the liquid, \
             --density",
            slab.tension.value
        )));
    }
    told(&format!(
        "the liquid: density {:.3}({:.3}), tension {:.2}({:.2})",
        slab.density.value, slab.density.error, slab.tension.value, slab.tension.error
    ));
    let mut found = Found {
        wanted: sought.angle,
        strength: f64::NAN,
        slab,
        film: None,
        young: Measured::NONE,
        ridge: Measured::NONE,
        trials: Vec::new(),
        refusal: None,
        good: false,
        units: instrument.units(),
    };
    for round in 0..ROUNDS {
        let strength =
            value_or_why(search::search(sought.angle, &slab, instrument, &mut found.trials, told))?
                .map_err(|why| conditions(format!("a film on a wall: {why}")))?;
        let Some(strength) = strength.map(rounded) else {
            found.refusal = Some(search::beyond(&found.trials, sought.angle));
            return Ok(found);
        };
        found.strength = strength;
        told(&format!("measuring strength = {strength}: longer films from other seeds, and a ridge"));
        let surface = search::surface(&found.trials, strength);
        let (film, ridge) = match value_or_why(instrument.result(strength, surface, round))? {
            Ok(result) => result,
            Err(why) => {
                found.refusal = Some(why);
                return Ok(found);
            }
        };
        let trial = Trial::of(strength, &film, &slab);
        let cosine = trial.cosine;
        (found.film, found.young, found.ridge) = (Some(film), search::angle(cosine), ridge);
        found.good = found.meets(found.young) && found.meets(found.ridge);
        if found.meets(found.young) {
            break;
        }
        found.trials.push(trial);
    }
    if !found.good {
        found.refusal = Some("the angles of both routes are not within the tolerance".into());
    }
    Ok(found)
}
