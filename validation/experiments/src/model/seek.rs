//! The strength at which a measured quantity, which grows with it, has a value: by two measurements at a time, until a straight line
//! through those near the goal has it.

use crate::Trouble;
use psidpd_observe::Measured;

/// A strength that was tried, and what was measured; `None` is below every value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub strength: f64,
    pub value: Option<Measured>,
}

/// What is sought, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    pub value: f64,
    /// The standard error with which the search is content.
    pub tolerance: f64,
    /// The first strengths.
    pub first: [f64; 2],
}

enum Next {
    Found(f64),
    Try([f64; 2]),
    /// The goal is beyond the ends of what is tried.
    Beyond,
}

/// The least and the largest strength that are tried.
const ENDS: [f64; 2] = [0.02, 4.0];

/// How far the strengths of a pair lie from the guess between them, relative to it, at least and at most.
const ASIDE: [f64; 2] = [0.015, 0.06];

/// The straight line goes through values within this of the goal, of values of the order of one, and counts them for less by the square
/// of the distance, for the curvature.
const NEAR: f64 = 0.45;
const CURVED: f64 = 0.2;

/// How many pairs are tried at most.
const PAIRS: usize = 7;

/// Four digits, as a file has it.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Seeks the strength; `trials` has what is known already, and what `pair` measures comes to it. `None` if the goal is beyond all.
pub fn seek<T>(
    goal: &Goal,
    trials: &mut Vec<T>,
    point: impl Fn(&T) -> Point,
    mut pair: impl FnMut([f64; 2]) -> Result<[T; 2], Trouble>,
) -> Result<Option<f64>, Trouble> {
    let points = |trials: &[T]| trials.iter().map(&point).collect::<Vec<_>>();
    for _ in 0..PAIRS {
        match next(&points(trials), goal) {
            Next::Found(strength) => return Ok(Some(strength)),
            Next::Beyond => break,
            Next::Try(strengths) => trials.extend(pair(strengths)?),
        }
    }
    // The best line that there is.
    Ok(line(&points(trials), goal.value).map(|(strength, _)| strength))
}

fn next(points: &[Point], goal: &Goal) -> Next {
    let [least, most] = ENDS;
    let is_below = |p: &&Point| p.value.is_none_or(|value| value.value < goal.value);
    let order = |a: &&Point, b: &&Point| a.strength.total_cmp(&b.strength);
    let below = points.iter().filter(is_below).max_by(order);
    let above = points.iter().filter(|p| !is_below(p)).min_by(order);
    let (below, above) = match (below, above) {
        (None, None) => return Next::Try(goal.first),
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
    let guess = match line(points, goal.value) {
        Some((strength, error)) if error <= goal.tolerance => return Next::Found(strength),
        // Noise can put a value on the wrong side of another.
        Some((strength, _)) => strength
            .clamp(0.8 * below.strength.min(above.strength), 1.25 * below.strength.max(above.strength)),
        None => {
            let known = below.value.zip(above.value);
            let part = known.map_or(0.5, |(low, high)| (goal.value - low.value) / (high.value - low.value));
            below.strength + part.clamp(0.1, 0.9) * (above.strength - below.strength)
        }
    };
    let aside = (0.25 * (above.strength - below.strength).abs() / guess).clamp(ASIDE[0], ASIDE[1]);
    Next::Try([1.0 - aside, 1.0 + aside].map(|aside| (aside * guess).clamp(least, most)))
}

/// The strength at which the straight line through the values near the goal has it, and the standard error of the line there; `None`
/// unless there are values on both sides.
fn line(points: &[Point], goal: f64) -> Option<(f64, f64)> {
    let near: Vec<[f64; 3]> = points
        .iter()
        .filter_map(|p| {
            let value = p.value.filter(|v| (v.value - goal).abs() <= NEAR)?;
            let error = value.error.hypot(CURVED * (value.value - goal).powi(2));
            Some([p.strength, value.value, 1.0 / (error * error).max(1e-12)])
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a straight line with errors of 0.05, by hand: at a distance d from their middle the line's error is
    /// √(σ²/3 + d² σ²/0.02).
    #[test]
    fn lines_have_the_error_of_their_points() {
        let at = |strength: f64| Point { strength, value: Some([strength - 0.5, 0.05].into()) };
        for (goal, place) in [(0.5, 1.0), (0.58, 1.08), (0.43, 0.93)] {
            let (strength, error) = line(&[0.9, 1.0, 1.1].map(at), goal).unwrap();
            let expected = 0.05 * (1.0f64 / 3.0 + (place - 1.0f64).powi(2) / 0.02).sqrt();
            assert!((strength - place).abs() < 1e-9, "{goal}: {strength}");
            assert!((error / expected - 1.0).abs() < 0.03, "{goal}: {error} and not {expected}");
        }
        // On one side alone there is none.
        assert_eq!(line(&[0.9, 1.0, 1.1].map(at), 0.7), None);
    }
}
