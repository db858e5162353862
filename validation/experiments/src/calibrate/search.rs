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
    Corrected(&'a [Polynomial]),
}

/// A density whose run stopped, and why: left out of fits and residuals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failed {
    pub density: f64,
    pub why: String,
}

/// What was measured under one correction.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    /// The points of the densities whose runs came to their end.
    pub points: Vec<Point>,
    /// Which targets these are.
    pub of: Vec<usize>,
    pub failed: Vec<Failed>,
}

impl Batch {
    /// Whether enough densities remain for a straight line, or the only one.
    pub fn usable(&self, asked: usize) -> bool {
        self.points.len() >= asked.min(2)
    }

    fn targets(&self, wish: &Wish) -> Vec<Target> {
        self.of.iter().map(|k| wish.targets[*k]).collect()
    }
}

/// ρ̃′ of the first guess ρ̃ = ρ (Trofimov, Nies and Michels, section IV B).
pub const DUMMY_SLOPE: f64 = 1.05;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Goal {
    /// ⟨ρ̃⟩ = ρ.
    Density,
    Pressure,
}

/// A correction that was tried, and what came out.
#[derive(Debug, Clone, Serialize)]
pub struct Round {
    pub degree: usize,
    pub goal: Goal,
    /// The corrections of each pair (β at α), row-major.
    pub fits: Vec<Fit>,
    /// Largest |⟨ρ̃⟩/ρ − 1|.
    pub density_residual: f64,
    /// Largest |p − p_wanted|/scale.
    pub pressure_residual: f64,
    /// Largest error of a pressure, over the same scale.
    pub pressure_error: f64,
    /// Densities that stopped under it, which the residuals leave out.
    pub failed: Vec<Failed>,
    /// How often it was moved halfway back to the correction before it, because too few densities ran.
    pub halved: usize,
    #[serde(skip)]
    pub batch: Batch,
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

#[derive(Clone, Copy)]
pub struct Wish<'a> {
    /// Target equation of state at the densities asked for.
    pub targets: &'a [Target],
    /// ψ′ of one species; none for mixtures, whose pressures are not fitted.
    pub slope: Option<&'a dyn Fn(f64) -> f64>,
    /// Largest |p − p_wanted|/scale, and largest |⟨ρ̃⟩/ρ − 1| where the goal is the density.
    pub tolerance: f64,
}

/// Fits of each degree to the same goal before the next degree or goal is tried.
const ROUNDS: usize = 3;

/// How often a correction under which too few densities run is moved halfway back.
const HALVINGS: usize = 3;

/// Weight of ⟨ρ̃⟩ = ρ against the pressures in the rounds that are fitted to pressures: lower in every round.
const HOLDS: [f64; ROUNDS] = [0.5, 0.1, 0.02];

/// Degrees that are tried: a mixture's distribution of partial densities is not measured, so means of powers are
/// not known there.
pub const HIGHEST_DEGREE: usize = 3;

/// Looks for corrections from `first`, what was measured with [`Trial::Constant`]. The last round is the one that meets the
/// wish, if it is met. A density that stops is left out of the round. Where too few are left, the correction is moved halfway
/// back to the last one that ran, or to ρ̃ = n; if that does not help either, the rounds so far are all there are.
pub fn search<E>(
    first: Batch,
    wish: &Wish,
    measure: &mut dyn FnMut(Trial) -> Result<Batch, E>,
    told: &mut dyn FnMut(&Round),
) -> Result<Vec<Round>, E> {
    let pairs = first.points.first().map_or(0, |p| p.means.len());
    let asked = wish.targets.len();
    let highest = if pairs == 1 { HIGHEST_DEGREE.min(asked.saturating_sub(1)).max(1) } else { 1 };
    let mut rounds: Vec<Round> = Vec::new();
    let mut batch = first;
    for degree in 1..=highest {
        for goal in [Goal::Density, Goal::Pressure] {
            for hold in HOLDS {
                let points = &batch.points;
                let fits: Option<Vec<Fit>> = match (goal, wish.slope, rounds.last()) {
                    (Goal::Density, ..) => (0..pairs).map(|pair| fit_density(points, pair, degree)).collect(),
                    (Goal::Pressure, Some(slope), Some(last)) if points.len() > degree || asked == 1 => {
                        let start = last.fits[0].polynomial();
                        let targets = batch.targets(wish);
                        fit_pressure(points, &targets, slope, &start, degree, hold).map(|fit| vec![fit])
                    }
                    (Goal::Pressure, ..) => None,
                };
                let Some(mut fits) = fits else { break };
                let mut halved = 0;
                batch = loop {
                    let polynomials: Vec<Polynomial> = fits.iter().map(Fit::polynomial).collect();
                    let batch = measure(Trial::Corrected(&polynomials))?;
                    if batch.usable(asked) {
                        break batch;
                    }
                    if halved == HALVINGS {
                        return Ok(rounds);
                    }
                    halved += 1;
                    let back = |pair: usize| {
                        rounds.last().map_or(Polynomial::identity(), |round| round.fits[pair].polynomial())
                    };
                    fits = fits.iter().enumerate().map(|(pair, fit)| fit.halfway(&back(pair))).collect();
                };
                let round = Round { halved, ..assess(degree, goal, fits, batch.clone(), wish) };
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

fn assess(degree: usize, goal: Goal, fits: Vec<Fit>, batch: Batch, wish: &Wish) -> Round {
    let (points, targets) = (&batch.points, batch.targets(wish));
    // NaN counts as the largest deviation.
    let larger = |worst: f64, x: f64| if x.is_nan() { f64::INFINITY } else { worst.max(x) };
    let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, larger);
    let density_residual = worst(&mut points.iter().flat_map(|p| {
        fits.iter()
            .enumerate()
            .map(|(pair, fit)| (p.corrected(pair, &fit.polynomial()).value / p.own[pair] - 1.0).abs())
    }));
    let both = || points.iter().zip(&targets);
    let pressure_residual = worst(&mut both().map(|(p, t)| ((p.pressure.value - t.wanted) / t.scale).abs()));
    let pressure_error = worst(&mut both().map(|(p, t)| p.pressure.error / t.scale));
    let failed = batch.failed.clone();
    let halved = 0;
    Round { degree, goal, fits, density_residual, pressure_residual, pressure_error, failed, halved, batch }
}
