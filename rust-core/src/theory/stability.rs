use super::MeanField;
use super::mean_field::add_symmetric;
use super::search::{minimum, spaced};
use nalgebra::DMatrix;

/// Whether a homogeneous fluid is stable against waves of density and composition.
///
/// The fields derive from the smallest eigenvalue of `S(k)⁻¹`, see [`MeanField::inverse_structure_factor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability {
    /// Whether the eigenvalue is positive at every `k`; false also where ψ is singular.
    pub stable: bool,
    /// Whether the eigenvalue is not positive as `k → 0`: inside the spinodal the fluid separates into phases.
    pub spinodal: bool,
    /// The wave number of the smallest eigenvalue, if that is not `k = 0` and the eigenvalue is below 1, its
    /// value for an ideal gas and at `k → ∞`. In a stable fluid this is the main peak of the structure
    /// factor; in an unstable one it is the wavelength `2π/k*` at which the fluid clusters or freezes.
    pub k_star: Option<f64>,
    /// The smallest eigenvalue over `k`, including the limit 1 at `k → ∞`.
    pub min_inverse_s: f64,
}

impl MeanField {
    /// `C_st(k) = Σ_d ŵ_d (∂ψ_s/∂x_dt + ∂ψ_t/∂x_ds) + Σ_α ρ_α Σ_dd′ ŵ_d ŵ_d′ ∂²ψ_α/∂x_ds∂x_d′t + φ̂_st`,
    /// the second functional derivative of the excess free energy; row-major.
    pub(super) fn interaction_kernel(&self, densities: &[f64], k: f64) -> Vec<f64> {
        let count = self.species.len();
        let w: Vec<f64> = self.kernels.iter().map(|w| if k == 0.0 { 1.0 } else { w.transform(k) }).collect();
        let mut c = vec![0.0; count * count];
        for alpha in 0..count {
            let psi = self.psi(alpha, densities);
            for (u, slope) in psi.gradient.iter().enumerate() {
                let (d, s) = (u / count, u % count);
                c[alpha * count + s] += w[d] * slope;
                c[s * count + alpha] += w[d] * slope;
            }
            if densities[alpha] == 0.0 {
                continue;
            }
            let n = psi.gradient.len();
            for u in 0..n {
                for v in 0..n {
                    let weight = w[u / count] * w[v / count];
                    c[(u % count) * count + v % count] += densities[alpha] * weight * psi.hessian[u * n + v];
                }
            }
        }
        for (between, phi) in &self.pairs {
            add_symmetric(&mut c, count, *between, phi.transform(k));
        }
        c
    }

    /// The inverse of the matrix of partial structure factors, normalised so that it is the unit matrix
    /// for an ideal gas: `S⁻¹_st(k) = δ_st + β √(ρ_s ρ_t) C_st(k)`, row-major. For one species
    /// `S(k)⁻¹ = 1 + βρ[φ̂(k) + 2ψ′ŵ(k) + ρψ″ŵ(k)²]`, whose limit at `k → 0` is `β ∂p/∂ρ`.
    ///
    /// This is the second functional derivative of the free energy of [the module](super), in
    /// the random-phase approximation.
    pub fn inverse_structure_factor(&self, densities: &[f64], k: f64) -> Vec<f64> {
        let count = self.species.len();
        let mut s = self.interaction_kernel(densities, k);
        for a in 0..count {
            for b in 0..count {
                let weight = (densities[a] * densities[b]).sqrt() / self.kt;
                let entry = &mut s[a * count + b];
                // A species of density 0 is an ideal gas.
                *entry = if weight == 0.0 { 0.0 } else { *entry * weight };
                if a == b {
                    *entry += 1.0;
                }
            }
        }
        s
    }

    /// The smallest eigenvalue of [`MeanField::inverse_structure_factor`]; NaN where ψ is singular.
    pub fn smallest_inverse_structure_factor(&self, densities: &[f64], k: f64) -> f64 {
        let count = self.species.len();
        let s = self.inverse_structure_factor(densities, k);
        match s.as_slice() {
            [one] => *one,
            all if all.iter().all(|x| x.is_finite()) => {
                DMatrix::from_row_slice(count, count, all).symmetric_eigenvalues().min()
            }
            _ => f64::NAN,
        }
    }

    /// Scans `S(k)⁻¹` for `k` from 0 to `60` over the shortest range in the model.
    pub fn stability(&self, densities: &[f64]) -> Stability {
        let value = |k: f64| self.smallest_inverse_structure_factor(densities, k);
        // The transforms oscillate with the longest range, and decay with the shortest.
        let high = 60.0 / self.ranges[1];
        let count = (high * self.ranges[0] / 0.25).ceil().clamp(240.0, 4000.0) as usize;
        let ks = spaced(0.0, high, count);
        let values: Vec<f64> = ks.iter().map(|k| value(*k)).collect();
        let zero = values[0];
        // As k → ∞ interactions vanish, and the value is 1.
        let (mut k_star, mut smallest) = (0.0, zero.min(1.0));
        for i in 1..count {
            if values[i] <= values[i - 1] && values[i] <= values[i + 1] {
                let (k, refined) = minimum(ks[i - 1], ks[i + 1], value);
                // A ripple of rounding errors is no minimum.
                if refined < smallest - 1e-12 * (1.0 + smallest.abs()) {
                    (k_star, smallest) = (k, refined);
                }
            }
        }
        Stability {
            stable: smallest > 0.0 && zero > 0.0,
            spinodal: zero.is_nan() || zero <= 0.0,
            k_star: (k_star > 0.0).then_some(k_star),
            min_inverse_s: smallest,
        }
    }
}
