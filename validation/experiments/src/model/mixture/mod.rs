//! Two liquids from the tension between them.
//!
//! Each liquid keeps its model ([`merge`]); free is the strength of the attraction between them, `cross`. A box has a layer of each
//! liquid one on the other, with vapour above and below so that the pressure is that of the models beside their vapour. The stress between the
//! middles of both layers is the tension of their interface. `cross` is sought ([`crate::model::seek`]), and the result is measured by longer
//! runs from other seeds.

mod merge;
mod runs;
#[cfg(test)]
mod tests;

pub use merge::Liquid;

use crate::error::value_or_why;
use crate::model::seek::{Goal, Point, rounded, seek};
use crate::model::slabs::Slab;
use crate::{ExperimentError, Trouble};
use psidpd_core::model::Units;
use psidpd_formats::files::temporary_folder;
use psidpd_observe::Measured;
use serde::Serialize;

/// How far the tension may be from the wanted one, relative to it, beside its standard error, which may be no larger.
pub const TOLERANCE: f64 = 0.03;

/// The standard error of the line, relative to the tension, with which the search is content.
const CONTENT: f64 = 0.01;

/// The first strengths.
const FIRST: [f64; 2] = [0.5, 0.8];

/// How often the result is measured and sought again.
const ROUNDS: u64 = 2;

#[derive(Debug, Clone)]
pub struct Sought {
    pub liquids: [Liquid; 2],
    pub kt: f64,
    /// About the number densities of the liquids; by theory if left out.
    pub densities: Option<[f64; 2]>,
    /// The wanted tension of the interface: in N/m if the models have units, in theirs otherwise.
    pub tension: f64,
    pub seed: u64,
}

/// A pair of layers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Layers {
    pub tension: Measured,
    /// The fraction of particles of the other species in the middle of each layer.
    pub dissolved: [Measured; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    pub cross: f64,
    pub tension: Measured,
}

/// What measures: runs, or in tests liquids that are known.
trait Instrument {
    fn alone(&mut self) -> Result<[Slab; 2], Trouble>;
    /// Layers for these strengths, side by side.
    fn layers(&mut self, cross: [f64; 2]) -> Result<[Layers; 2], Trouble>;
    /// The mean of two longer runs from other seeds.
    fn result(&mut self, cross: f64, round: u64) -> Result<Layers, Trouble>;
}

/// A mixture, and what was found of it. Tensions are in units of the models, but for the wanted one and `unit`.
#[derive(Debug, Serialize)]
pub struct Found {
    pub species: [String; 2],
    /// In N/m if the models have units.
    pub wanted: f64,
    /// The unit of tension of the models, in N/m; 1 without units.
    pub unit: f64,
    pub cross: f64,
    /// The mass of a particle of the second liquid in the models' unit.
    pub mass: f64,
    pub alone: [Slab; 2],
    pub layers: Option<Layers>,
    pub trials: Vec<Trial>,
    /// Why there is no such mixture.
    pub refusal: Option<String>,
    pub good: bool,
}

impl Found {
    /// The tension of the result in the unit of the wanted one.
    pub fn tension(&self) -> Measured {
        self.layers.map_or(Measured::NONE, |layers| layers.tension.times(self.unit))
    }

    /// `γ_B − γ_A − γ_AB` in the unit of the wanted tension, with the index of B, the liquid of the larger tension. Above 0 the other spreads
    /// on it.
    pub fn spreading(&self) -> (usize, Measured) {
        let [a, b] = self.alone.map(|alone| alone.tension);
        let below = usize::from(b.value > a.value);
        let (low, high) = if below == 1 { (a, b) } else { (b, a) };
        (below, high.minus(low).times(self.unit).minus(self.tension()))
    }

    fn meets(&self) -> bool {
        let got = self.tension();
        let allowed = TOLERANCE * self.wanted;
        got.error <= allowed && (got.value - self.wanted).abs() <= allowed + got.error
    }
}

/// Finds the mixture by runs.
///
/// # Errors
/// Fails if the models cannot be mixed, or runs cannot be carried out. A tension that is missed is no error: see [`Found::refusal`].
pub fn mixture(sought: &Sought, told: &mut dyn FnMut(&str)) -> Result<Found, ExperimentError> {
    let [a, b] = &sought.liquids;
    if a.name == b.name {
        return Err(conditions(format!("both liquids are called {}: name their species, --species", a.name)));
    }
    let fits = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if let Some(name) = [&a.name, &b.name].into_iter().find(|name| !fits(name)) {
        return Err(conditions(format!(
            "{name:?} names no species: letters, digits and underscores, --species"
        )));
    }
    let folder = temporary_folder()?;
    let mut runs = runs::Runs::new(sought, folder.path())?;
    mixture_by(sought, &mut runs, told)
}

/// The file of the mixture; `head` goes into its comment.
///
/// # Errors
/// Fails as [`mixture`].
pub fn text(sought: &Sought, cross: f64, head: &str) -> Result<String, ExperimentError> {
    let [a, b] = &sought.liquids;
    merge::text([a, b], sought.kt, cross, head)
}

fn conditions(why: String) -> ExperimentError {
    ExperimentError::Conditions(why)
}

/// Finds the mixture with what `instrument` measures.
fn mixture_by(
    sought: &Sought,
    instrument: &mut dyn Instrument,
    told: &mut dyn FnMut(&str),
) -> Result<Found, ExperimentError> {
    let [a, b] = &sought.liquids;
    let (units, mass) = merge::units([a, b])?;
    let unit = units.map_or(1.0, |units: Units| units.energy / units.length.powi(2));
    let species = [a.name.clone(), b.name.clone()];
    let alone = value_or_why(instrument.alone())?
        .map_err(|why| conditions(format!("a slab of one liquid: {why}")))?;
    for (name, Slab { tension, density }) in species.iter().zip(&alone) {
        if tension.value.is_nan() || tension.value <= 0.0 {
            let why = format!(
                "{name} has a tension of {:.2}: it is no liquid beside its vapour; lower kT, or give --densities",
                tension.value
            );
            return Err(conditions(why));
        }
        told(&format!(
            "{name} beside its vapour: density {:.3}({:.3}), tension {:.4e}({:.1e})",
            density.value,
            density.error,
            unit * tension.value,
            unit * tension.error
        ));
    }
    let mut found = Found {
        species,
        wanted: sought.tension,
        unit,
        cross: f64::NAN,
        mass,
        alone,
        layers: None,
        trials: Vec::new(),
        refusal: None,
        good: false,
    };
    // Liquids with vapour between them have the sum.
    let sum = alone[0].tension.value + alone[1].tension.value;
    if sought.tension >= unit * sum {
        found.refusal = Some(format!(
            "a tension of {:e} is at least the sum {:.3e} of both liquids' own: at it they do not touch",
            sought.tension,
            unit * sum
        ));
        return Ok(found);
    }
    for round in 0..ROUNDS {
        if let Err(why) = value_or_why(attempt(sum, &mut found, instrument, round, told))? {
            found.refusal = Some(format!("both liquids: {why}"));
        }
        if found.refusal.is_some() {
            return Ok(found);
        }
        found.good = found.meets();
        if found.good {
            return Ok(found);
        }
        let tension = found.layers.map_or(Measured::NONE, |layers| layers.tension);
        found.trials.push(Trial { cross: found.cross, tension });
    }
    found.refusal = Some("the tension is not within the tolerance".into());
    Ok(found)
}

/// Seeks the strength at which `1 − γ_AB/(γ_A + γ_B)`, which grows with it, has its value, and measures it longer.
fn attempt(
    sum: f64,
    found: &mut Found,
    instrument: &mut dyn Instrument,
    round: u64,
    told: &mut dyn FnMut(&str),
) -> Result<(), Trouble> {
    let (unit, wanted) = (found.unit, found.wanted / found.unit);
    let goal = Goal { value: 1.0 - wanted / sum, tolerance: CONTENT * wanted / sum, first: FIRST };
    let point = |t: &Trial| {
        let value = Measured { value: 1.0 - t.tension.value / sum, error: t.tension.error / sum };
        Point { strength: t.cross, value: Some(value) }
    };
    let cross = seek(&goal, &mut found.trials, point, |cross| {
        let layers = instrument.layers(cross)?;
        let pair = [0, 1].map(|k| Trial { cross: cross[k], tension: layers[k].tension });
        pair.iter().for_each(|trial| told(&said(trial, unit)));
        Ok(pair)
    })?;
    let Some(cross) = cross else {
        let off = |t: &&Trial| (t.tension.value - wanted).abs();
        let nearest = found.trials.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let nearest = nearest.map_or(String::new(), |t| format!("; the nearest: {}", said(t, unit)));
        found.refusal = Some(format!("no attraction that was tried has this tension{nearest}"));
        return Ok(());
    };
    found.cross = rounded(cross);
    told(&format!("measuring cross = {}: longer, from other seeds", found.cross));
    found.layers = Some(instrument.result(found.cross, round)?);
    Ok(())
}

fn said(trial: &Trial, unit: f64) -> String {
    let Trial { cross, tension } = trial;
    format!("cross = {cross:.3}: tension {:.4e}({:.1e})", unit * tension.value, unit * tension.error)
}
