//! Loops over particles, compiled for the vectors of each instruction set.

pub use psidpd_passes::vectors::{Loop, integer, run, run_best};
