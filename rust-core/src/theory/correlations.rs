use super::search::turning_point;
use super::{MeanField, TheoryError};
use std::f64::consts::{PI, TAU};

/// Corrections to mean field in first order: the random-phase approximation of one component.
///
/// Mean field sets `g(r) = 1`, so that the mean local density is `ρ`. Here `g = 1 + h` with `ρĥ = S −
/// 1` and `S(k)⁻¹ = 1 + βρ[φ̂ + 2ψ′ŵ + ρψ″ŵ²]`, where ψ is taken at the mean local density that follows
/// from it, `⟨n⟩ = ρ(1 + ∫w h)`, and the pressure is the virial
///
/// ```text
/// p = ρkT − (ρ²/2d) ∫ r φ′ g − (ρ²/d) ψ′(⟨n⟩) ∫ r w′ g
/// ```
///
/// without the fluctuations of `n`. For soft repulsive fluids ⟨n⟩ is accurate to a tenth. The pressure
/// is an estimate: for strong many-body forces it is as much too low as mean field is too high.
#[derive(Debug, Clone)]
pub struct Correlations<'a> {
    theory: &'a MeanField,
    /// Integration measure `k^{d−1} dk` over `(2π)^d`, with the surface of the unit sphere.
    measure: Vec<f64>,
    /// Transforms `ŵ` and `ŵ + kŵ′/d` of each density.
    kernels: Vec<[Vec<f64>; 2]>,
    /// The Fourier transforms of the sum of all pair potentials.
    pairs: [Vec<f64>; 2],
}

/// A fluid with correlations.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlated {
    /// Mean local density ⟨n⟩ of each density, without the self term.
    pub mean_density: Vec<f64>,
    /// Pressure from the virial.
    pub pressure: f64,
}

impl MeanField {
    /// The correlations of one component. `None` if the model has a calibrated density, which includes them.
    ///
    /// # Errors
    /// Fails for more than one species.
    pub fn correlations(&self) -> Result<Option<Correlations<'_>>, TheoryError> {
        self.require_species(1)?;
        Ok((!self.calibrated).then(|| Correlations::new(self)))
    }
}

impl<'a> Correlations<'a> {
    fn new(theory: &'a MeanField) -> Correlations<'a> {
        let d = theory.dimensions as f64;
        let step = 0.1 / theory.ranges[0];
        let count = (60.0 / theory.ranges[1] / step).ceil().clamp(400.0, 4000.0) as usize;
        let k = |i: usize| (i as f64 + 0.5) * step;
        let sphere = if theory.dimensions == 3 { 4.0 * PI } else { TAU };
        let measure = (0..count).map(|i| sphere * k(i).powf(d - 1.0) * step / TAU.powf(d)).collect();
        let tabulate = |transform: &dyn Fn(f64) -> f64| -> [Vec<f64>; 2] {
            // The transform is an even function of k, so that the table extends to the left.
            let table: Vec<f64> = (0..=count).map(|i| transform(k(i))).collect();
            let slope = |i: usize| (table[i + 1] - table[i.max(1) - 1]) / (2.0 * step);
            let moment = (0..count).map(|i| table[i] + k(i) * slope(i) / d).collect();
            [table[..count].to_vec(), moment]
        };
        Correlations {
            measure,
            kernels: theory.kernels.iter().map(|w| tabulate(&|k| w.transform(k))).collect(),
            pairs: tabulate(&|k| theory.pairs.iter().map(|(_, phi)| phi.transform(k)).sum()),
            theory,
        }
    }

    /// The fluid at a density; `None` if it is unstable against waves, or ψ is singular.
    pub fn at(&self, density: f64) -> Option<Correlated> {
        let shift = &self.theory.shift[0];
        let count = self.kernels.len();
        let mut n = vec![density; count];
        let over = |values: &[f64], h: &[f64]| -> f64 {
            values.iter().zip(h).zip(&self.measure).map(|((v, h), m)| v * h * m).sum()
        };
        for _ in 0..500 {
            let at: Vec<f64> = n.iter().zip(shift).map(|(n, s)| n + s).collect();
            let psi = self.theory.psi_at(0, &at);
            // The values of S − 1 at every k.
            let h: Option<Vec<f64>> = (0..self.measure.len())
                .map(|i| {
                    let mut c = self.pairs[0][i];
                    for u in 0..count {
                        let w = self.kernels[u][0][i];
                        c += 2.0 * psi.gradient[u] * w;
                        for v in 0..count {
                            c += density * psi.hessian[u * count + v] * w * self.kernels[v][0][i];
                        }
                    }
                    let inverse = 1.0 + density * c / self.theory.kt;
                    (inverse > 0.0).then(|| 1.0 / inverse - 1.0)
                })
                .collect();
            let h = h?;
            let next: Vec<f64> = self.kernels.iter().map(|w| density + over(&w[0], &h)).collect();
            let change = n.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            n.iter_mut().zip(&next).for_each(|(n, next)| *n += 0.5 * (next - *n));
            if change.is_nan() || n.iter().any(|n| *n <= 0.0) {
                return None;
            }
            if change < 1e-9 * density {
                let integral = self.theory.pair_integrals[0];
                let mut pressure = density * self.theory.kt + 0.5 * integral * density * density;
                pressure += 0.5 * density * over(&self.pairs[1], &h);
                for (u, w) in self.kernels.iter().enumerate() {
                    pressure += psi.gradient[u] * density * (density + over(&w[1], &h));
                }
                return Some(Correlated { mean_density: n, pressure });
            }
        }
        None
    }

    /// The highest density in `range` at which the pressure rises through zero: this is about the
    /// density of a liquid with a thin vapour.
    pub fn zero_pressure_density(&self, range: [f64; 2]) -> Option<f64> {
        let pressure = |rho: f64| self.at(rho).map_or(f64::NAN, |c| c.pressure);
        let grid = super::search::spaced(range[0], range[1], 60);
        let values: Vec<f64> = grid.iter().map(|rho| pressure(*rho)).collect();
        let k = (0..60).rev().find(|k| values[*k] < 0.0 && values[k + 1] >= 0.0)?;
        Some(turning_point(grid[k], grid[k + 1], |rho| pressure(rho) > 0.0))
    }
}
