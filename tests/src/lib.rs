//! What the end-to-end tests share: the program, LAMMPS, and the plugin built for it.

mod python;

pub use python::python;

use psidpd::lammps::{Host, install, plugin};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The top of the checkout.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests are a folder of the checkout").to_owned()
}

/// The program, built as the tests are: cargo builds it for its own package's tests only.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut build = Command::new(cargo);
        build.args(["build", "--quiet", "-p", "psidpd", "--bin", "psidpd"]).current_dir(root());
        if !cfg!(debug_assertions) {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo runs").success(), "the program does not build");
        // target/release/deps/this-test → target/release/psidpd
        let test = std::env::current_exe().expect("a test knows where it is");
        let folder = test.parent().and_then(Path::parent).expect("tests are built into target/PROFILE/deps");
        folder.join("psidpd")
    })
}

/// Runs the program in `folder`.
pub fn psidpd(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program()).args(arguments).current_dir(folder).output().expect("the program starts")
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
