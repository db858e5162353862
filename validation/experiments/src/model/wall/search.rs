//! The strength of the wall at which cos θ has a value, by films.

use super::{Film, Instrument, Slab};
use crate::Trouble;
use crate::model::seek::{Goal, Point, seek};
use psidpd_core::model::pair::PairForm as _;
use psidpd_core::model::wall::MatterIntegral;
use psidpd_core::model::{Fluid, PairTerm};
use psidpd_observe::Measured;
use serde::Serialize;

/// Whether a half-space of a fluid's pair potentials attracts particles somewhere: only then do liquids wet better on a stronger wall.
pub fn attracts(fluid: &Fluid) -> bool {
    const PLACES: u32 = 200;
    let dimensions = fluid.dimensions;
    let of = |term: &PairTerm| {
        let phi = &term.potential;
        MatterIntegral::of(dimensions, phi.range(), 1.0, |r| phi.at(r))
    };
    let Some(parts) = fluid.pairs.iter().map(of).collect::<Option<Vec<_>>>() else { return false };
    let places = (0..PLACES).map(|k| f64::from(k) / f64::from(PLACES) * fluid.cutoff());
    let energies: Vec<f64> = places.map(|z| parts.iter().map(|part| part.at(z)[0]).sum()).collect();
    // Beyond what is rounding where the potential ends.
    let largest = energies.iter().fold(0.0, |a: f64, e| a.max(e.abs()));
    energies.iter().any(|e| *e < -1e-6 * largest)
}

/// A wall that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    pub strength: f64,
    /// `cos θ`; `None` if the film left the wall.
    pub cosine: Option<Measured>,
    /// See [`Film::surface`].
    pub surface: f64,
}

impl Trial {
    pub fn of(strength: f64, film: &Film, slab: &Slab) -> Trial {
        Trial { strength, cosine: film.cosine(slab), surface: film.surface }
    }
}

/// The first strengths.
const FIRST: [f64; 2] = [0.6, 1.2];

/// The standard error of the angle, in degrees, with which the search is content.
const CONTENT: f64 = 1.0;

/// θ in degrees of its cosine: 180 if the film left the wall, and where the cosine is beyond 1, the end.
pub fn angle(cosine: Option<Measured>) -> Measured {
    let Some(Measured { value, error }) = cosine else { return Measured::from(180.0) };
    let at = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
    // Next to 0 and 180 degrees the slope of the arc cosine says nothing.
    Measured { value: at(value), error: 0.5 * (at(value - error) - at(value + error)) }
}

/// The surface of the wall that is nearest to this one and held its film.
pub fn surface(trials: &[Trial], strength: f64) -> f64 {
    let held = trials.iter().filter(|t| t.cosine.is_some());
    let off = |t: &&Trial| (t.strength - strength).abs();
    held.min_by(|a, b| off(a).total_cmp(&off(b))).map_or(0.0, |t| t.surface)
}

/// Seeks the strength; `trials` has what is known already, and what is measured comes to it. `None` if no wall has the angle.
pub fn search(
    wanted: f64,
    slab: &Slab,
    instrument: &mut dyn Instrument,
    trials: &mut Vec<Trial>,
    told: &mut dyn FnMut(&str),
) -> Result<Option<f64>, Trouble> {
    let wanted = wanted.to_radians();
    let goal = Goal { value: wanted.cos(), tolerance: CONTENT.to_radians() * wanted.sin(), first: FIRST };
    let point = |trial: &Trial| Point { strength: trial.strength, value: trial.cosine };
    seek(&goal, trials, point, |strengths| {
        let films = instrument.films(strengths)?;
        let pair = [0, 1].map(|k| Trial::of(strengths[k], &films[k], slab));
        pair.iter().for_each(|trial| told(&said(trial)));
        Ok(pair)
    })
}

fn said(trial: &Trial) -> String {
    let of = format!("strength = {:.3}", trial.strength);
    match trial.cosine {
        None => format!("{of}: the film leaves the wall"),
        Some(cosine) => {
            let angle = angle(trial.cosine);
            let (c, e) = (cosine.value, cosine.error);
            format!("{of}: cos θ = {c:.3}({e:.3}), θ = {:.1}({:.1})", angle.value, angle.error)
        }
    }
}

/// Why no wall has an angle: the nearest that was tried.
pub fn beyond(trials: &[Trial], wanted: f64) -> String {
    let goal = wanted.to_radians().cos();
    let off = |t: &&Trial| t.cosine.map_or(goal + 1.0, |c| (c.value - goal).abs());
    let nearest = trials.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    format!("no wall that was tried has this angle; the nearest: {}", nearest.map_or(String::new(), said))
}
