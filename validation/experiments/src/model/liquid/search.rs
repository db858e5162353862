//! The strengths with which a fluid has its goals, by Gauss–Newton steps on measured values.
//!
//! The slopes begin with those of the theory. Every measurement corrects them: a plane is fitted through all of them, by least squares
//! with their errors, which the slopes of the theory hold as far as they are trusted. So noise does not become a slope, and a theory
//! that is off by a half needs one or two steps more.

use super::fluid::Strengths;
use super::instrument::{Care, Equilibrium, Instrument};
use super::sheet::{Goals, Tolerance};
use super::theory::{free, start, theory};
use crate::ExperimentError;
use crate::error::value_or_why;
use nalgebra::{DMatrix, DVector};
use psidpd_observe::Measured;
use serde::Serialize;

/// Most measurements.
const MOST: usize = 9;

/// How far the slopes of the theory may be off, as a share.
const TRUST: f64 = 0.5;

/// Slopes are added to this share of the largest, for those that the theory does not know.
const UNKNOWN: f64 = 0.3;

/// Far measurements say less of slopes here: curvature, as a share of the change.
const CURVED: f64 = 0.15;

/// Sizes of the strengths, and the largest step in them.
const SIZES: [f64; 3] = [10.0, 2.0, 0.2];
const LONGEST: f64 = 2.0;

/// The search is content with this share of the tolerance: the result is measured again.
const CONTENT: f64 = 0.6;

/// And with a distance within its error, up to so many tolerances.
const UNTOLD: f64 = 1.5;

/// A fluid that was measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Trial {
    pub fluid: Strengths,
    pub found: Equilibrium,
}

/// How the search ended.
#[derive(Debug)]
pub enum End {
    Met,
    /// The fluid is the best of those that were tried.
    Missed,
    /// The way to the goals, or the first guess, leads to a fluid that has no result.
    Blocked(String),
}

/// Distances of what was found from the goals, with their errors, in tolerances: density, stiffness, tension.
fn distances(found: &Equilibrium, goals: &Goals, tolerance: &Tolerance) -> [Measured; 3] {
    let stiffness = goals.stiffness.unwrap_or(found.stiffness.value).max(1.0);
    let share = |got: Measured, goal: Option<f64>, tolerance: f64| match goal {
        Some(goal) => got.times(1.0 / goal).minus(1.0).times(1.0 / tolerance),
        None => Measured::from(0.0),
    };
    [
        found.pressure.times(1.0 / (goals.density * stiffness * tolerance.density)),
        share(found.stiffness, goals.stiffness, tolerance.compressibility),
        share(found.tension, goals.tension, tolerance.tension),
    ]
}

/// The largest distance; infinite if one is not known.
pub fn score(found: &Equilibrium, goals: &Goals, tolerance: &Tolerance) -> f64 {
    let all = distances(found, goals, tolerance).map(|d| d.value.abs());
    if all.iter().any(|d| d.is_nan()) { f64::INFINITY } else { all.into_iter().fold(0.0, f64::max) }
}

/// The trial with the smallest score.
pub fn best(trials: &[Trial], goals: &Goals, tolerance: &Tolerance) -> Option<Trial> {
    let of = |t: &&Trial| score(&t.found, goals, tolerance);
    trials.iter().min_by(|a, b| of(a).total_cmp(&of(b))).copied()
}

/// Whether the search ends: what is left is small, or is not told from none and the result will tell.
fn is_content(found: &Equilibrium, goals: &Goals, tolerance: &Tolerance) -> bool {
    let near = |d: &Measured| d.value.abs() <= CONTENT.max(d.error.min(UNTOLD));
    distances(found, goals, tolerance).iter().all(near)
}

/// Seeks the strengths; `trials` has what is known already, and what was measured comes to it.
pub fn search(
    goals: &Goals,
    tolerance: &Tolerance,
    instrument: &mut dyn Instrument,
    trials: &mut Vec<Trial>,
    told: &mut dyn FnMut(&str),
) -> Result<End, ExperimentError> {
    let best = |trials: &[Trial]| best(trials, goals, tolerance);
    let mut next = match best(trials) {
        None => start(goals),
        Some(best) => toward(trials, &best, goals),
    };
    for _ in 0..MOST {
        let measured = measured(instrument, &mut next, (best(trials).map(|t| t.fluid), goals), told)?;
        let found = match measured {
            Ok(found) => found,
            Err(why) => return Ok(End::Blocked(why)),
        };
        trials.push(Trial { fluid: next, found });
        told(&format!(
            "A = {:.2}, c1 = {:.3}, c2 = {:.4}: pressure {:.2}({:.2}), stiffness {:.1}({:.1}), tension {:.2}({:.2})",
            next.attraction,
            next.linear,
            next.square,
            found.pressure.value,
            found.pressure.error,
            found.stiffness.value,
            found.stiffness.error,
            found.tension.value,
            found.tension.error
        ));
        if is_content(&found, goals, tolerance) {
            return Ok(End::Met);
        }
        let Some(best) = best(trials) else { break };
        next = toward(trials, &best, goals);
    }
    Ok(End::Missed)
}

/// Measures a fluid, or one nearer to a fluid that is known if it has no result.
fn measured(
    instrument: &mut dyn Instrument,
    next: &mut Strengths,
    (known, goals): (Option<Strengths>, &Goals),
    told: &mut dyn FnMut(&str),
) -> Result<Result<Equilibrium, String>, ExperimentError> {
    let mut why = String::new();
    for _ in 0..3 {
        match value_or_why(instrument.equilibrium(next, Care::Search))? {
            Ok(found) => return Ok(Ok(found)),
            Err(trouble) => why = trouble,
        }
        told(&format!("A = {:.2}, c1 = {:.3}, c2 = {:.4}: {why}", next.attraction, next.linear, next.square));
        // Without a result yet: toward Warren's liquid.
        let known = known.unwrap_or_else(|| start(&Goals { stiffness: None, tension: None, ..*goals }));
        let middle = next.array().iter().zip(known.array()).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>();
        *next = Strengths::of([middle[0], middle[1], middle[2]]);
    }
    Ok(Err(why))
}

/// The strengths at which the plane through the trials has the goals, or as far in their direction as a step may be.
fn toward(trials: &[Trial], best: &Trial, goals: &Goals) -> Strengths {
    let free: Vec<usize> = (0..3).filter(|k| free(goals)[*k]).collect();
    let wanted = [Some(0.0), goals.stiffness, goals.tension];
    let aims: Vec<usize> = (0..3).filter(|k| wanted[*k].is_some()).collect();
    let (_, slopes) = theory(&best.fluid, goals.density);
    let mut matrix = DMatrix::zeros(aims.len(), free.len());
    let mut rest = DVector::zeros(aims.len());
    for (row, aim) in aims.iter().enumerate() {
        let prior: Vec<f64> = free.iter().map(|k| slopes[*aim][*k] * SIZES[*k]).collect();
        let (value, slopes) = plane(trials, best, *aim, &free, &prior);
        rest[row] = wanted[*aim].unwrap_or(value) - value;
        slopes.iter().enumerate().for_each(|(k, slope)| matrix[(row, k)] = *slope);
    }
    // Rows of one size: all goals count alike.
    for row in 0..aims.len() {
        let size = matrix.row(row).norm().max(1e-12);
        matrix.row_mut(row).scale_mut(1.0 / size);
        rest[row] /= size;
    }
    let step = matrix.pseudo_inverse(1e-3).map_or(DVector::zeros(free.len()), |inverse| inverse * rest);
    let longest = step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let shrink = if longest > LONGEST { LONGEST / longest } else { 1.0 };
    let mut next = best.fluid.array();
    free.iter().zip(step.iter()).for_each(|(k, x)| next[*k] += shrink * x * SIZES[*k]);
    Strengths::of([next[0].clamp(-200.0, -3.0), next[1], next[2].max(0.01)])
}

fn values(found: &Equilibrium) -> [Measured; 3] {
    [found.pressure, found.stiffness, found.tension]
}

/// The value at the best trial and the slopes, in [`SIZES`], of one result.
fn plane(trials: &[Trial], best: &Trial, aim: usize, free: &[usize], prior: &[f64]) -> (f64, Vec<f64>) {
    let n = free.len() + 1;
    let (mut matrix, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut add = |row: &[f64], value: f64, error: f64| {
        for (i, a) in row.iter().enumerate() {
            right[i] += a * value / (error * error);
            row.iter().enumerate().for_each(|(j, b)| matrix[(i, j)] += a * b / (error * error));
        }
    };
    let largest = prior.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    for trial in trials {
        let (here, there) = (trial.fluid.array(), best.fluid.array());
        let mut row = vec![1.0];
        row.extend(free.iter().map(|k| (here[*k] - there[*k]) / SIZES[*k]));
        let away: f64 = row[1..].iter().map(|x| x * x).sum::<f64>();
        let measured = values(&trial.found)[aim];
        let error = measured.error.hypot(CURVED * largest * away).max(1e-9);
        add(&row, measured.value, error);
    }
    for (k, slope) in prior.iter().enumerate() {
        let mut row = vec![0.0; n];
        row[k + 1] = 1.0;
        add(&row, *slope, TRUST * slope.abs() + UNKNOWN * largest + 1e-9);
    }
    let found = matrix.lu().solve(&right).unwrap_or(DVector::zeros(n));
    (found[0], found.iter().skip(1).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two trials that are known well give value and slope, and a third that is known badly changes neither, whatever the theory says.
    #[test]
    fn a_plane_goes_through_what_is_known_well() {
        let trial = |attraction: f64, value: f64, error: f64| {
            let measured = Measured { value, error };
            let found =
                Equilibrium { pressure: measured, stiffness: measured, tension: measured, liquid: measured };
            Trial { fluid: Strengths { attraction, linear: 0.0, square: 0.5 }, found }
        };
        // A step of one size changes the pressure by 3; the theory says 5.
        let well = [trial(-40.0, 1.0, 1e-3), trial(-39.0, 1.3, 1e-3)];
        let badly = trial(-30.0, 90.0, 30.0);
        let (value, slopes) = plane(&well, &well[0], 0, &[0], &[5.0]);
        assert!((value - 1.0).abs() < 1e-3 && (slopes[0] - 3.0).abs() < 0.1, "{value} {slopes:?}");
        let (value, slopes) = plane(&[well[0], well[1], badly], &well[0], 0, &[0], &[5.0]);
        assert!((value - 1.0).abs() < 2e-3 && (slopes[0] - 3.0).abs() < 0.2, "{value} {slopes:?}");
        // Of a single trial the slope is that of the theory.
        let (value, slopes) = plane(&well[..1], &well[0], 0, &[0], &[5.0]);
        assert!((value - 1.0).abs() < 1e-9 && (slopes[0] - 5.0).abs() < 1e-9, "{value} {slopes:?}");
    }
}
