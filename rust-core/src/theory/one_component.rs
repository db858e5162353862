use super::line::{Line, coexisting, smallest, unstable};
use super::{MeanField, TheoryError};
use crate::model::Fluid;

/// Coexisting vapour and liquid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Binodal {
    /// Density of the vapour.
    pub vapour: f64,
    /// Density of the liquid.
    pub liquid: f64,
    /// Pressure of both phases.
    pub pressure: f64,
    /// Chemical potential of both phases.
    pub chemical_potential: f64,
}

/// A critical point of one component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalPoint {
    /// The critical control parameter: kT, or any other parameter of the fluids.
    pub parameter: f64,
    /// Critical density.
    pub density: f64,
    /// Critical pressure.
    pub pressure: f64,
}

/// Free energy density against density; the intercept is the pressure.
pub struct DensityLine<'a> {
    pub theory: &'a MeanField,
    grid: Vec<f64>,
    pole: bool,
}

impl<'a> DensityLine<'a> {
    pub fn new(theory: &'a MeanField) -> DensityLine<'a> {
        let grid: Vec<f64> = theory.density_grid(&[1.0]).iter().map(|rho| rho.ln()).collect();
        let pole = grid.len() != 1201;
        DensityLine { theory, grid, pole }
    }
}

impl Line for DensityLine<'_> {
    fn x(&self, u: f64) -> f64 {
        u.exp()
    }

    fn u(&self, x: f64) -> f64 {
        x.ln()
    }

    fn curvature(&self, u: f64) -> f64 {
        self.theory.pressure_slope(&[u.exp()]) / self.theory.kt
    }

    fn slope(&self, u: f64) -> f64 {
        // ln ρ is more accurate than ρ.
        self.theory.excess_chemical_potentials(&[u.exp()])[0] + self.theory.kt * u
    }

    fn intercept(&self, u: f64) -> f64 {
        self.theory.pressure(&[u.exp()])
    }

    fn grid(&self) -> Vec<f64> {
        self.grid.clone()
    }

    fn limits(&self) -> [f64; 2] {
        let last = self.grid[self.grid.len() - 1];
        [-700.0, if self.pole { last } else { last + 10.0 }]
    }
}

impl MeanField {
    /// The densities between which `∂p/∂ρ < 0`, for one component. The upper end may be infinite (see
    /// [`super::thermodynamic_limit`]).
    ///
    /// # Errors
    /// Fails for more than one species.
    pub fn spinodal(&self) -> Result<Vec<[f64; 2]>, TheoryError> {
        self.require_species(1)?;
        let regions = unstable(&DensityLine::new(self));
        Ok(regions.into_iter().map(|[a, b]| [a.exp(), b.exp()]).collect())
    }

    /// Vapour and liquid of equal pressure and chemical potential, for one component: the first pair in order of density.
    ///
    /// # Errors
    /// Fails for more than one species, and with [`TheoryError::NoCoexistence`].
    pub fn binodal(&self) -> Result<Binodal, TheoryError> {
        self.require_species(1)?;
        let line = DensityLine::new(self);
        let [a, b] = coexisting(&line)?;
        Ok(Binodal {
            vapour: a.exp(),
            liquid: b.exp(),
            // For a thin vapour its own pressure has no cancellation errors.
            pressure: self.pressure(&[a.exp()]),
            chemical_potential: line.slope(a),
        })
    }
}

/// The critical point of a family of one-component fluids, by bisection in its control parameter
/// (usually kT): where the smallest `∂p/∂ρ` over all densities is zero. The fluid must be stable at one
/// end of `range` and not at the other; a first scan of 32 values, logarithmic where it can be, finds
/// the change that is closest to the upper end.
///
/// Pagonabarraga–Frenkel eq. (14)–(16) are the closed form for their van der Waals fluid.
///
/// # Errors
/// Fails if the fluid cannot be created, has more than one species, or has no such change.
pub fn critical_point(
    fluid: &dyn Fn(f64) -> Result<Fluid, TheoryError>,
    range: [f64; 2],
) -> Result<CriticalPoint, TheoryError> {
    // The density at which `β ∂p/∂ρ` is smallest, and that value, which is zero at the critical point.
    let least = |parameter: f64| -> Result<[f64; 2], TheoryError> {
        let theory = MeanField::new(&fluid(parameter)?)?;
        theory.require_species(1)?;
        let line = DensityLine::new(&theory);
        let (u, value) = smallest(&line.grid, &|u| line.curvature(u));
        Ok([u.exp(), value])
    };
    let parameter = change_of_sign(range, &|parameter| Ok(least(parameter)?[1] < 0.0))?;
    let density = least(parameter)?[0];
    let pressure = MeanField::new(&fluid(parameter)?)?.pressure(&[density]);
    Ok(CriticalPoint { parameter, density, pressure })
}

/// The control parameter nearest to the upper end of `range` where `unstable` changes.
pub fn change_of_sign(
    range: [f64; 2],
    unstable: &dyn Fn(f64) -> Result<bool, TheoryError>,
) -> Result<f64, TheoryError> {
    let [low, high] = range;
    let steps = 32;
    let at = |i: usize| {
        let t = i as f64 / steps as f64;
        if i == steps {
            high
        } else if low > 0.0 && high > 0.0 {
            low * (high / low).powf(t)
        } else {
            low + (high - low) * t
        }
    };
    let upper = unstable(high)?;
    for i in (0..steps).rev() {
        if unstable(at(i))? == upper {
            continue;
        }
        let (mut a, mut b) = (at(i), at(i + 1));
        while (b - a).abs() > 1e-14 * (a.abs() + b.abs()) {
            let middle = 0.5 * (a + b);
            if middle == a || middle == b {
                break;
            }
            if unstable(middle)? == upper {
                b = middle;
            } else {
                a = middle;
            }
        }
        return Ok(0.5 * (a + b));
    }
    Err(TheoryError::NoCriticalPoint(low, high))
}
