//! The model file, which describes one fluid for every host.
//!
//! A [`Model`] is a file that has been read and checked; [`Model::at`] applies a temperature and returns a [`Fluid`],
//! which consists of numbers and compiled formulas. The engine, the theory and the exports use the fluid.
//!
//! # Units and signs
//!
//! All units are reduced: lengths in r_c, masses in m, energies in the unit of the host's kT. Densities
//! are number densities. `r_ij = r_i − r_j`, `ê_ij = r_ij / r_ij`, and a positive force along `ê_ij` on
//! `i` is repulsive. Indices of species follow the order of `species`.

#![warn(missing_docs)]

pub mod curve;
pub mod document;
pub mod expression;
pub mod kernel;
pub mod keys;
pub mod pair;
pub mod wall;

mod continuation;
mod file;
mod fluid;
mod number;
mod presets;

pub use continuation::{Bounds, Continuation, Stray, continuation};
pub use file::{KNOWN_FUNCTIONS, Model, Published, Units};
pub use fluid::{ExcessFreeEnergy, Fluid, PairTerm, Polynomial, StatedSlopes, Thermostat, WeightedDensity};
pub use presets::{
    DragWeight, ForceLaw, PresetError, SplinePair, WarrenPair, lucy_mdpd, spline_dpd, warren_ab,
};
