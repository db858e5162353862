//! The engine both hosts share: pairs → densities → ψ′ → forces.
//!
//! A host (LAMMPS, or the native runner with its periodic images) owns positions, velocities, tags and
//! ghosts, and calls
//!
//! 1. [`Engine::densities`]: finds pairs, sums local densities, evaluates ψ and its slopes for the
//!    particles it owns;
//! 2. forwards [`Engine::slopes`] from owners to ghosts, [`Engine::slope_width`] numbers each
//!    (nothing, if every ψ is linear);
//! 3. [`Engine::forces`]: conservative, dissipative and random forces, energy and virial.
//!
//! [`mod@reference`] evaluates the same Hamiltonian with none of this machinery.

mod density_pass;
mod domain;
mod error;
mod evaluator;
mod excess;
mod excess_pass;
mod force_pass;
mod images;
pub mod noise;
mod pairs;
mod particles;
mod plan;
pub mod reference;
mod search;
mod settings;
mod sweep;
mod tally;
mod vectors;

pub use domain::{DomainError, PeriodicBox};
pub use error::EngineError;
pub use evaluator::{Engine, PairsOfHost, PassCounts};
pub use images::Images;
pub use pairs::Newton;
pub use particles::{Particles, Step};
pub use plan::Plan;
pub use settings::{Instructions, Precision, Settings};
pub use sweep::{Around, Pool, Sweep, Times, part};
pub use tally::{Tally, Want};

#[cfg(test)]
mod tests;
