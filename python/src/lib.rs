//! The compiled part of the Python package `psidpd`. The rest of the package is written in Python.
//!
//! Long computations copy the arrays that they get, which other threads may change or free, and release Python's lock.
//! Errors are those of `psidpd.errors`, with the messages of the command line.

mod arrays;
mod engine;
mod errors;
mod lent;
mod live;
mod model;
mod phases;
mod runs;

use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;

#[pymodule]
mod _psidpd {
    #[pymodule_export]
    use super::engine::{Engine, Evaluation};
    #[pymodule_export]
    use super::live::Steps;
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::runs::{estimate, headline_of, read_positions, run_scene, sweep};
    #[pymodule_export]
    use super::{main, version};
}

/// Runs the program `psidpd` with these arguments, the first of them its name, and returns its exit code.
/// `program` is a file that starts it.
#[pyfunction]
fn main(py: Python, program: PathBuf, arguments: Vec<OsString>) -> u8 {
    py.detach(|| psidpd::cli::run(&program, arguments))
}

/// The version of psidpd.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
