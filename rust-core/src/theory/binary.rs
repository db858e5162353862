use super::line::{Line, coexisting, negative, unstable};
use super::search::{spaced, turning_point};
use super::{MeanField, TheoryError};

/// Two phases of a binary mixture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompositionBinodal {
    /// Fraction of the first species in each phase, ascending.
    pub composition: [f64; 2],
    /// Total density of each phase.
    pub density: [f64; 2],
    /// Pressure of each phase; both are equal in equilibrium.
    pub pressure: [f64; 2],
    /// Exchange potential `μ_A − μ_B`, equal in both phases.
    pub exchange_potential: f64,
}

/// The quantity that is constant along a line of compositions.
#[derive(Debug, Clone, Copy)]
enum Held {
    Density(f64),
    Pressure(f64),
}

/// Free energy (per volume at fixed density, Gibbs per particle at fixed pressure) against the fraction
/// of the first species.
pub struct CompositionLine<'a> {
    theory: &'a MeanField,
    held: Held,
    /// At fixed pressure, the logarithm of the total density at the points of the grid.
    followed: Vec<f64>,
}

/// Largest magnitude of the logarithm of the ratio of the two species, on the grid.
const REACH: f64 = 30.0;
const STEPS: usize = 1200;

/// Most steps from one composition to the next where no mixture has the pressure: a search through all densities takes
/// a hundredth of a second.
const WIDEST: usize = 32;

/// Relative difference of pressures that differ only by rounding.
const SAME: f64 = 1e-7;

pub(super) fn fractions(u: f64) -> [f64; 2] {
    [1.0 / (1.0 + (-u).exp()), 1.0 / (1.0 + u.exp())]
}

impl<'a> CompositionLine<'a> {
    pub fn at_density(theory: &'a MeanField, density: f64) -> CompositionLine<'a> {
        CompositionLine { theory, held: Held::Density(density), followed: Vec::new() }
    }

    /// Follows the density from the densest equimolar mixture towards both sides.
    pub fn at_pressure(theory: &'a MeanField, pressure: f64) -> CompositionLine<'a> {
        let held = Held::Pressure(pressure);
        let mut line = CompositionLine { theory, held, followed: vec![f64::NAN; STEPS + 1] };
        let middle = STEPS / 2;
        line.followed[middle] = line.densest(middle, pressure);
        line.follow(&(middle..=STEPS).collect::<Vec<_>>(), pressure);
        line.follow(&(0..=middle).rev().collect::<Vec<_>>(), pressure);
        line
    }

    /// `ln ρ` of the densest mixture at a point of the grid; NaN if none has the pressure.
    fn densest(&self, at: usize, pressure: f64) -> f64 {
        let all = self.theory.densities_at_pressure(&fractions(self.grid()[at]), pressure);
        all.last().map_or(f64::NAN, |rho| rho.ln())
    }

    /// Follows the density along these points of the grid from the first of them.
    fn follow(&mut self, way: &[usize], pressure: f64) {
        let grid = self.grid();
        let near = |line: &Self, at: usize, from: usize| {
            line.solve_density(grid[way[at]], line.followed[way[from]], pressure)
        };
        let (mut last, mut gap) = (0, 1);
        while last + gap < way.len() {
            let at = last + gap;
            let found = near(self, at, last).unwrap_or_else(|| self.densest(way[at], pressure));
            self.followed[way[at]] = found;
            if found.is_nan() {
                gap = (2 * gap).min(gap + WIDEST);
                continue;
            }
            // Back into the gap that was crossed.
            for i in (last + 1..at).rev() {
                let Some(found) = near(self, i, i + 1) else { break };
                self.followed[way[i]] = found;
            }
            (last, gap) = (at, 1);
        }
    }

    /// `ln ρ` at the given pressure, by Newton's method from a neighbouring value.
    fn solve_density(&self, u: f64, from: f64, pressure: f64) -> Option<f64> {
        let x = fractions(u);
        let mut log = from;
        for _ in 0..30 {
            let rho = x.map(|x| x * log.exp());
            let slope = log.exp() * self.theory.pressure_slope(&rho);
            let step = (pressure - self.theory.pressure(&rho)) / slope;
            // The step is refused if it is NaN, if it leaves the branch, or if the branch has ended.
            if slope.is_nan() || slope <= 0.0 || step.is_nan() || step.abs() > 1.0 {
                return None;
            }
            log += step;
            if step.abs() < 1e-14 {
                return Some(log);
            }
        }
        Some(log).filter(|_| log.is_finite())
    }

    /// Number densities of both species.
    pub fn densities(&self, u: f64) -> [f64; 2] {
        let x = fractions(u);
        let total = match self.held {
            Held::Density(rho) => rho,
            Held::Pressure(pressure) => {
                let at = ((u + REACH) / (2.0 * REACH) * STEPS as f64).clamp(0.0, STEPS as f64);
                let near = self.followed[at.round() as usize];
                self.solve_density(u, near, pressure).map_or(f64::NAN, f64::exp)
            }
        };
        x.map(|x| x * total)
    }

    fn two_phases(&self) -> Result<CompositionBinodal, TheoryError> {
        let ends = coexisting(self)?;
        let phases = ends.map(|u| self.densities(u));
        let exchange = self.theory.chemical_potentials(&phases[0]);
        Ok(CompositionBinodal {
            composition: ends.map(|u| self.x(u)),
            density: phases.map(|rho| rho[0] + rho[1]),
            pressure: phases.map(|rho| self.theory.pressure(&rho)),
            exchange_potential: exchange[0] - exchange[1],
        })
    }
}

impl Line for CompositionLine<'_> {
    fn x(&self, u: f64) -> f64 {
        fractions(u)[0]
    }

    fn u(&self, x: f64) -> f64 {
        (x / (1.0 - x)).ln()
    }

    fn u_below(&self, end: f64, below: f64) -> f64 {
        let rest = fractions(end)[1] + below;
        ((1.0 - rest) / rest).ln()
    }

    fn curvature(&self, u: f64) -> f64 {
        let [a, b] = self.densities(u);
        let f = self.theory.excess_second_derivatives(&[a, b]);
        let (rho, beta) = (a + b, 1.0 / self.theory.kt);
        // This is c(1 − c) (∂/∂ρ_A − ∂/∂ρ_B)² βf ρ.
        let at_density = 1.0 + beta * a * b / rho * (f[0] - f[1] - f[2] + f[3]);
        match self.held {
            Held::Density(_) => at_density,
            Held::Pressure(_) => {
                // This is det f / (f of the ideal mixture), over ρ ∂p/∂ρ, both without their poles.
                let determinant =
                    (1.0 + beta * a * f[0]) * (1.0 + beta * b * f[3]) - beta * beta * a * b * f[1] * f[2];
                determinant / (beta * self.theory.pressure_slope(&[a, b]))
            }
        }
    }

    fn slope(&self, u: f64) -> f64 {
        let rho = self.densities(u);
        let mu = self.theory.excess_chemical_potentials(&rho);
        let exchange = mu[0] - mu[1] + self.theory.kt * u;
        match self.held {
            Held::Density(total) => total * exchange,
            Held::Pressure(_) => exchange,
        }
    }

    fn intercept(&self, u: f64) -> f64 {
        let rho = self.densities(u);
        let mu = self.theory.excess_chemical_potentials(&rho)[1] + self.theory.kt * rho[1].ln();
        match self.held {
            // The intercept is c ∂g/∂c − g = p − ρ μ_B.
            Held::Density(total) => self.theory.pressure(&rho) - total * mu,
            Held::Pressure(_) => -mu,
        }
    }

    fn grid(&self) -> Vec<f64> {
        spaced(-REACH, REACH, STEPS)
    }

    fn limits(&self) -> [f64; 2] {
        [-600.0, 600.0]
    }
}

impl MeanField {
    /// Every total density at which a fluid of the given composition has pressure `pressure` and is
    /// mechanically stable, `∂p/∂ρ > 0`; ascending. Any number of species.
    pub fn densities_at_pressure(&self, composition: &[f64], pressure: f64) -> Vec<f64> {
        let total: f64 = composition.iter().sum();
        let excess = |rho: f64| {
            let densities: Vec<f64> = composition.iter().map(|x| x / total * rho).collect();
            self.pressure(&densities) - pressure
        };
        let grid = self.density_grid(composition);
        let values: Vec<f64> = grid.iter().map(|rho| excess(*rho)).collect();
        (1..grid.len())
            .filter(|i| values[i - 1] < 0.0 && values[*i] >= 0.0)
            .map(|i| turning_point(grid[i - 1], grid[i], |rho| excess(rho) >= 0.0))
            .collect()
    }

    /// Fractions of the first species between which a binary mixture is unstable, among mixtures of total density
    /// `density`: where `f_αβ` is not positive definite, so between zeros of its determinant. A wave may change composition
    /// and density together there, so the interval is wider than that of `f_AA − 2f_AB + f_BB < 0`, for which the density
    /// is held; both shrink to the same critical point where the mixture is symmetric (Pagonabarraga–Frenkel eq. 23,
    /// `kT_c = ρ(λ − λ_A)`).
    ///
    /// # Errors
    /// Fails for other than two species.
    pub fn composition_spinodal(&self, density: f64) -> Result<Vec<[f64; 2]>, TheoryError> {
        self.require_species(2)?;
        let line = CompositionLine::at_density(self, density);
        let stability = |u: f64| self.smallest_inverse_structure_factor(&line.densities(u), 0.0);
        let regions = negative(&line.grid(), &stability);
        Ok(regions.into_iter().map(|ends| ends.map(|u| line.x(u))).collect())
    }

    /// The unstable fractions among mixtures of one pressure, on the branch that is densest in the equimolar mixture.
    ///
    /// # Errors
    /// Fails for other than two species.
    pub fn composition_spinodal_at_pressure(&self, pressure: f64) -> Result<Vec<[f64; 2]>, TheoryError> {
        self.require_species(2)?;
        let line = CompositionLine::at_pressure(self, pressure);
        Ok(unstable(&line).into_iter().map(|ends| ends.map(|u| line.x(u))).collect())
    }

    /// Two phases of a binary mixture with the same total density, by the common tangent of `f(c)`
    /// (Pagonabarraga–Frenkel sec. III B, "assuming that ρ is constant"). They are in equilibrium if their
    /// pressures are equal too, as in a symmetric mixture; [`MeanField::coexistence`] does not need the assumption.
    ///
    /// # Errors
    /// Fails for other than two species, and with [`TheoryError::NoCoexistence`] or
    /// [`TheoryError::NotInEquilibrium`].
    pub fn composition_binodal(&self, density: f64) -> Result<CompositionBinodal, TheoryError> {
        let found = self.common_tangent(density)?;
        let [p, q] = found.pressure;
        if (p - q).abs() > SAME * (p.abs() + q.abs() + density * self.kt) {
            return Err(TheoryError::NotInEquilibrium { density, pressure: found.pressure });
        }
        Ok(found)
    }

    /// The common tangent of `f(c)` at a total density, for any pressures.
    pub(super) fn common_tangent(&self, density: f64) -> Result<CompositionBinodal, TheoryError> {
        self.require_species(2)?;
        CompositionLine::at_density(self, density).two_phases()
    }

    /// Two phases of a binary mixture with the pressure `pressure` and equal chemical potentials: the common
    /// tangent of the Gibbs free energy per particle, on the branch that is densest in the equimolar mixture.
    ///
    /// # Errors
    /// Fails for other than two species, and with [`TheoryError::NoCoexistence`].
    pub fn composition_binodal_at_pressure(&self, pressure: f64) -> Result<CompositionBinodal, TheoryError> {
        self.require_species(2)?;
        CompositionLine::at_pressure(self, pressure).two_phases()
    }
}
