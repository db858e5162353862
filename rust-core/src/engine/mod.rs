//! Computes forces, energies and virials for all hosts.
//!
//! Hosts use [`Engine`]: LAMMPS, the native runner, the C interface. A host passes particles, their surroundings
//! and the results that it [wants](Want), and receives forces. Each file uses only files above it in this list:
//!
//! ```text
//! domain, particles, surroundings, settings    what is given
//! plan           which passes a fluid needs, worked out once from the model
//! excess         ψ and its slopes for blocks of particles; excess_pass for all of them
//! noise          the random number of a pair
//! walls          what matter behind faces of the box adds to densities, energies and forces
//! wall_drag      drag and noise of a particle against that matter
//! wall_room      whether cylinders and spheres of matter fit into a box
//! round_flight   the exact motion beside a cylinder or a sphere under a constant acceleration
//! reflection     what becomes of a particle that meets one in a drift
//! sweep/         pairs from cells → densities → ψ′ → forces, by vector instructions and threads
//! local_energy/  how the energy changes where one particle moves, for Monte Carlo
//! pair_sums/     pairs from a list → densities → ψ′ → forces, in double precision, with values of single particles
//! long_pairs/    pair potentials of rare species with long ranges, apart from the sweep
//! sweep_path     the sweep, special pairs, and long pairs
//! facade         Engine: chooses between the two, or a GPU, for each evaluation, and says which and why (path)
//! ```
//!
//! Both compute the same sums: local densities `n` over pairs, `ψ` and `∂ψ/∂n` of each particle, then the force of
//! each pair `−[∂ψ_i/∂n + ∂ψ_j/∂n] w′ − φ′`, drag and noise. Where ghosts stand for particles of other ranks, the
//! host copies slopes from owners to ghosts in between, so that an evaluation has two halves.

mod components;
mod counts;
mod error;
mod evaluate;
mod excess;
mod excess_pass;
mod exclusions;
mod facade;
mod fault;
mod images;
mod local_energy;
mod long_pairs;
pub mod pair_sums;
mod particles;
mod path;
mod plan;
mod reach;
pub mod reflection;
mod request;
mod round_flight;
mod step;
mod surroundings;
mod sweep;
mod sweep_path;
pub mod thermostat;
pub mod vectors;
mod wall_drag;
mod wall_room;
mod walls;

pub use counts::PassCounts;
pub use error::EngineError;
pub use evaluate::{DevicePath, Evaluate};
pub use facade::{Engine, Pending, Statistics};
#[doc(hidden)]
pub use fault::Fault;
pub use images::Images;
pub use local_energy::{Cells, LocalEnergy, Near, NoEnergy};
pub use particles::Particles;
pub use path::{Path, Reason};
pub use plan::{LinearTerm, Plan};
pub use psidpd_passes::cells::excluded::Mark;
pub use psidpd_passes::domain::{DomainError, PeriodicBox};
pub use psidpd_passes::noise;
pub use psidpd_passes::settings::{Instructions, Precision, Settings};
pub use psidpd_passes::tally::{Tally, Want};
pub use psidpd_threads::{at_once, processors};
pub use reach::{ReachError, check_reach};
pub use request::{Evaluated, Request, Results};
pub use step::Step;
pub use surroundings::{Around, Newton, PairsOfHost, SpecialPair, Surroundings};
pub use sweep::{Pool, Sweep, ThreadCount, Times, part};
pub use wall_drag::WallBath;
pub use wall_room::{Cramped, check_apart, check_room};
pub use walls::{Face, OnWall, Place, faces};

#[cfg(test)]
mod tests;
