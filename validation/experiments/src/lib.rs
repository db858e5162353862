//! Experiments: runs that are compared with another code, a paper, theory or each other.
//!
//! An experiment has a fluid ([`fluids`], or a model file), a start ([`start`], or that of a scene), a code ([`code`], with its
//! precision, threads and ranks) and steps. It gives observations: those of a scene ([`run`]), of dumps and tables of LAMMPS
//! ([`lammps`]), or the times of a loop. A verdict holds them to a bound ([`Check`](psidpd_report::Check)) or to a published value
//! ([`papers::Compared`]). A family of experiments has its own list of cases and its own page, in the module of its verb:
//! `psidpd validate` is [`crosscheck`], `psidpd reproduce` is [`papers`], and the others have their names.

pub mod bench;
pub mod calibrate;
pub mod check;
pub mod code;
pub mod crosscheck;
mod error;
mod files;
pub mod fluids;
pub mod hardcases;
mod jobs;
pub mod lammps;
mod machine;
pub mod model;
pub mod papers;
pub mod pareto;
pub mod run;
mod shipped;
pub mod start;
pub mod sweep;
pub mod theory;

pub use error::{ExperimentError, Trouble};

#[cfg(test)]
#[path = "../../dynamics/src/tests/support.rs"]
#[allow(dead_code, reason = "the tests of two crates share it")]
mod test_support;
