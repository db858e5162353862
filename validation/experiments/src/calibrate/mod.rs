//! Trofimov's corrected density ρ̃(n): found by short runs at several densities.
//!
//! Correlations make the mean of the local density, ⟨n⟩, differ from the density ρ, and the pressure from
//! the one that ψ was made for. A polynomial ρ̃(n) with ⟨ρ̃⟩ = ρ repairs both (S. Y. Trofimov, E. L. F. Nies,
//! M. A. J. Michels, J. Chem. Phys. 117, 9383 (2002), eq. 35). ⟨n⟩ depends on ρ̃, so it is found by iteration:
//!
//! 1. ⟨n⟩(ρ) is measured with ρ̃ = ρ and ρ̃′ = 1.05, where the force of every pair has the constant strength
//!    `2 · 1.05 ψ′(ρ)`; if such a fluid cannot run, with ρ̃ = n.
//! 2. A linear ρ̃ is fitted to ρ(⟨n⟩), and the fluid is measured with it, until ⟨ρ̃⟩ = ρ.
//! 3. If a pressure is still further from the wanted one than the tolerance, ρ̃ is fitted to the pressures
//!    (one species only).
//! 4. If this does not meet the tolerance, the same with a quadratic, and with a cubic ρ̃.
//!
//! A density whose run stops is left out, and said; see [`search`].

mod fit;
mod point;
mod search;
mod text;

pub use fit::{Fit, Target, fit_density};
pub use point::Point;
pub use search::{Batch, DUMMY_SLOPE, Failed, Goal, Round, Trial, Wish, search};
pub use text::with_correction;

use crate::ExperimentError;
use crate::run::bulk::{Bulk, Sampling};
use crate::run::{self, Observed};
use psidpd_core::model::{Model, Polynomial};
use psidpd_core::theory::MeanField;
use psidpd_dynamics::run::RunError;
use psidpd_dynamics::scene::Edit;
use psidpd_formats::files::temporary_folder;
use psidpd_observe::Measured;
use serde::Serialize;
use std::cell::RefCell;
use std::path::Path;

#[derive(Debug, Clone)]
pub struct Options {
    pub kt: f64,
    pub densities: Vec<f64>,
    pub composition: Vec<f64>,
    /// Which density, if there are several.
    pub name: Option<String>,
    /// See [`Wish::tolerance`].
    pub tolerance: f64,
    pub sampling: Sampling,
}

#[derive(Debug, Clone, Serialize)]
pub struct Residual {
    pub density: f64,
    pub temperature: Measured,
    /// ⟨n⟩ for each (β at α).
    pub mean: Vec<Measured>,
    /// ⟨ρ̃⟩ for each (β at α).
    pub corrected: Vec<Measured>,
    pub wanted: f64,
    pub pressure: Measured,
    /// |p − p_wanted| over max(|p_wanted|, 0.1 ρ ∂p/∂ρ).
    pub deviation: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct Calibration {
    pub title: String,
    pub kt: f64,
    pub density: String,
    /// The pairs of species of the correction: the density of β felt by α, as `"β|α"`, in the order of the coefficients.
    pub pairs: Vec<String>,
    pub converged: bool,
    pub tolerance: f64,
    pub sampling: Sampling,
    /// The first guess that was measured: `"constant"` or `"identity"`.
    pub first_guess: &'static str,
    /// Every correction that was tried, in order; the last was chosen, or the best if none meets the tolerance.
    pub rounds: Vec<Round>,
    pub chosen: usize,
    /// Densities that stopped under it: residuals and tolerance are about the others.
    pub failed: Vec<Failed>,
    /// Wanted and measured under it.
    pub residuals: Vec<Residual>,
    #[serde(skip)]
    pub text: String,
}

impl Calibration {
    pub fn fits(&self) -> &[Fit] {
        &self.rounds[self.chosen].fits
    }
}

/// Pressures are compared with `max(|p|, SLOPE_SHARE ρ ∂p/∂ρ)`: where p goes through zero, a relative
/// difference of the pressure means nothing, and one of a tenth of the bulk modulus is one of the density.
const SLOPE_SHARE: f64 = 0.1;

/// Runs a fluid and gives what was observed.
type Measure<'a> = &'a dyn Fn(&Bulk) -> Result<Observed, RunError>;

/// Calibrates the model in the file `path`; `command` goes into its comment.
pub fn calibrate(
    path: &Path,
    options: &Options,
    command: &str,
    told: &mut dyn FnMut(&str),
) -> Result<Calibration, ExperimentError> {
    let folder = temporary_folder()?;
    let measure =
        |bulk: &Bulk| run::anew(&bulk.scene(path)?, &folder.path().join("run"), options.sampling.threads);
    calibrate_by(&measure, path, options, command, told)
}

/// Calibrates a model, with the fluid measured by `run`.
fn calibrate_by(
    run: Measure,
    path: &Path,
    options: &Options,
    command: &str,
    told: &mut dyn FnMut(&str),
) -> Result<Calibration, ExperimentError> {
    let model = Model::open(path)?;
    let bench = Bench::new(run, path, &model, options)?;
    let targets = bench.targets()?;
    let told = RefCell::new(told);
    told.borrow_mut()("measuring with rho~ = rho");
    let mut all_failed: Vec<Failed> = Vec::new();
    let mut measure = |trial: Trial| -> Result<Batch, ExperimentError> {
        let batch = bench.measure(trial, *told.borrow_mut())?;
        all_failed.clone_from(&batch.failed);
        Ok(batch)
    };
    let asked = options.densities.len();
    let (mut first_guess, mut first) = ("constant", measure(Trial::Constant)?);
    if !first.usable(asked) {
        told.borrow_mut()("rho~ = rho does not run: measuring with rho~ = n");
        (first_guess, first) = ("identity", measure(Trial::Corrected(&bench.identity()))?);
    }
    let slope = |x: f64| bench.theory.excess_slopes(0, &[x])[0];
    let wish = Wish {
        targets: &targets,
        slope: (bench.species.len() == 1).then_some(&slope as &dyn Fn(f64) -> f64),
        tolerance: options.tolerance,
    };
    let rounds = match first.usable(asked) {
        true => search(first, &wish, &mut measure, &mut |round| told.borrow_mut()(&line(round)))?,
        false => Vec::new(),
    };
    let Some((chosen, converged)) = best_of(&rounds, options.tolerance) else {
        return Err(no_correction(path, options, &all_failed));
    };
    let best = &rounds[chosen];
    let polynomials: Vec<Polynomial> = best.fits.iter().map(|f| rounded(&f.polynomial())).collect();
    let text = bench.corrected(&polynomials, &note(best, converged, options, command))?;
    let species = bench.species;
    Ok(Calibration {
        title: model.title.clone(),
        kt: options.kt,
        pairs: species.iter().flat_map(|a| species.iter().map(move |b| format!("{b}|{a}"))).collect(),
        density: bench.density,
        converged,
        tolerance: options.tolerance,
        sampling: options.sampling,
        first_guess,
        failed: best.failed.clone(),
        residuals: residuals(best, &targets),
        chosen,
        rounds,
        text,
    })
}

/// A model whose correction is sought, and how it is measured.
struct Bench<'a> {
    run: Measure<'a>,
    path: &'a Path,
    options: &'a Options,
    species: &'a [String],
    text: &'a str,
    /// The names of all densities, and of the one that is corrected.
    densities: Vec<String>,
    density: String,
    /// With ψ at the bulk density itself, whatever the file has for a correction or a self term.
    theory: MeanField,
}

impl<'a> Bench<'a> {
    fn new(
        run: Measure<'a>,
        path: &'a Path,
        model: &'a Model,
        options: &'a Options,
    ) -> Result<Bench<'a>, ExperimentError> {
        let densities: Vec<String> = model.at(options.kt)?.densities.iter().map(|d| d.name.clone()).collect();
        let density = match (&options.name, &densities[..]) {
            (Some(name), all) if !all.contains(name) => {
                return Err(ExperimentError::NoSuchDensity(name.clone()));
            }
            (Some(name), _) => name.clone(),
            (None, [one]) => one.clone(),
            (None, []) => return Err(ExperimentError::NoSuchDensity("n".into())),
            (None, several) => return Err(ExperimentError::WhichDensity(several.join(", "))),
        };
        let species = model.species();
        let (shares, count) = (options.composition.len(), species.len());
        if shares != count {
            let message = format!("a composition of {shares} shares for {count} species");
            return Err(ExperimentError::Conditions(message));
        }
        let text = model.source().text();
        let dummy = vec![Polynomial(vec![0.0, DUMMY_SLOPE]); count * count];
        let bulk = Model::parse_in(path, &with_correction(text, &density, species, &dummy, "")?)?;
        let theory = MeanField::new(&bulk.at(options.kt)?)?;
        Ok(Bench { run, path, options, species, text, densities, density, theory })
    }

    fn per_species(&self, total: f64) -> Vec<f64> {
        self.options.composition.iter().map(|share| share * total).collect()
    }

    /// ρ̃ = n for every pair of species.
    fn identity(&self) -> Vec<Polynomial> {
        vec![Polynomial::identity(); self.species.len() * self.species.len()]
    }

    /// The file with a correction, and a comment on it.
    fn corrected(&self, polynomials: &[Polynomial], comment: &str) -> Result<String, ExperimentError> {
        with_correction(self.text, &self.density, self.species, polynomials, comment)
    }

    fn targets(&self) -> Result<Vec<Target>, ExperimentError> {
        let target = |total: &f64| {
            let rho = self.per_species(*total);
            let wanted = self.theory.pressure(&rho);
            let scale = wanted.abs().max(SLOPE_SHARE * (total * self.theory.pressure_slope(&rho)).abs());
            let slopes: f64 = match &rho[..] {
                [rho] => rho * rho * self.theory.excess_slopes(0, &[*rho])[0],
                _ => 0.0,
            };
            let finite = wanted.is_finite() && scale.is_finite() && scale > 0.0;
            finite
                .then_some(Target { wanted, base: wanted - slopes, scale })
                .ok_or(ExperimentError::NoTarget(*total))
        };
        self.options.densities.iter().map(target).collect()
    }

    /// The model that a trial has at the densities `rho`.
    fn model(&self, trial: &Trial, rho: &[f64]) -> Result<Model, ExperimentError> {
        let text = match trial {
            Trial::Corrected(polynomials) => self.corrected(polynomials, "")?,
            Trial::Constant => {
                let of = |n: &String| self.species.iter().map(|s| format!("{n}_{s}")).collect::<Vec<_>>();
                let variables: Vec<String> = self.densities.iter().flat_map(of).collect();
                let slopes = |a| {
                    self.theory.excess_slopes(a, rho).iter().map(|s| DUMMY_SLOPE * s).collect::<Vec<f64>>()
                };
                let slopes: Vec<Vec<f64>> = (0..self.species.len()).map(slopes).collect();
                let identity = self.corrected(&self.identity(), "")?;
                text::with_slopes(&identity, self.species, &variables, &slopes)?
            }
        };
        Ok(Model::parse_in(self.path, &text)?)
    }

    /// Measures a trial at all densities, without those whose run stops.
    fn measure(&self, trial: Trial, told: &mut dyn FnMut(&str)) -> Result<Batch, ExperimentError> {
        let mut batch = Batch::default();
        let Options { kt, sampling, .. } = *self.options;
        let local = format!("{{ density = \"{}\", bins = 1000 }}", self.density);
        let edits = &[Edit::new("observe.local_density", local)];
        for (k, total) in self.options.densities.iter().enumerate() {
            let rho = self.per_species(*total);
            let model = self.model(&trial, &rho)?;
            let bulk = Bulk { model: &model, kt, densities: &rho, edits, sampling };
            match (self.run)(&bulk) {
                Ok(observed) => {
                    batch.points.push(Point::of(&observed, self.species, &rho));
                    batch.of.push(k);
                }
                Err(why) if why.is_stop() => {
                    let failed = Failed { density: *total, why: cause(&why).to_string() };
                    told(&format!("density {total} is left out: {}", failed.why));
                    batch.failed.push(failed);
                }
                Err(other) => return Err(other.into()),
            }
        }
        Ok(batch)
    }
}

/// The round that is chosen, and whether it meets the tolerance: the last if it does, else the one where most densities run, and then
/// where the pressure is nearest. `None` without rounds.
fn best_of(rounds: &[Round], tolerance: f64) -> Option<(usize, bool)> {
    let last = rounds.len().checked_sub(1)?;
    if rounds[last].meets(tolerance) {
        return Some((last, true));
    }
    let better = |a: &Round, b: &Round| {
        (a.failed.len().cmp(&b.failed.len())).then(a.pressure_residual.total_cmp(&b.pressure_residual))
    };
    let (chosen, _) = rounds.iter().enumerate().min_by(|(_, a), (_, b)| better(a, b))?;
    Some((chosen, false))
}

fn no_correction(path: &Path, options: &Options, failed: &[Failed]) -> ExperimentError {
    if failed.is_empty() {
        return ExperimentError::Conditions("too few densities for a fit".into());
    }
    let [low, high] = [options.densities[0], options.densities[options.densities.len() - 1]];
    let each: Vec<String> = failed.iter().map(|f| format!("at {}: {}", f.density, f.why)).collect();
    ExperimentError::NoCorrection { model: path.to_owned(), low, high, failed: each.join("; ") }
}

/// Wanted and measured at the densities of a round.
fn residuals(best: &Round, targets: &[Target]) -> Vec<Residual> {
    let kept = best.batch.points.iter().zip(best.batch.of.iter().map(|k| &targets[*k]));
    let corrected =
        |p: &Point| best.fits.iter().enumerate().map(|(k, fit)| p.corrected(k, &fit.polynomial())).collect();
    let residual = |(p, t): (&Point, &Target)| Residual {
        density: p.total,
        temperature: p.temperature,
        mean: p.means.clone(),
        corrected: corrected(p),
        wanted: t.wanted,
        pressure: p.pressure,
        deviation: (p.pressure.value - t.wanted).abs() / t.scale,
    };
    kept.map(residual).collect()
}

/// Why a run stopped, without the folder of it, which is gone.
fn cause(error: &RunError) -> &RunError {
    match error {
        RunError::Stopped { cause: inner, .. } | RunError::Halted { cause: inner, .. } => cause(inner),
        other => other,
    }
}

/// Drops digits below the accuracy of a calibration.
fn rounded(p: &Polynomial) -> Polynomial {
    let round = |c: f64| {
        let digits = 6 - c.abs().max(1e-12).log10().ceil() as i32;
        let unit = 10f64.powi(digits);
        (c * unit).round() / unit
    };
    Polynomial(p.0.iter().map(|c| round(*c)).collect())
}

fn line(round: &Round) -> String {
    let degree = ["constant", "linear", "quadratic", "cubic"].get(round.degree).unwrap_or(&"");
    let goal = match round.goal {
        Goal::Density => "<rho~> = rho",
        Goal::Pressure => "the pressure",
    };
    let fits: Vec<String> = round.fits.iter().map(shown).collect();
    format!(
        "{degree}, fitted to {goal}: {}; <rho~> within {:.2} %, pressure within {:.2} %",
        fits.join("; "),
        100.0 * round.density_residual,
        100.0 * round.pressure_residual
    )
}

/// A fit for people: `1.54(2) + 1.047(3) n`.
pub fn shown(fit: &Fit) -> String {
    let terms = fit.coefficients.iter().zip(&fit.errors).enumerate().map(|(m, (c, error))| {
        let power = match m {
            0 => String::new(),
            1 => " n".into(),
            m => format!(" n^{m}"),
        };
        match error {
            Some(error) => format!("{c:.4} ± {error:.4}{power}"),
            None => format!("{c:.4}{power}"),
        }
    });
    terms.collect::<Vec<_>>().join(" + ")
}

fn note(round: &Round, converged: bool, options: &Options, command: &str) -> String {
    let range = match &options.densities[..] {
        [one] => format!("density {one}"),
        [first, .., last] => format!("densities {first} to {last}"),
        [] => String::new(),
    };
    let failed: Vec<String> = round.failed.iter().map(|f| f.density.to_string()).collect();
    let without = match &failed[..] {
        [] => String::new(),
        some => format!("\nThe fluid does not run with it at density {}.", some.join(", ")),
    };
    let verdict = if converged { "" } else { ", which misses the requested tolerance" };
    format!(
        "Corrected density, found by\n  {command}\nAt kT = {} and {range} the pressure agrees with the required one within {:.2} \
         %{verdict}.{without}",
        options.kt,
        100.0 * round.pressure_residual
    )
}

pub fn spaced(low: f64, high: f64, points: usize) -> Vec<f64> {
    if low == high || points < 2 {
        return vec![low];
    }
    (0..points).map(|k| low + (high - low) * k as f64 / (points - 1) as f64).collect()
}

#[cfg(test)]
mod tests;
