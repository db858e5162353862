//! Critical points of binary mixtures, where a homogeneous mixture becomes unstable and the two phases merge.

use super::binary::{CompositionLine, fractions};
use super::line::{Line, negative, smallest};
use super::one_component::change_of_sign;
use super::{MeanField, TheoryError};
use crate::model::Fluid;
use nalgebra::Matrix2;

/// A critical point of a binary mixture of given total density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompositionCritical {
    /// The critical control parameter: kT, or any other parameter of the fluids.
    pub parameter: f64,
    /// Fraction of the first species.
    pub composition: f64,
    /// Critical pressure.
    pub pressure: f64,
    /// The control parameter at which the first mixture of this total density becomes unstable; in a
    /// symmetric mixture it equals `parameter`.
    pub limit: f64,
}

/// First step beyond the limit of stability, relative to the limit; later steps double.
const STEP: f64 = 1e-6;

/// A third derivative below this counts as zero, in units of that of an ideal mixture.
const ZERO: f64 = 1e-3;

/// The ends of an unstable interval of compositions, and the third derivative of f at each along the unstable direction.
#[derive(Clone, Copy)]
struct Ends {
    u: [f64; 2],
    third: [f64; 2],
}

impl Ends {
    /// Whether f decreases into the interval from both ends, as on a spinodal with one phase on each side.
    fn ordinary(&self) -> bool {
        self.third[0] < 0.0 && self.third[1] > 0.0
    }
}

/// The critical point of mixtures of total density `density`, for a family with any control parameter
/// (kT, an interaction strength). There the lowest eigenvalue of `∂²f/∂ρ_α∂ρ_β` is zero, and so is the
/// third-order derivative of f along its eigenvector, in which composition and density change together.
/// No density is fixed, so that a compressible mixture has its true critical point; for a symmetric
/// mixture it is that of `∂²f/∂c²` (Pagonabarraga–Frenkel eq. 23). The mixture must be stable in all
/// compositions at one end of `range` and not at the other.
///
/// # Errors
/// Fails if the fluid cannot be created, does not have two species, or has no such change.
pub fn composition_critical_point(
    fluid: &dyn Fn(f64) -> Result<Fluid, TheoryError>,
    density: f64,
    range: [f64; 2],
) -> Result<CompositionCritical, TheoryError> {
    let none = || TheoryError::NoCriticalPoint(range[0], range[1]);
    let theory = |parameter: f64| -> Result<MeanField, TheoryError> {
        let theory = MeanField::new(&fluid(parameter)?)?;
        theory.require_species(2)?;
        Ok(theory)
    };
    let least = |parameter: f64| -> Result<(f64, f64), TheoryError> {
        let theory = theory(parameter)?;
        let line = CompositionLine::at_density(&theory, density);
        Ok(smallest(&line.grid(), &|u| theory.smallest_inverse_structure_factor(&line.densities(u), 0.0)))
    };
    let limit = change_of_sign(range, &|parameter| Ok(least(parameter)?.1 < 0.0))?;
    let at_limit = least(limit)?.0;
    let found = |parameter: f64, u: f64| -> Result<CompositionCritical, TheoryError> {
        let x = fractions(u);
        let pressure = theory(parameter)?.pressure(&x.map(|x| x * density));
        Ok(CompositionCritical { parameter, composition: x[0], pressure, limit })
    };
    // The steps go to the unstable side, until the third derivatives at both ends are those of an ordinary spinodal.
    let side = if least(limit * (1.0 - STEP))?.1 < 0.0 { -1.0 } else { 1.0 };
    let ends = |parameter: f64, near: [f64; 2]| theory(parameter).map(|theory| theory.ends(density, near));
    let (mut before, mut near, mut step) = (limit, [at_limit; 2], STEP);
    let (inside, mut last) = loop {
        let parameter = limit * (1.0 + side * step);
        if parameter < range[0].min(range[1]) || parameter > range[0].max(range[1]) {
            return Err(none());
        }
        let here = ends(parameter, near)?.ok_or_else(none)?;
        if here.ordinary() {
            break (parameter, here);
        }
        (before, near) = (parameter, here.u);
        step *= 2.0;
    };
    if before == limit {
        return found(limit, at_limit);
    }
    let (mut outside, mut inside) = (before, inside);
    while (inside - outside).abs() > 1e-13 * inside.abs() {
        let middle = 0.5 * (inside + outside);
        if middle == inside || middle == outside {
            break;
        }
        match ends(middle, last.u)?.ok_or_else(none)? {
            here if here.ordinary() => (inside, last) = (middle, here),
            _ => outside = middle,
        }
    }
    let at = usize::from(last.third[1].abs() < last.third[0].abs());
    if last.third[at].abs() > ZERO {
        return Err(none());
    }
    found(inside, last.u[at])
}

impl MeanField {
    /// The unstable interval of compositions that overlaps `near` or is nearest to it.
    fn ends(&self, density: f64, near: [f64; 2]) -> Option<Ends> {
        let line = CompositionLine::at_density(self, density);
        let stability = |u: f64| self.smallest_inverse_structure_factor(&line.densities(u), 0.0);
        let regions = negative(&line.grid(), &stability);
        let gap = |[a, b]: [f64; 2]| (a - near[1]).max(near[0] - b);
        let u = regions.into_iter().min_by(|a, b| gap(*a).total_cmp(&gap(*b)))?;
        let third = u.map(|u| self.third_derivative(line.densities(u)));
        (u.iter().chain(&third).all(|x| x.is_finite())).then_some(Ends { u, third })
    }

    /// `Σ f_αβγ v_α v_β v_γ` over `Σ |v_α|³ kT/ρ_α²`, with `v` the eigenvector of the lowest
    /// eigenvalue, in the direction of more of the first species.
    fn third_derivative(&self, rho: [f64; 2]) -> f64 {
        let s = self.inverse_structure_factor(&rho, 0.0);
        if s.iter().any(|x| !x.is_finite()) {
            return f64::NAN;
        }
        let eigen = Matrix2::from_row_slice(&s).symmetric_eigen();
        let e = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let sign = if e[0] * rho[1].sqrt() >= e[1] * rho[0].sqrt() { 1.0 } else { -1.0 };
        let v = [0, 1].map(|k| sign * e[k] * rho[k].sqrt());
        let reach = 1e-4 * (rho[0] / v[0].abs()).min(rho[1] / v[1].abs());
        let along = |h: f64| {
            let f = self.second_derivatives(&[rho[0] + h * v[0], rho[1] + h * v[1]]);
            v[0] * v[0] * f[0] + v[0] * v[1] * (f[1] + f[2]) + v[1] * v[1] * f[3]
        };
        let ideal: f64 = (0..2).map(|k| v[k].abs().powi(3) / rho[k].powi(2)).sum();
        (along(reach) - along(-reach)) / (2.0 * reach) / (self.kt * ideal)
    }
}
