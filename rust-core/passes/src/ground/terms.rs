//! The terms of a fluid as tables of numbers in the precision of the pairs.

use super::species_pairs::SpeciesPairTable;
use crate::simd::Scalar;
use psidpd_model::PairTerm;
use psidpd_model::kernel::KernelKind;

/// All terms between pairs. Tables have an entry for each pair of species, row-major.
#[derive(Debug, Clone, Default)]
pub struct Terms<T> {
    pub species: usize,
    /// The list has at least one entry: without soft repulsion, a term of strength 0. Others are further soft repulsions
    /// between the same species.
    pub soft: Vec<Soft<T>>,
    pub linear: Vec<Linear<T>>,
    pub spline: Vec<Spline<T>>,
    /// Potentials without vector code.
    pub scalar_fallback: Vec<PairTerm>,
    pub thermostat: Option<ThermostatTables<T>>,
    pub passes: Vec<Pass<T>>,
    /// Whether all pairs go to the full pair cache. Only loops compiled for several species check it,
    /// so that it costs nothing with one density and one species.
    pub full_cache: bool,
    /// For each species: 1 where the i-particle is of this species and 0 elsewhere, and the same for the j-particle.
    pub is_species: Vec<[SpeciesPairTable<T>; 2]>,
}

/// The force `a (1 − r/R)`.
#[derive(Debug, Clone)]
pub struct Soft<T> {
    pub strength: SpeciesPairTable<T>,
    pub inverse_range: SpeciesPairTable<T>,
    /// Energy at contact, `½ a R`.
    pub energy: SpeciesPairTable<T>,
}

/// The force `−(c_αβ + c_βα) w′(r)` of a density that every ψ is linear in.
#[derive(Debug, Clone)]
pub struct Linear<T> {
    pub kernel: KernelKind,
    pub inverse_range: T,
    pub force_kernel: KernelKind,
    pub force_inverse_range: T,
    /// The factor of `w′`: `−(c_αβ + c_βα)` times that of the kernel.
    pub force: SpeciesPairTable<T>,
    /// The factor of `w`: `c_αβ + c_βα` times that of the kernel.
    pub energy: SpeciesPairTable<T>,
}

/// The potential `a [A W(r, R_A) − B W(r, R_B)]`.
#[derive(Debug, Clone)]
pub struct Spline<T> {
    pub repulsion: SpeciesPairTable<T>,
    pub attraction: SpeciesPairTable<T>,
    pub repulsion_inverse_range: SpeciesPairTable<T>,
    pub attraction_inverse_range: SpeciesPairTable<T>,
}

/// The force `−γ w_R² (ê·v) + σ w_R ξ dt^{−1/2}`.
#[derive(Debug, Clone)]
pub struct ThermostatTables<T> {
    pub gamma: SpeciesPairTable<T>,
    pub sigma: SpeciesPairTable<T>,
    pub inverse_range: SpeciesPairTable<T>,
    pub exponent: Exponent<T>,
}

/// The exponent of `w_R`.
#[derive(Debug, Clone)]
pub enum Exponent<T> {
    One,
    Two,
    /// So many quarters, from 1 to 16: square roots and products take the place of a power.
    Quarters(u8),
    Any(SpeciesPairTable<T>),
}

/// A density in which some ψ is not linear.
#[derive(Debug, Clone)]
pub struct Pass<T> {
    pub kernel: KernelKind,
    pub inverse_range: T,
    pub value: T,
    pub force_kernel: KernelKind,
    pub force_range: T,
    pub force_inverse_range: T,
    /// Negative factor of `w′`.
    pub force: T,
}

impl<T: Scalar> Terms<T> {
    /// Number of variables of ψ: one for each density pass and species.
    #[inline(always)]
    pub fn variables(&self) -> usize {
        self.passes.len() * self.species
    }

    /// Whether there are terms besides the first soft one, the thermostat and the densities.
    #[inline(always)]
    pub fn has_more(&self) -> bool {
        self.soft.len() > 1
            || !(self.linear.is_empty() && self.spline.is_empty() && self.scalar_fallback.is_empty())
    }
}
