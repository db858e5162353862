//! Experiments: runs that are compared with another code, a paper, theory or each other.

pub mod bench;
pub mod bulk;
pub mod calibrate;
pub mod check;
pub mod crosscheck;
pub mod from_eos;
pub mod hardcases;
pub mod measure;
pub mod papers;
pub mod pareto;
pub mod sweep;
pub mod theory_page;

#[cfg(test)]
#[path = "../../dynamics/src/test_support.rs"]
#[allow(dead_code, reason = "the tests of two crates share it")]
mod test_support;
