//! What cargo makes of the core in release mode.

use crate::{root, said};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// Where cargo has put them.
pub struct Engine {
    /// The static library with the functions of `psidpd.h`.
    pub library: PathBuf,
    /// The program that counts of instructions are made with.
    pub instructions: PathBuf,
}

/// Builds the engine in release mode, whatever mode the tests are in, with the features that it has where the whole
/// workspace is tested: there it is built already.
pub fn engine() -> Engine {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--release", "--workspace", "--lib", "--example", "instructions"]);
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
