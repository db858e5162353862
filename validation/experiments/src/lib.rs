//! Experiments: runs that are compared with another code, a paper, theory or each other.

pub mod bench;
pub mod bulk;
pub mod calibrate;
pub mod check;
pub mod code;
pub mod crosscheck;
mod error;
mod files;
pub mod fluids;
pub mod from_eos;
pub mod hardcases;
mod jobs;
pub mod lammps;
mod machine;
pub mod measure;
mod models;
pub mod papers;
pub mod pareto;
pub mod start;
pub mod sweep;
pub mod theory_page;

pub use error::ExperimentError;

#[cfg(test)]
#[path = "../../dynamics/src/test_support.rs"]
#[allow(dead_code, reason = "the tests of two crates share it")]
mod test_support;
