//! Two phases of a binary mixture in equilibrium, with any densities.

use super::search::{minimum, spaced};
use super::{MeanField, TheoryError};
use nalgebra::{Matrix4, Vector4};
use std::iter;

/// Two phases with equal pressure and equal chemical potentials of every species.
#[derive(Debug, Clone, PartialEq)]
pub struct Coexistence {
    /// Number densities of the two species in each phase; the first phase has the smaller fraction of the first species.
    pub densities: [[f64; 2]; 2],
    /// Pressure of both phases.
    pub pressure: f64,
    /// Chemical potential of each species, in both phases.
    pub chemical_potentials: [f64; 2],
    /// The fraction of the volume in the first phase.
    pub share: f64,
    /// Densities of a phase that is more stable than both at these potentials, if one was found: then both are metastable.
    pub more_stable: Option<[f64; 2]>,
}

/// Most steps of Newton's method, and the largest change of the logarithm of a density in one.
const STEPS: usize = 200;
const LARGEST: f64 = 0.5;

/// Phases whose logarithms of densities differ by less than this are one phase.
const APART: f64 = 1e-5;

impl Coexistence {
    /// Fraction of the first species in each phase.
    pub fn composition(&self) -> [f64; 2] {
        self.densities.map(|[a, b]| a / (a + b))
    }

    /// Total density of each phase.
    pub fn density(&self) -> [f64; 2] {
        self.densities.map(|[a, b]| a + b)
    }
}

impl MeanField {
    /// The two phases that a binary mixture of number densities `overall` separates into: both have equal
    /// chemical potentials of each species and equal pressure, and their volumes add up to the overall
    /// densities. Neither density nor pressure is fixed, so that the result holds for compressible mixtures.
    ///
    /// Each phase is stable by itself. A grid of compositions and densities is searched for a more stable third phase.
    ///
    /// # Errors
    /// Fails for other than two species, and with [`TheoryError::NoCoexistence`].
    pub fn coexistence(&self, overall: [f64; 2]) -> Result<Coexistence, TheoryError> {
        self.require_species(2)?;
        let total: f64 = overall.iter().sum();
        let of_fraction = |c: f64, rho: f64| [c * rho, (1.0 - c) * rho];
        let held = || {
            let found = self.common_tangent(total).ok()?;
            Some(found.composition.map(|c| of_fraction(c, total)))
        };
        let of_pressure = || {
            let found = self.composition_binodal_at_pressure(self.pressure(&overall)).ok()?;
            Some([0, 1].map(|k| of_fraction(found.composition[k], found.density[k])))
        };
        // Newton's method starts from the mixture itself, with phases that differ in composition, in density, or in both.
        let ways = [[1.0, -1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let apart = ways.iter().flat_map(|way| {
            let phase = move |distance: f64| [0, 1].map(|k| overall[k] * (distance * way[k]).exp());
            [0.5, 1.5, 3.0].map(|distance| [phase(-distance), phase(distance)])
        });
        let starts = iter::once_with(held).chain(iter::once_with(of_pressure)).flatten().chain(apart);
        let mut found = starts.filter_map(|start| self.settle(overall, start));
        let first = found.next().ok_or(TheoryError::NoCoexistence)?;
        if first.more_stable.is_none() {
            return Ok(first);
        }
        Ok(found.find(|other| other.more_stable.is_none()).unwrap_or(first))
    }

    /// Newton's method in the logarithms of the four densities.
    pub(super) fn settle(&self, overall: [f64; 2], start: [[f64; 2]; 2]) -> Option<Coexistence> {
        let total = overall[0] + overall[1];
        let mut x = Vector4::from_iterator(start.iter().flatten().map(|rho| rho.ln()));
        let mut settled = false;
        for _ in 0..STEPS {
            let rho = [[x[0].exp(), x[1].exp()], [x[2].exp(), x[3].exp()]];
            let unit = self.kt * total;
            let mu = rho.map(|rho| self.chemical_potentials(&rho));
            let second = rho.map(|rho| self.second_derivatives(&rho));
            // The distance of the overall densities from the line between the two phases.
            let cross = |a: [f64; 2], b: [f64; 2]| (a[0] * b[1] - a[1] * b[0]) / (total * total);
            let less = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
            let away = cross(less(overall, rho[0]), less(rho[1], rho[0]));
            let rest = Vector4::new(
                (mu[0][0] - mu[1][0]) / self.kt,
                (mu[0][1] - mu[1][1]) / self.kt,
                (self.pressure(&rho[0]) - self.pressure(&rho[1])) / unit,
                away,
            );
            let slopes = Matrix4::from_fn(|row, column| {
                let (phase, s) = (column / 2, column % 2);
                let sign = if phase == 0 { 1.0 } else { -1.0 };
                let f = |t: usize| second[phase][2 * t + s];
                let slope = match row {
                    0 | 1 => sign * f(row) / self.kt,
                    2 => sign * (rho[phase][0] * f(0) + rho[phase][1] * f(1)) / unit,
                    _ => {
                        let axis = if s == 0 { [1.0, 0.0] } else { [0.0, 1.0] };
                        // Derivatives of (ρ − ρ₁)×(ρ₂ − ρ₁) with respect to ρ₁ and ρ₂.
                        match phase {
                            0 => -cross(axis, less(rho[1], overall)),
                            _ => cross(less(overall, rho[0]), axis),
                        }
                    }
                };
                slope * rho[phase][s]
            });
            let step = slopes.lu().solve(&rest).filter(|step| step.iter().all(|s| s.is_finite()))?;
            let largest = step.amax();
            x -= step * (LARGEST / largest).min(1.0);
            if largest < 1e-11 {
                settled = true;
                break;
            }
        }
        let apart = (x[0] - x[2]).abs().max((x[1] - x[3]).abs());
        if !settled || apart < APART {
            return None;
        }
        let mut densities = [[x[0].exp(), x[1].exp()], [x[2].exp(), x[3].exp()]];
        let fraction = |rho: [f64; 2]| rho[0] / (rho[0] + rho[1]);
        if fraction(densities[0]) > fraction(densities[1]) {
            densities.swap(0, 1);
        }
        let stable = densities.iter().all(|rho| self.smallest_inverse_structure_factor(rho, 0.0) > 0.0);
        let [first, second] = densities;
        // The fraction follows from the species in which the phases differ more.
        let s = usize::from((first[1] - second[1]).abs() > (first[0] - second[0]).abs());
        let share = (second[s] - overall[s]) / (second[s] - first[s]);
        if !stable || !(0.0..=1.0).contains(&share) {
            return None;
        }
        let mu = self.chemical_potentials(&first);
        let found = Coexistence {
            densities,
            pressure: self.pressure(&first),
            chemical_potentials: [mu[0], mu[1]],
            share,
            more_stable: None,
        };
        Some(Coexistence { more_stable: self.more_stable(&found), ..found })
    }

    /// The densities at which `f − Σ μρ` is lowest, if it is lower than `−p`.
    fn more_stable(&self, phases: &Coexistence) -> Option<[f64; 2]> {
        let mu = phases.chemical_potentials;
        let at = |u: f64, log: f64| {
            let (c, rho) = (1.0 / (1.0 + (-u).exp()), log.exp());
            [c * rho, (1.0 - c) * rho]
        };
        let height = |u: f64, log: f64| {
            let rho = at(u, log);
            self.free_energy_density(&rho) - mu[0] * rho[0] - mu[1] * rho[1] + phases.pressure
        };
        let [first, second] = phases.density();
        let scale = first.max(second) * self.kt + phases.pressure.abs();
        let mut best = (-1e-6 * scale, None);
        let logs = spaced((1e-3 * first.min(second)).ln(), (3.0 * first.max(second)).ln(), 160);
        for u in spaced(-15.0, 15.0, 60) {
            let heights: Vec<f64> = logs.iter().map(|log| height(u, *log)).collect();
            let lowest = (1..logs.len().saturating_sub(1))
                .filter(|i| heights[*i].is_finite())
                .min_by(|i, j| heights[*i].total_cmp(&heights[*j]));
            let Some(i) = lowest else { continue };
            let (log, value) = minimum(logs[i - 1], logs[i + 1], |log| height(u, log));
            if value < best.0 {
                best = (value, Some(at(u, log)));
            }
        }
        best.1
    }
}
