//! The iteration: measure, fit, measure again, with polynomials of rising degree.

use super::fit::{Fit, Target, fit_density, fit_pressure};
use super::point::Point;
use psidpd_core::model::Polynomial;
use serde::Serialize;

/// The correction with which a fluid is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trial<'a> {
    /// ρ̃ = ρ, with [`DUMMY_SLOPE`]: at each density a pair force of constant strength.
    Constant,
    /// These polynomials, for each (β at α).
    Corrected(&'a [Polynomial]),
}

/// ρ̃′ of the first guess ρ̃ = ρ (Trofimov, Nies and Michels, section IV B).
pub const DUMMY_SLOPE: f64 = 1.05;

/// What a fit was made to meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Goal {
    /// ⟨ρ̃⟩ = ρ.
    Density,
    /// The wanted pressure.
    Pressure,
}

/// A correction that was tried, and what came out.
#[derive(Debug, Clone, Serialize)]
pub struct Round {
    /// Degree of the polynomials.
    pub degree: usize,
    /// What they were fitted to.
    pub goal: Goal,
    /// For each (β at α), row-major.
    pub fits: Vec<Fit>,
    /// Largest |⟨ρ̃⟩/ρ − 1|.
    pub density_residual: f64,
    /// Largest |p − p_wanted|/scale.
    pub pressure_residual: f64,
    /// Largest error of a pressure, over the same scale.
    pub pressure_error: f64,
    /// What was measured under it.
    #[serde(skip)]
    pub points: Vec<Point>,
}

impl Round {
    /// Whether every pressure is within the tolerance, with error bars of no more than half of it, and, if that
    /// was the goal, every ⟨ρ̃⟩.
    pub fn meets(&self, tolerance: f64) -> bool {
        self.pressure_residual <= tolerance
            && self.pressure_error <= 0.5 * tolerance
            && (self.goal == Goal::Pressure || self.density_residual <= tolerance)
    }
}

/// What is asked for.
#[derive(Clone, Copy)]
pub struct Wish<'a> {
    /// Target equation of state at the densities of the points.
    pub targets: &'a [Target],
    /// ψ′ of one species; none for mixtures, whose pressures are not fitted.
    pub slope: Option<&'a dyn Fn(f64) -> f64>,
    /// Largest |p − p_wanted|/scale, and largest |⟨ρ̃⟩/ρ − 1| where the goal is the density.
    pub tolerance: f64,
}

/// Fits of each degree to the same goal before the next degree or goal is tried.
const ROUNDS: usize = 3;

/// Weight of ⟨ρ̃⟩ = ρ against the pressures in the rounds that are fitted to pressures: lower in every round.
const HOLDS: [f64; ROUNDS] = [0.5, 0.1, 0.02];

/// Degrees that are tried: a mixture's distribution of partial densities is not measured, so means of powers are
/// not known there.
pub const HIGHEST_DEGREE: usize = 3;

/// Looks for corrections from the first `points`, those of [`Trial::Constant`]. The last round is the one
/// that meets the wish, if it is met.
///
/// # Errors
/// Those of `measure`.
pub fn search<E>(
    first: Vec<Point>,
    wish: &Wish,
    measure: &mut dyn FnMut(Trial) -> Result<Vec<Point>, E>,
    told: &mut dyn FnMut(&Round),
) -> Result<Vec<Round>, E> {
    let pairs = first.first().map_or(0, |p| p.means.len());
    let highest = if pairs == 1 { HIGHEST_DEGREE.min(first.len().saturating_sub(1)).max(1) } else { 1 };
    let mut rounds: Vec<Round> = Vec::new();
    let mut points = first;
    for degree in 1..=highest {
        for goal in [Goal::Density, Goal::Pressure] {
            for hold in HOLDS {
                let fits: Option<Vec<Fit>> = match (goal, wish.slope, rounds.last()) {
                    (Goal::Density, ..) => {
                        (0..pairs).map(|pair| fit_density(&points, pair, degree)).collect()
                    }
                    (Goal::Pressure, Some(slope), Some(last)) => {
                        let start = last.fits[0].polynomial();
                        fit_pressure(&points, wish.targets, slope, &start, degree, hold).map(|fit| vec![fit])
                    }
                    (Goal::Pressure, ..) => None,
                };
                let Some(fits) = fits else { break };
                let polynomials: Vec<Polynomial> = fits.iter().map(Fit::polynomial).collect();
                points = measure(Trial::Corrected(&polynomials))?;
                let round = assess(degree, goal, fits, points.clone(), wish);
                told(&round);
                let met = round.meets(wish.tolerance);
                let consistent = round.density_residual <= wish.tolerance;
                rounds.push(round);
                if met {
                    return Ok(rounds);
                }
                if goal == Goal::Density && consistent {
                    break;
                }
            }
        }
    }
    Ok(rounds)
}

fn assess(degree: usize, goal: Goal, fits: Vec<Fit>, points: Vec<Point>, wish: &Wish) -> Round {
    let worst = |values: &mut dyn Iterator<Item = f64>| {
        // NaN counts as the largest deviation.
        values.fold(0.0f64, |worst, x| {
            if x <= worst {
                worst
            } else if x.is_nan() {
                f64::INFINITY
            } else {
                x
            }
        })
    };
    let density_residual = worst(&mut points.iter().flat_map(|p| {
        fits.iter()
            .enumerate()
            .map(|(pair, fit)| (p.corrected(pair, &fit.polynomial()).value / p.own[pair] - 1.0).abs())
    }));
    let both = || points.iter().zip(wish.targets);
    let pressure_residual = worst(&mut both().map(|(p, t)| ((p.pressure.value - t.wanted) / t.scale).abs()));
    let pressure_error = worst(&mut both().map(|(p, t)| p.pressure.error / t.scale));
    Round { degree, goal, fits, density_residual, pressure_residual, pressure_error, points }
}
