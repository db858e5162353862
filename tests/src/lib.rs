//! What the end-to-end tests share: the program, LAMMPS, and the plugin built for it.

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

/// The top of the checkout.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests are a folder of the checkout").to_owned()
}

/// The program, built with the tests.
///
/// # Panics
/// It is not there: the caller is no integration test.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // target/release/deps/this-test → target/release/psidpd-under-test
        let test = std::env::current_exe().expect("a test knows where it is");
        let folder = test.parent().and_then(Path::parent).expect("tests are built into target/PROFILE/deps");
        let program = folder.join("psidpd-under-test");
        assert!(program.is_file(), "cargo builds {} with the integration tests", program.display());
        program
    })
}

/// Runs the program in `folder`.
pub fn psidpd(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program()).args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Runs the program in `folder`, which must exit with `code`, and reads what it writes to the file of `--json`.
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

/// LAMMPS, installed if need be, and the plugin built for it.
pub fn lammps() -> &'static (Host, PathBuf) {
    static LAMMPS: OnceLock<(Host, PathBuf)> = OnceLock::new();
    LAMMPS.get_or_init(|| {
        let host = install(&|line| eprintln!("{line}")).expect("LAMMPS installs");
        let plugin = plugin::build(&host, &|line| eprintln!("{line}")).expect("the plugin builds");
        (host, plugin)
    })
}

/// What a run that must stop says. mpirun may lose the last words of a rank that aborts while it ends the
/// others, so a run on several ranks is tried again, a few times, until they arrive; that it stops, and does
/// not hang, must hold every time.
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
