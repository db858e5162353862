//! Cargo's release build of the core.

use crate::{root, said};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// The paths of the build results.
pub struct Engine {
    pub library: PathBuf,
    /// The program that the tests count instructions of.
    pub instructions: PathBuf,
}

/// Builds the engine in release mode, whatever the mode of the tests. The features are those of the whole workspace, so that
/// an earlier build of its tests is reused. Two packages are left out, whose libraries the tests do not compile: that of the
/// extension of Python brings 20 crates of its own.
pub fn engine() -> Engine {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--release", "--workspace", "--lib", "--example", "instructions"]);
    build.args(["--exclude", "psidpd-python", "--exclude", "psidpd-lammps-entry"]);
    build.args(["--locked", "--message-format=json-render-diagnostics"]).current_dir(root());
    let output = build.output().expect("cargo runs");
    assert!(output.status.success(), "the core does not build: {}", said(&output));
    let made: Vec<Value> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .filter(|message: &Value| message["reason"] == "compiler-artifact")
        .collect();
    let of = |name: &'static str| made.iter().filter(move |message| message["target"]["name"] == name);
    let library = of("psidpd_c")
        .filter_map(|message| message["filenames"].as_array())
        .flatten()
        .filter_map(Value::as_str)
        .find(|file| file.ends_with(".a"));
    let instructions = of("instructions").find_map(|message| message["executable"].as_str());
    Engine {
        library: library.expect("cargo names the static library").into(),
        instructions: instructions.expect("cargo names the example").into(),
    }
}
