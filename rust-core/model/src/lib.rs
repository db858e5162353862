//! The model file: one fluid, every host.
//!
//! A [`Model`] is a file that has been read and checked; [`Model::at`] puts in the temperature and
//! gives a [`Fluid`], which is all numbers and compiled formulas and is what the engine, the theory
//! and the exports work from.
//!
//! # Units and signs
//!
//! Reduced units throughout: lengths in r_c, masses in m, energies in whatever makes kT what the host
//! says. Densities are number densities. `r_ij = r_i − r_j`, `ê_ij = r_ij / r_ij`, and a positive force
//! along `ê_ij` on `i` is repulsive. Per-species indices run in the order of `species`.

#![warn(missing_docs)]

pub mod curve;
pub mod document;
pub mod expression;
pub mod kernel;
pub mod keys;
pub mod pair;

mod file;
mod fluid;
mod presets;

pub use file::{KNOWN_FUNCTIONS, Model, Published, Units};
pub use fluid::{
    Bounds, Continuation, ExcessFreeEnergy, Fluid, PairTerm, Polynomial, StatedSlopes, Thermostat,
    WeightedDensity,
};
pub use presets::{
    ForceLaw, PresetError, SplinePair, WarrenPair, lucy_mdpd, lucy_mdpd_text, spline_dpd, spline_dpd_text,
    warren_ab, warren_ab_text,
};
