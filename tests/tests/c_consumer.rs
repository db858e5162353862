//! Compiles a program against `psidpd.h` as C and as C++, and compares its output with the reference evaluation.

#![cfg(unix)]

use psidpd_core::engine::{PeriodicBox, Step};
use psidpd_core::model::{ForceLaw, WarrenPair, warren_ab};
use psidpd_core::truth;
use psidpd_tests::{engine, root};
use std::collections::BTreeMap;
use std::env;
use std::path::Path;
use std::process::{Command, Output};

/// Runs a command; a failure shows all its output.
fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// The native libraries that a static library of Rust needs: psidpd-c-api adds none.
fn native_libraries(scratch: &Path) -> Vec<String> {
    let source = scratch.join("empty.rs");
    std::fs::write(&source, "").unwrap();
    let output = run(Command::new(env::var_os("RUSTC").unwrap_or("rustc".into()))
        .args(["--crate-type", "staticlib", "--print", "native-static-libs", "--color", "never", "-o"])
        .arg(scratch.join("empty.a"))
        .arg(&source)
        // The toolchain is chosen by this folder.
        .current_dir(root()));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let native = told.lines().find_map(|line| line.split_once("native-static-libs:"));
    let (_, native) = native.unwrap_or_else(|| panic!("no native libraries in: {told}"));
    native.split_whitespace().map(str::to_owned).collect()
}

/// Numbers by the name at the start of their line.
fn parse(text: &str) -> BTreeMap<String, Vec<f64>> {
    text.lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            let name = words.next()?.to_owned();
            Some((name, words.map(str::parse).collect::<Result<_, _>>().ok()?))
        })
        .collect()
}

fn vectors(flat: &[f64]) -> Vec<[f64; 3]> {
    flat.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect()
}

fn assert_close(found: &[f64], expected: impl IntoIterator<Item = f64>, what: &str) {
    let expected: Vec<f64> = expected.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(1.0f64, |most, e| most.max(e.abs()));
    for (f, e) in found.iter().zip(&expected) {
        assert!((f - e).abs() <= 1e-12 * scale, "{what}: {f} against {e}");
    }
}

fn check_against_reference(printed: &BTreeMap<String, Vec<f64>>) {
    let pair = WarrenPair { a: -40.0, b: 25.0, gamma: 4.5, rc: 1.0, rd: 0.75, weight: None };
    let model = warren_ab(&["F".to_owned()], &[Some(pair)], 3, ForceLaw::Conservative).unwrap();
    let fluid = model.at(1.0).unwrap();
    let lengths = [printed["box"][0], printed["box"][1], printed["box"][2]];
    let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true; 3]).unwrap();
    let (x, v) = (vectors(&printed["x"]), vectors(&printed["v"]));
    let species = vec![0; x.len()];
    let tag: Vec<i32> = (1..=x.len() as i32).collect();
    let step = Step { seed: 1 << 40, number: 77, dt: 0.01 };
    let truth = truth::conservative(&fluid, &x, &species, &domain).unwrap();
    let (thermal, thermal_virial) = truth::drag_and_noise(&fluid, &x, &v, &tag, &species, &domain, step);
    // In an infinite step the noise is zero.
    let endless = Step { dt: f64::INFINITY, ..step };
    let (_, drag_virial) = truth::drag_and_noise(&fluid, &x, &v, &tag, &species, &domain, endless);

    assert_close(&printed["density"], truth.densities.iter().copied(), "densities");
    for run in ["newton_off", "newton_on", "thermal"] {
        let noisy = run == "thermal";
        let forces = truth.forces.iter().flatten().zip(thermal.iter().flatten());
        let forces = forces.map(|(f, t)| if noisy { f + t } else { *f });
        assert_close(&printed[&format!("{run}.force")], forces, run);
        assert_close(&printed[&format!("{run}.energy")], [truth.energy], run);
        assert_close(&printed[&format!("{run}.virial")], truth.virial, run);
        for (name, virial) in [("thermostat_virial", thermal_virial), ("drag_virial", drag_virial)] {
            let expected = virial.map(|w| if noisy { w } else { 0.0 });
            assert_close(&printed[&format!("{run}.{name}")], expected, run);
        }
    }
}

#[test]
fn a_program_in_c_and_in_cpp_gets_the_forces_of_the_reference() {
    let scratch = tempfile::tempdir().unwrap();
    let (library, native) = (engine().library, native_libraries(scratch.path()));
    let compilers = [
        ("CC", "cc", vec!["-std=c99"], "c"),
        ("CXX", "c++", vec!["-std=c++11", "-x", "c++"], "c++ 2011"),
        ("CXX", "c++", vec!["-std=c++17", "-x", "c++"], "c++ 2017"),
    ];
    for (variable, default, flags, name) in compilers {
        let program = scratch.path().join(name);
        run(Command::new(env::var_os(variable).unwrap_or(default.into()))
            .args(flags)
            .args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
            .arg(root().join("rust-core/c-api/include"))
            .arg(root().join("tests/c/consumer.c"))
            .args(["-x", "none"])
            .arg(&library)
            .args(&native)
            .arg("-lm")
            .arg("-o")
            .arg(&program));
        let output = run(Command::new(&program)
            .arg(scratch.path().join("set 6 é.toml"))
            .arg(scratch.path().join("no such file.toml")));
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.starts_with(&format!("version {}\n", env!("CARGO_PKG_VERSION"))), "{name}: {text}");
        check_against_reference(&parse(&text));
    }
}
