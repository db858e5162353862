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
