//! Shared parts of the end-to-end tests: the program, LAMMPS, and the plugin built for it.

mod engine;
mod python;
mod results;
mod scripts;

pub use results::Results;
pub use scripts::{Block, blocks, examples, parts, readme_block};

pub use engine::{Engine, engine};
pub use python::python;

use psidpd::lammps::{Host, install, plugin};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The top folder of the checkout.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests are a folder of the checkout").to_owned()
}

/// The path of the program that was built with the tests; panics if the caller is not an integration test.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // The test is target/release/deps/this-test, and the program target/release/psidpd-under-test.
        let test = std::env::current_exe().expect("a test knows where it is");
        let folder = test.parent().and_then(Path::parent).expect("tests are built into target/PROFILE/deps");
        let program = folder.join("psidpd-under-test");
        assert!(program.is_file(), "cargo builds {} with the integration tests", program.display());
        program
    })
}

pub fn psidpd(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program()).args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Runs the program in `folder`, checks that it exits with `code`, and parses the file that it writes for `--json`.
pub fn json(folder: &Path, arguments: &[&str], code: i32) -> serde_json::Value {
    let output = psidpd(folder, &[arguments, &["--json", "out.json"]].concat());
    assert_eq!(output.status.code(), Some(code), "{}", said(&output));
    let text = std::fs::read_to_string(folder.join("out.json")).expect("the program writes its results");
    serde_json::from_str(&text).expect("the results are JSON")
}

/// Both outputs of a program as one text, for messages.
pub fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// LAMMPS, installed if it is missing, and the plugin built for it.
pub fn lammps() -> &'static (Host, PathBuf) {
    static LAMMPS: OnceLock<(Host, PathBuf)> = OnceLock::new();
    LAMMPS.get_or_init(|| {
        let mut host = install(&|line| eprintln!("{line}")).expect("LAMMPS installs");
        // Tests run beside each other.
        host.yields = true;
        let plugin = plugin::build(&host, &|line| eprintln!("{line}")).expect("the plugin builds");
        (host, plugin)
    })
}

/// The error text of a run that must stop. mpirun may lose the last output of a rank that aborts while mpirun
/// ends the others, so a run on several ranks is repeated a few times until the text arrives. Every run must
/// stop without a hang.
pub fn last_words(ranks: usize, run: impl Fn() -> Result<String, String>) -> String {
    let mut said = String::new();
    for _ in 0..if ranks > 1 { 6 } else { 1 } {
        said = run().expect_err("this should stop");
        assert!(!said.contains("imeout"), "{ranks} ranks: {said}");
        if said.contains("ERROR") {
            break;
        }
    }
    said
}
