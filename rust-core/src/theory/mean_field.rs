use super::TheoryError;
use super::radial::Radial;
use crate::free_energy::{FreeEnergy, Psi};
use crate::model::pair::PairForm;
use crate::model::{Fluid, Polynomial};

/// The mean-field theory of a fluid at one temperature.
///
/// Densities are number densities in the order of the fluid's species. Outside the domain of ψ every
/// result is NaN or infinite.
#[derive(Debug, Clone)]
pub struct MeanField {
    /// Number of dimensions, 2 or 3.
    pub dimensions: usize,
    /// Temperature kT.
    pub kt: f64,
    /// The names of the species.
    pub species: Vec<String>,
    pub(super) free_energy: FreeEnergy,
    /// Self term that is added to the bulk density in variable `v` of `ψ_α`.
    pub(super) shift: Vec<Vec<f64>>,
    /// The variables of `ψ_α` for a particle without neighbours: its corrected densities.
    pub(super) isolated: Vec<Vec<f64>>,
    /// Weight function `w` of each density.
    pub(super) kernels: Vec<Radial>,
    /// Pair potentials `φ`, and the species that they act between.
    pub(super) pairs: Vec<([usize; 2], Radial)>,
    /// Integrals `[φ_αβ]`, row-major and symmetric.
    pub pair_integrals: Vec<f64>,
    /// The longest range of a density or a pair potential, and the shortest.
    pub(super) ranges: [f64; 2],
    /// Whether a density is calibrated so that its mean is the bulk density.
    pub(super) calibrated: bool,
}

impl MeanField {
    /// Derives the theory of `fluid`.
    ///
    /// # Errors
    /// Fails for a pair potential without an integral, and for a free energy too large to be differentiated twice.
    pub fn new(fluid: &Fluid) -> Result<MeanField, TheoryError> {
        let count = fluid.species.len();
        let d = fluid.dimensions;
        let kernels = fluid
            .densities
            .iter()
            .map(|density| {
                let kernel = density.kernel;
                Radial::new(d, kernel.range(), |r| kernel.value(r)).ok_or_else(|| {
                    TheoryError::NotIntegrable(density.name.clone(), "its particles".to_owned())
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut pairs = Vec::new();
        let mut pair_integrals = vec![0.0; count * count];
        for term in &fluid.pairs {
            let [a, b] = term.between;
            let radial = Radial::new(d, term.potential.range(), |r| term.potential.at(r).0)
                .filter(|radial| radial.moment(0).is_finite())
                .ok_or_else(|| {
                    TheoryError::NotIntegrable(fluid.species[a].clone(), fluid.species[b].clone())
                })?;
            add_symmetric(&mut pair_integrals, count, [a, b], radial.moment(0));
            pairs.push((term.between, radial));
        }
        // For each species and variable, from the self term and the correction.
        let of_variables = |of: fn(f64, &Polynomial) -> f64| -> Vec<Vec<f64>> {
            let at = |alpha: usize, v: usize| {
                let density = &fluid.densities[v / count];
                let has_own = density.includes_self && v % count == alpha;
                let own = if has_own { density.kernel.value(0.0) } else { 0.0 };
                of(own, &density.correction[alpha * count + v % count])
            };
            (0..count).map(|alpha| (0..fluid.variables()).map(|v| at(alpha, v)).collect()).collect()
        };
        // A corrected density has the mean ⟨ρ̃⟩ = ρ, with or without self term.
        let shift = of_variables(|own, correction| if correction.is_identity() { own } else { 0.0 });
        let isolated = of_variables(|own, correction| correction.at(own).0);
        let mut ranges = [0.0f64, f64::INFINITY];
        let lengths = fluid.densities.iter().map(|d| d.kernel.range());
        for range in lengths.chain(fluid.pairs.iter().map(|p| p.potential.range())) {
            ranges = [ranges[0].max(range), ranges[1].min(range)];
        }
        if ranges[0] == 0.0 {
            ranges = [1.0, 1.0];
        }
        if let Some(species) = fluid.stated_slopes() {
            return Err(TheoryError::NoFreeEnergy(species.to_owned()));
        }
        let too_large = |alpha: usize| TheoryError::TooLarge(fluid.species[alpha].clone());
        Ok(MeanField {
            dimensions: d,
            kt: fluid.kt,
            species: fluid.species.clone(),
            free_energy: FreeEnergy::new(fluid, MOST_OPERATIONS).map_err(too_large)?,
            shift,
            isolated,
            kernels,
            pairs,
            pair_integrals,
            ranges,
            calibrated: fluid.densities.iter().any(|d| d.correction.iter().any(|c| !c.is_identity())),
        })
    }

    /// `ψ_α` and its derivatives in the bulk; NaN outside its domain.
    pub(super) fn psi(&self, alpha: usize, densities: &[f64]) -> Psi {
        let count = self.species.len();
        let at: Vec<f64> =
            self.shift[alpha].iter().enumerate().map(|(v, shift)| densities[v % count] + shift).collect();
        self.psi_at(alpha, &at)
    }

    pub(super) fn psi_at(&self, alpha: usize, at: &[f64]) -> Psi {
        let mut psi = self.free_energy.at(alpha, at);
        if !psi.value.is_finite() {
            // The derivatives of a logarithm are finite where the logarithm itself is not.
            psi.gradient.fill(f64::NAN);
            psi.hessian.fill(f64::NAN);
        }
        psi
    }

    /// Slopes `∂ψ_α/∂ñ_v` in the bulk, for each of the [`Fluid::variables`], density-major.
    pub fn excess_slopes(&self, alpha: usize, densities: &[f64]) -> Vec<f64> {
        self.psi(alpha, densities).gradient
    }

    /// Excess free energy density `f_ex = Σ_α ρ_α ψ_α(ρ) + ½ Σ_αβ [φ_αβ] ρ_α ρ_β`
    /// (Pagonabarraga–Frenkel eq. 4 in the bulk; Warren eq. 11). A species of density 0 contributes
    /// nothing, even if its ψ is singular.
    pub fn excess_free_energy_density(&self, densities: &[f64]) -> f64 {
        let count = self.species.len();
        let mut f = 0.0;
        for a in (0..count).filter(|a| densities[*a] != 0.0) {
            f += densities[a] * self.psi(a, densities).value;
            for b in 0..count {
                f += 0.5 * self.pair_integrals[a * count + b] * densities[a] * densities[b];
            }
        }
        f
    }

    /// Free energy density `f = f_ex + kT Σ_α ρ_α (ln ρ_α − 1)`; the thermal wavelength is 1.
    pub fn free_energy_density(&self, densities: &[f64]) -> f64 {
        let ideal = |rho: f64| if rho == 0.0 { 0.0 } else { rho * (rho.ln() - 1.0) };
        let ideal: f64 = densities.iter().map(|rho| ideal(*rho)).sum();
        self.kt * ideal + self.excess_free_energy_density(densities)
    }

    /// Excess chemical potentials `∂f_ex/∂ρ_s = ψ_s + Σ_α ρ_α ∂ψ_α/∂ρ_s + Σ_β [φ_sβ] ρ_β`.
    pub fn excess_chemical_potentials(&self, densities: &[f64]) -> Vec<f64> {
        let count = self.species.len();
        let mut mu = vec![0.0; count];
        for alpha in 0..count {
            let psi = self.psi(alpha, densities);
            mu[alpha] += psi.value;
            for (beta, rho) in densities.iter().enumerate() {
                mu[alpha] += self.pair_integrals[alpha * count + beta] * rho;
            }
            if densities[alpha] != 0.0 {
                for (v, slope) in psi.gradient.iter().enumerate() {
                    mu[v % count] += densities[alpha] * slope;
                }
            }
        }
        mu
    }

    /// Chemical potentials `μ_s = kT ln ρ_s + ∂f_ex/∂ρ_s`.
    pub fn chemical_potentials(&self, densities: &[f64]) -> Vec<f64> {
        let mut mu = self.excess_chemical_potentials(densities);
        mu.iter_mut().zip(densities).for_each(|(mu, rho)| *mu += self.kt * rho.ln());
        mu
    }

    /// Pressure `p = Σ_s ρ_s μ_s − f`. The ideal part is `ρkT`, the ψ part
    /// `Σ_α ρ_α Σ_s ρ_s ∂ψ_α/∂ρ_s` and the pair part `½ Σ [φ] ρρ`: for one species
    /// `p = ρkT + ρ²ψ′(ρ) + ½[φ]ρ²` (Pagonabarraga–Frenkel eq. 8; Warren eq. 8), which is also the
    /// virial with `g(r) = 1` (eq. 10).
    pub fn pressure(&self, densities: &[f64]) -> f64 {
        let count = self.species.len();
        let mut p = 0.0;
        for a in (0..count).filter(|a| densities[*a] != 0.0) {
            p += densities[a] * self.kt;
            let psi = self.psi(a, densities);
            let slopes: f64 = psi.gradient.iter().enumerate().map(|(v, g)| densities[v % count] * g).sum();
            p += densities[a] * slopes;
            for b in 0..count {
                p += 0.5 * self.pair_integrals[a * count + b] * densities[a] * densities[b];
            }
        }
        p
    }

    /// Second derivatives `∂²f_ex/∂ρ_s∂ρ_t = ∂ψ_s/∂ρ_t + ∂ψ_t/∂ρ_s + Σ_α ρ_α ∂²ψ_α/∂ρ_s∂ρ_t + [φ_st]`, row-major.
    pub fn excess_second_derivatives(&self, densities: &[f64]) -> Vec<f64> {
        self.interaction_kernel(densities, 0.0)
    }

    /// `f_st = ∂²f/∂ρ_s∂ρ_t`, row-major: [`MeanField::excess_second_derivatives`] and `kT/ρ_s` on the
    /// diagonal. The mixture is locally stable while the matrix is positive definite.
    pub fn second_derivatives(&self, densities: &[f64]) -> Vec<f64> {
        let count = self.species.len();
        let mut f = self.excess_second_derivatives(densities);
        densities.iter().enumerate().for_each(|(s, rho)| f[s * count + s] += self.kt / rho);
        f
    }

    /// `∂p/∂ρ` at fixed temperature and composition, `Σ_st x_s ρ_t f_st`; for one species
    /// `kT + ρ f_ex″`. `1/(ρ ∂p/∂ρ)` is the compressibility.
    pub fn pressure_slope(&self, densities: &[f64]) -> f64 {
        let count = self.species.len();
        let total: f64 = densities.iter().sum();
        let f = self.excess_second_derivatives(densities);
        let mut slope = self.kt;
        for s in (0..count).filter(|s| densities[*s] != 0.0) {
            for t in (0..count).filter(|t| densities[*t] != 0.0) {
                slope += densities[s] / total * densities[t] * f[s * count + t];
            }
        }
        slope
    }

    /// # Errors
    /// Fails for another number of species than `expected`.
    pub(super) fn require_species(&self, expected: usize) -> Result<(), TheoryError> {
        let found = self.species.len();
        if found == expected { Ok(()) } else { Err(TheoryError::Species { expected, found }) }
    }
}

/// Most operations of all second derivatives of one ψ: more take seconds for each state.
const MOST_OPERATIONS: usize = 20_000;

/// Adds to the entries of two species in a symmetric matrix of `count` rows.
pub(super) fn add_symmetric(matrix: &mut [f64], count: usize, [a, b]: [usize; 2], number: f64) {
    matrix[a * count + b] += number;
    if a != b {
        matrix[b * count + a] += number;
    }
}
