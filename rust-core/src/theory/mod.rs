//! Mean-field theory of a fluid: equation of state, stability, coexistence, interfaces.
//!
//! All results derive from one free energy density, the continuum limit of the Hamiltonian with
//! correlations left out (Pagonabarraga and Frenkel, J. Chem. Phys. 115, 5015 (2001), eq. 4 and 24;
//! Warren, Phys. Rev. E 68, 066702 (2003), eq. 8):
//!
//! ```text
//! F[ρ] = ∫ kT Σ_α ρ_α (ln ρ_α − 1) + Σ_α ρ_α ψ_α(w∗ρ) + ½ Σ_αβ ρ_α (φ_αβ∗ρ_β)
//! ```
//!
//! in bulk, [`MeanField`], and its second functional derivative, [`Stability`]. Neglecting correlations
//! is the only approximation of the bulk theory; it is a large one for strong interactions (Warren,
//! sec. III), so that these results guide a simulation and do not replace it. The interfaces add the
//! square-gradient expansion, [`Interface`].
//!
//! # Corrected densities
//!
//! Trofimov et al., J. Chem. Phys. 117, 9383 (2002), calibrate `ρ̃(n)` so that the mean of the corrected density is
//! the bulk density, `⟨ρ̃⟩ = ρ`. The theory assumes an exact calibration: where a model has a correction, ψ is
//! evaluated at the bulk densities themselves, and the correction is not used. Without a correction the variable is
//! `ρ_β`, plus `w(0)` for a particle's own species where the model includes the self term.

mod binary;
mod coexistence;
mod correlations;
mod critical;
mod interface;
mod limit;
mod line;
mod matter;
mod mean_field;
mod one_component;
mod radial;
mod search;
mod singular;
mod stability;

pub use binary::CompositionBinodal;
pub use coexistence::Coexistence;
pub use correlations::{Correlated, Correlations};
pub use critical::{CompositionCritical, composition_critical_point};
pub use interface::Interface;
pub use limit::{NoLimit, Structure, thermodynamic_limit};
pub use matter::{drag_without_slip, local_densities_of_matter};
pub use mean_field::MeanField;
pub use one_component::{Binodal, CriticalPoint, critical_point};
pub use singular::{Singularity, SingularityKind, singular_densities};
pub use stability::Stability;

use crate::document::FileError;

/// Reasons why the theory has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TheoryError {
    /// The model is not valid at the requested temperature.
    #[error(transparent)]
    File(#[from] FileError),
    /// The model states the force of a species, which may have no potential (Warren, Phys. Rev. E 87, 045303 (2013)).
    #[error(
        "species {0} has stated slopes and no excess free energy: mean field has nothing to start from; \
         write psi as a formula of the densities if the force has one"
    )]
    NoFreeEnergy(String),
    /// A derivative of ψ has too many operations.
    #[error("the free energy of species {0} is too large to be differentiated twice")]
    TooLarge(String),
    /// The integral `∫φ` does not exist, or quadrature does not converge.
    #[error("the pair potential between {0} and {1} has no integral: mean field does not apply to it")]
    NotIntegrable(String, String),
    /// The result is defined for another number of species.
    #[error("needs a fluid of {expected} species, this one has {found}")]
    Species {
        /// Number of species that the result requires.
        expected: usize,
        /// Number of species of the fluid.
        found: usize,
    },
    /// Within the limits of the search the fluid never changes from stable to unstable.
    #[error("no critical point for control parameters between {0:?} and {1:?}")]
    NoCriticalPoint(f64, f64),
    /// The fluid is stable everywhere, or a phase has no partner.
    #[error("no two phases coexist")]
    NoCoexistence,
    /// The common tangent at one total density joins phases of different pressure.
    #[error(
        "with the total density held at {density} the two phases have pressures {:.6} and {:.6}: they are not in equilibrium",
        pressure[0],
        pressure[1]
    )]
    NotInEquilibrium {
        /// The total density.
        density: f64,
        /// Pressure of each phase.
        pressure: [f64; 2],
    },
    /// The gradient coefficient is not positive between the two phases, so that the square-gradient
    /// free energy favours interfaces (Pagonabarraga and Frenkel, text after eq. 30).
    #[error("the square-gradient coefficient is {coefficient:.6} at {at:.6}: no stable planar interface")]
    GradientNotPositive {
        /// Density or composition between the phases.
        at: f64,
        /// Gradient coefficient κ at this density or composition.
        coefficient: f64,
    },
}

#[cfg(test)]
mod tests;
