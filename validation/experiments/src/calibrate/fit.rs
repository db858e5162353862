//! Fits of the corrected density `ρ̃(n)`, a polynomial, to what runs measured.

use super::point::Point;
use nalgebra::{DMatrix, DVector};
use psidpd_core::model::Polynomial;
use psidpd_observe::least_squares::{least_squares, slopes};
use serde::Serialize;

/// A polynomial with the standard error of each coefficient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Coefficients in ascending powers.
    pub coefficients: Vec<f64>,
    /// One standard deviation of each; none of a coefficient that is not fitted.
    pub errors: Vec<Option<f64>>,
}

impl Fit {
    pub fn polynomial(&self) -> Polynomial {
        Polynomial(self.coefficients.clone())
    }

    /// Halfway to another polynomial, whose coefficients count as known.
    pub fn halfway(&self, other: &Polynomial) -> Fit {
        let middle = |(m, c): (usize, &f64)| 0.5 * (c + other.0.get(m).copied().unwrap_or(0.0));
        Fit {
            coefficients: self.coefficients.iter().enumerate().map(middle).collect(),
            errors: self.errors.iter().map(|error| error.map(|error| 0.5 * error)).collect(),
        }
    }
}

/// The polynomial of `degree` with `⟨ρ̃(n)⟩ = ρ` at every point by least squares, all densities alike:
/// `Σ_m c_m ⟨n^m⟩ = ρ`. With a single point the slope is 1 and the offset is fitted. `None` if there are too few
/// points, or they do not tell the coefficients apart.
///
/// The errors come from those of ⟨n⟩ and from how far the points are from the fit.
pub fn fit_density(points: &[Point], pair: usize, degree: usize) -> Option<Fit> {
    if let [point] = points {
        let n = point.means[pair];
        let coefficients = vec![point.own[pair] - n.value, 1.0];
        return Some(Fit { coefficients, errors: vec![Some(n.error), None] });
    }
    let columns = degree + 1;
    if points.len() < columns {
        return None;
    }
    let x = DMatrix::from_fn(points.len(), columns, |k, m| points[k].moment(pair, m));
    let y = DVector::from_iterator(points.len(), points.iter().map(|p| p.own[pair]));
    // Scale the columns to one size, so that the rank test is meaningful.
    let size: Vec<f64> = (0..columns).map(|m| x.column(m).norm()).collect();
    let scaled = DMatrix::from_fn(points.len(), columns, |k, m| x[(k, m)] / size[m]);
    let inverse = scaled.clone().pseudo_inverse(1e-10).ok()?;
    let c = &inverse * &y;
    let rest = &y - &scaled * &c;
    let coefficients: Vec<f64> = (0..columns).map(|m| c[m] / size[m]).collect();
    if !coefficients.iter().all(|c| c.is_finite()) {
        return None;
    }
    let polynomial = Polynomial(coefficients.clone());
    let freedom = points.len() - columns;
    let noise: Vec<f64> =
        points.iter().map(|p| (polynomial.at(p.means[pair].value).1 * p.means[pair].error).powi(2)).collect();
    // Scatter about the fit beyond the noise, because a polynomial fits only approximately.
    let expected = noise.iter().sum::<f64>() / points.len() as f64;
    let scatter = if freedom > 0 { (rest.norm_squared() / freedom as f64 - expected).max(0.0) } else { 0.0 };
    let errors = (0..columns)
        .map(|m| {
            let share = |k: usize| (inverse[(m, k)] / size[m]).powi(2);
            let variance: f64 = noise.iter().enumerate().map(|(k, noise)| share(k) * (noise + scatter)).sum();
            Some(variance.sqrt())
        })
        .collect();
    Some(Fit { coefficients, errors })
}

/// The values of a target equation of state that are needed to fit `ρ̃` to it, at one density.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    pub wanted: f64,
    /// What ψ does not contribute to it.
    pub base: f64,
    /// The pressure that differences are compared with.
    pub scale: f64,
}

/// The polynomial with the wanted pressures, from `start`: by least squares of `(p − p_wanted)/scale`, with
///
/// ```text
/// p(c) = base + (p_measured − base) · ψ′(ρ̃_c(⟨n⟩)) ρ̃_c′(⟨n⟩) / [ψ′(ρ̃(⟨n⟩)) ρ̃′(⟨n⟩)]
/// ```
///
/// the pressure that another ρ̃ would have if ⟨n⟩ and g(r) stayed as they are. They change a little, so the
/// fluid has to be measured again. `hold` is how much a relative difference of `ρ̃(⟨n⟩)` from ρ counts
/// against one of the pressures.
pub fn fit_pressure(
    points: &[Point],
    targets: &[Target],
    slope: &dyn Fn(f64) -> f64,
    start: &Polynomial,
    degree: usize,
    hold: f64,
) -> Option<Fit> {
    let largest = points.iter().map(|p| p.means[0].value).fold(0.0, f64::max);
    // Coefficients of powers of n over its largest value, which are of like size.
    let unit: Vec<f64> = (0..=degree).map(|m| largest.powi(m as i32).max(1e-12)).collect();
    let polynomial = |c: &[f64]| Polynomial(c.iter().zip(&unit).map(|(c, unit)| c / unit).collect());
    let strength = |polynomial: &Polynomial, n: f64| {
        let (value, derivative) = polynomial.at(n);
        slope(value) * derivative
    };
    let here: Vec<f64> = points.iter().map(|p| strength(start, p.means[0].value)).collect();
    let residuals = |c: &[f64]| {
        let tried = polynomial(c);
        let pressures = points.iter().zip(targets).zip(&here).map(|((p, t), here)| {
            let pressure = t.base + (p.pressure.value - t.base) * strength(&tried, p.means[0].value) / here;
            (pressure - t.wanted) / t.scale
        });
        let holds = points.iter().map(|p| hold * (tried.at(p.means[0].value).0 / p.total - 1.0));
        let all: Vec<f64> = pressures.chain(holds).collect();
        all.iter().all(|x| x.is_finite()).then_some(all)
    };
    let coefficient = |m: usize| start.0.get(m).copied().unwrap_or(0.0);
    let from: Vec<f64> = (0..=degree).map(|m| coefficient(m) * unit[m]).collect();
    let steps = vec![1e-6 * largest; degree + 1];
    let (found, _) = least_squares(&from, &steps, residuals)?;
    let inverse = slopes(&found, &steps, residuals)?.pseudo_inverse(1e-12).ok()?;
    let errors = (0..=degree)
        .map(|m| {
            let variance: f64 = points
                .iter()
                .zip(targets)
                .enumerate()
                .map(|(k, (p, t))| (inverse[(m, k)] / unit[m] * p.pressure.error / t.scale).powi(2))
                .sum();
            Some(variance.sqrt())
        })
        .collect();
    Some(Fit { coefficients: polynomial(&found).0, errors })
}
