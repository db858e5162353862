//! The loops of the sweep over cells and pairs, compiled for each instruction set and precision.
//!
//! This is a crate of its own because its loops take most of the compile time and change rarely.
//! `psidpd-core` sorts particles, distributes the planes over threads, evaluates ψ, and calls
//! [`compiled`] for each plane; `docs/engine.md` explains all of it with figures.
//!
//! Modules from the lowest level upwards; a file imports from its own module and from those above it in this list:
//!
//! - [`domain`], [`noise`], [`settings`], [`instruction_set`], [`tally`]: definitions that the whole
//!   engine shares.
//! - [`simd`]: vectors of each instruction set; [`vectors`]: loops that the compiler vectorises.
//! - [`ground`]: box geometry, cell grid, fixed-point coordinates, packed particles, tables of terms.
//! - [`cells`]: the particles in the order of cells.
//! - [`pair_search`]: cell ranges, i-clusters and j-clusters, distance filter.
//! - [`pair_batch`]: terms, densities and noise of a batch of pairs, added to accumulators.
//! - [`plane`]: the two passes over the pairs of a plane; ψ is evaluated between them.
//! - [`compiled`]: the passes, compiled for each instruction set and precision.

pub mod cells;
pub mod compiled;
pub mod domain;
pub mod ground;
pub mod instruction_set;
pub mod noise;
pub mod pair_batch;
pub mod pair_search;
pub mod plane;
pub mod settings;
pub mod simd;
pub mod tally;
pub mod vectors;
