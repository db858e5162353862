//! The strength of the wall at which cos θ has a value: by two films at a time, until a straight line through those near the goal has it.

use super::{Film, Instrument, Slab, conditions};
use crate::ExperimentError;
use crate::liquid::Trouble;
use psidpd_core::model::pair::PairForm as _;
use psidpd_core::model::wall::HalfSpace;
use psidpd_core::model::{Fluid, PairTerm};
use psidpd_observe::Measured;
use serde::Serialize;

/// Whether a half-space of a fluid's pair potentials attracts particles somewhere: only then do liquids wet better on a stronger wall.
pub fn attracts(fluid: &Fluid) -> bool {
    const PLACES: u32 = 200;
    let dimensions = fluid.dimensions;
    let of = |term: &PairTerm| {
        let phi = &term.potential;
        HalfSpace::of(dimensions, phi.range(), 1.0, |r| phi.at(r))
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

    fn is_below(&self, goal: f64) -> bool {
        self.cosine.is_none_or(|cosine| cosine.value < goal)
    }
}

#[derive(Debug, PartialEq)]
pub enum End {
    Found(f64),
    /// No wall has the angle, and why.
    None(String),
}

/// The least and the largest strength that are tried.
const ENDS: [f64; 2] = [0.02, 4.0];

/// The first strengths, and how far those of a pair lie from the guess between them, relative to it, at least and at most.
const FIRST: [f64; 2] = [0.6, 1.2];
const ASIDE: [f64; 2] = [0.015, 0.06];

/// The straight line goes through films whose cosines are within this of the goal, and counts them for less by the square of the
/// distance, for the curvature.
const NEAR: f64 = 0.45;
const CURVED: f64 = 0.2;

const PAIRS: usize = 7;

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

/// Four digits, as a scene has it.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Seeks the strength; `trials` has what is known already, and what is measured comes to it.
pub fn search(
    wanted: f64,
    slab: &Slab,
    instrument: &mut dyn Instrument,
    trials: &mut Vec<Trial>,
    told: &mut dyn FnMut(&str),
) -> Result<End, ExperimentError> {
    let goal = wanted.to_radians().cos();
    let tolerance = CONTENT.to_radians() * wanted.to_radians().sin();
    for _ in 0..PAIRS {
        let strengths = match next(trials, goal, tolerance) {
            Next::Found(strength) => return Ok(End::Found(strength)),
            Next::Beyond => return Ok(End::None(beyond(trials, goal))),
            Next::Try(strengths) => strengths,
        };
        let films = match instrument.films(strengths) {
            Ok(films) => films,
            Err(Trouble::Failed(error)) => return Err(error),
            Err(trouble) => return Err(conditions(format!("a film on a wall: {trouble}"))),
        };
        for (strength, film) in strengths.into_iter().zip(films) {
            let trial = Trial::of(strength, &film, slab);
            told(&said(&trial));
            trials.push(trial);
        }
    }
    // The best line that there is.
    Ok(match line(trials, goal) {
        Some((strength, _)) => End::Found(strength),
        None => End::None(beyond(trials, goal)),
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

/// The nearest wall that was tried, in words.
fn beyond(trials: &[Trial], goal: f64) -> String {
    let off = |t: &&Trial| t.cosine.map_or(goal + 1.0, |c| (c.value - goal).abs());
    match trials.iter().min_by(|a, b| off(a).total_cmp(&off(b))) {
        Some(nearest) => {
            format!("no wall that was tried has this angle; the nearest: {}", said(nearest))
        }
        None => "no film was measured".into(),
    }
}

enum Next {
    Found(f64),
    Try([f64; 2]),
    /// The goal is beyond the ends of what is tried.
    Beyond,
}

fn next(trials: &[Trial], goal: f64, tolerance: f64) -> Next {
    let [least, most] = ENDS;
    let order = |a: &&Trial, b: &&Trial| a.strength.total_cmp(&b.strength);
    let below = trials.iter().filter(|t| t.is_below(goal)).max_by(order);
    let above = trials.iter().filter(|t| !t.is_below(goal)).min_by(order);
    let (below, above) = match (below, above) {
        (None, None) => return Next::Try(FIRST),
        (Some(below), None) if below.strength >= most => return Next::Beyond,
        (Some(below), None) => {
            return Next::Try([1.3, 1.7].map(|factor| (factor * below.strength).min(most)));
        }
        (None, Some(above)) if above.strength <= least => return Next::Beyond,
        (None, Some(above)) => {
            return Next::Try([0.5, 0.8].map(|factor| (factor * above.strength).max(least)));
        }
        (Some(below), Some(above)) => (below, above),
    };
    let guess = match line(trials, goal) {
        Some((strength, error)) if error <= tolerance => return Next::Found(strength),
        // Noise can put a film on the wrong side of another.
        Some((strength, _)) => strength
            .clamp(0.8 * below.strength.min(above.strength), 1.25 * below.strength.max(above.strength)),
        None => {
            let known = below.cosine.zip(above.cosine);
            let part = known.map_or(0.5, |(low, high)| (goal - low.value) / (high.value - low.value));
            below.strength + part.clamp(0.1, 0.9) * (above.strength - below.strength)
        }
    };
    let aside = (0.25 * (above.strength - below.strength).abs() / guess).clamp(ASIDE[0], ASIDE[1]);
    Next::Try([1.0 - aside, 1.0 + aside].map(|aside| (aside * guess).clamp(least, most)))
}

/// The strength at which the straight line through the films near the goal has it, and the standard error of the line there; `None` unless
/// there are films on both sides.
fn line(trials: &[Trial], goal: f64) -> Option<(f64, f64)> {
    let near: Vec<[f64; 3]> = trials
        .iter()
        .filter_map(|t| {
            let cosine = t.cosine.filter(|c| (c.value - goal).abs() <= NEAR)?;
            let error = cosine.error.hypot(CURVED * (cosine.value - goal).powi(2));
            Some([t.strength, cosine.value, 1.0 / (error * error).max(1e-12)])
        })
        .collect();
    let sum = |of: &dyn Fn(f64, f64) -> f64| near.iter().map(|[x, y, w]| w * of(*x, *y)).sum::<f64>();
    let weight = sum(&|_, _| 1.0);
    let [x0, y0] = [sum(&|x, _| x) / weight, sum(&|_, y| y) / weight];
    let xx = sum(&|x, _| (x - x0) * (x - x0));
    let slope = sum(&|x, y| (x - x0) * (y - y0)) / xx;
    let both = [true, false].iter().all(|side| near.iter().any(|[_, y, _]| (*y < goal) == *side));
    if !(both && slope > 0.0 && slope.is_finite()) {
        return None;
    }
    let strength = x0 + (goal - y0) / slope;
    Some((strength, (1.0 / weight + (strength - x0) * (strength - x0) / xx).sqrt()))
}
