//! Many-body dissipative particle dynamics from excess free energies: the model file, and the engine
//! that computes forces for both hosts, LAMMPS and the native runner.
//!
//! The Hamiltonian is
//!
//! ```text
//! U = Σ_i ψ_c(i)(ñ_i) + Σ_{i<j} φ_c(i)c(j)(r_ij)
//! ```
//!
//! with `ñ` the weighted (and, if the model says so, corrected) local densities. Forces, energy and virial all come
//! from it; tests compare the engine with the plain evaluation in [`truth`].
//!
//! Data flow: model file → [`model::Model`] → [`model::Fluid`] (at one kT) → [`engine::Plan`] →
//! [`engine::Engine`].

#![warn(missing_docs)]

// Modules shared with the tests in `tests/` import the crate by this name.
#[cfg(test)]
extern crate self as psidpd_core;

pub mod engine;
mod free_energy;
pub mod maximum;
pub mod memory;
pub mod theory;
pub mod truth;

pub use psidpd_model::{self as model, document};
