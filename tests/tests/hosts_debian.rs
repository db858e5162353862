//! The LAMMPS of the distribution, which loads no plugins: the launcher, under its mpirun too, and Python. If
//! it is installed, run `cargo test --release --workspace --test hosts_debian -- --ignored`.

mod host_common;
mod style_common;

use host_common::{LIMIT, Runs, model, script};
use psidpd::lammps::{Host, HostKind, HostVersion, plugin};
use psidpd_tests::{lammps, psidpd, root, said};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const PACKAGES: [&str; 3] = ["lammps", "liblammps-dev", "python3-lammps"];

/// Debian's LAMMPS, with the plugin built for it and the launcher.
struct Debian {
    host: Host,
    plugin: PathBuf,
    launcher: PathBuf,
}

/// Panics if Debian's LAMMPS is not installed: these tests run on request only.
fn debian() -> &'static Debian {
    static DEBIAN: OnceLock<Debian> = OnceLock::new();
    DEBIAN.get_or_init(|| {
        let installed = |package: &str| {
            let out = Command::new("dpkg").args(["-s", package]).output();
            out.is_ok_and(|o| String::from_utf8_lossy(&o.stdout).contains("Status: install ok installed"))
        };
        assert!(PACKAGES.into_iter().all(installed), "install them: apt install {}", PACKAGES.join(" "));
        let host = Host::system().expect("Debian's LAMMPS is found");
        let plugin = plugin::build(&host, &|_| {}).expect("the plugin builds");
        let launcher =
            plugin::launcher(&plugin).expect("Debian's LAMMPS loads no plugins: there is a launcher");
        Debian { host, plugin, launcher }
    })
}

impl Debian {
    /// The launcher in the place of `lmp`.
    fn runs(&self) -> Runs {
        Runs { host: self.host.with_program(&self.launcher), load: String::new() }
    }
}

/// Runs a script with the launcher and returns its output, or its error.
fn outcome(debian: &Debian, text: &str, ranks: usize, folder: &Path) -> Result<String, String> {
    debian.runs().outcome(text, ranks, folder)
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn the_launcher_runs_scripts_as_lmp_does() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    // LAMMPS numbers random atoms by rank, and the noise depends on these numbers: both runs start from one file.
    let make = script(&model()).replace("run 10", "run 0\nwrite_data start.data");
    outcome(debian, &make, 1, folder.path()).unwrap();
    let text = script(&model());
    let (head, tail) = (text.find("region").unwrap(), text.find("pair_style").unwrap());
    let text = format!(
        "{}read_data start.data\n{}variable u equal pe\nprint \"energy $(v_u:%.17g)\"\n",
        &text[..head],
        &text[tail..]
    );
    let mut energies = Vec::new();
    for ranks in [1, 2] {
        let said = outcome(debian, &text, ranks, folder.path()).unwrap();
        assert!(said.contains("Warren 2003, set 6"), "{said}");
        // A mixture of two MPIs would run the script once for each rank.
        assert_eq!(said.matches("Loop time").count(), 1, "{said}");
        assert!(said.contains(&format!("on {ranks} procs")), "{said}");
        let line = said.lines().find_map(|l| l.strip_prefix("energy ")).unwrap();
        energies.push(line.trim().parse::<f64>().unwrap());
    }
    assert!((energies[0] - energies[1]).abs() < 1e-9, "{energies:?}");

    // The launcher has the arguments, help, versions and failures of `lmp`.
    let ours = debian.host.with_program(&debian.launcher);
    assert_eq!(ours.version().unwrap(), debian.host.version().unwrap());
    let mut standard = ours.command(1);
    standard.args(["-var", "n", "3", "-log", "none", "-screen", "out.txt"]).current_dir(folder.path());
    std::fs::write(folder.path().join("in.var"), script(&model()).replace("run 10", "run $n")).unwrap();
    standard.stdin(std::fs::File::open(folder.path().join("in.var")).unwrap());
    assert!(standard.status().unwrap().success());
    let screen = std::fs::read_to_string(folder.path().join("out.txt")).unwrap();
    assert!(screen.contains("for 3 steps"), "{screen}");
    let wrong: Vec<Output> = [&debian.host, &ours]
        .iter()
        .map(|host| host.command(1).arg("-nonsense").current_dir(folder.path()).output().unwrap())
        .collect();
    assert_eq!(wrong[0].status.code(), wrong[1].status.code());
    assert!(said(&wrong[1]).contains("Invalid command-line argument"), "{}", said(&wrong[1]));
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn forces_equal_the_native_engine() {
    let debian = debian();
    host_common::forces_equal_the_native_engine(&debian.runs());
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn splittings_are_the_native_ones() {
    let debian = debian();
    host_common::splittings_are_the_native_ones(&debian.runs());
    let folder = tempfile::tempdir().unwrap();
    let listed =
        outcome(debian, "plugin list\nplugin unload fix dpd/splitting\nplugin list\n", 1, folder.path());
    assert_eq!(listed.unwrap().matches("fix style plugin dpd/splitting").count(), 1);
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn walls_are_the_native_ones() {
    host_common::walls_are_the_native_ones(&debian().runs());
}

/// Weakened and excluded pairs need LAMMPS's list. The headers of this version cannot request a full one: the
/// half list has all pairs with newton off, which the styles then require.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn weakened_and_excluded_pairs_are_the_formulas() {
    let debian = debian();
    let said = host_common::special_factors_and_exclusions(&debian.runs(), "off");
    assert!(said[0].contains("  special bonds factors"), "{}", said[0]);
    assert!(said[1].contains("  exclusions    pairs"), "{}", said[1]);
    let folder = tempfile::tempdir().unwrap();
    let [special, _] = host_common::weakened_decks("on", folder.path());
    debian.runs().outcome(&special, 1, folder.path()).unwrap();
    let narrow = |deck: &str| {
        deck.replace("mdpd/psi 1.0 1.0 5", "mdpd/psi 1.0 3.0 5").replace("-40 25 0 1 0.75", "-4 2 0 3 0.75")
    };
    let [on, off] =
        ["on", "off"].map(|newton| narrow(&host_common::weakened_decks(newton, folder.path())[0]));
    let said = debian.runs().outcome(&off, 1, folder.path()).unwrap();
    assert!(said.contains("half neighbor list of LAMMPS, because of special_bonds"), "{said}");
    let error = debian.runs().outcome(&on, 1, folder.path()).unwrap_err();
    assert!(error.contains("this version of LAMMPS needs 'newton off'"), "{error}");
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn styles_survive_clear_and_scripts_for_plugins_run_unchanged() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    let text = script(&model());
    let run = |text: &str| outcome(debian, text, 1, folder.path());
    let twice = run(&format!("{text}clear\n{text}")).unwrap();
    assert_eq!(twice.matches("Loop time").count(), 2, "{twice}");
    run(&format!("plugin load \"{}\"\n{text}", debian.plugin.display())).unwrap();
    let listed = run(&format!(
        "plugin list\nplugin unload pair mdpd/psi\nplugin unload pair lj/cut\nplugin list\n{text}"
    ))
    .unwrap();
    assert_eq!(listed.matches("pair style plugin dpd/psi").count(), 2, "{listed}");
    assert_eq!(listed.matches("pair style plugin mdpd/psi").count(), 1, "{listed}");
    assert!(listed.contains("Ignoring unload of pair style lj/cut"), "{listed}");
    let gone = run(&format!("plugin unload pair dpd/psi\n{text}")).unwrap_err();
    assert!(gone.contains("Unrecognized pair style"), "{gone}");
    let dropped = format!("{text}plugin unload pair dpd/psi\nplugin load psidpdplugin.so\nclear\n{text}");
    assert_eq!(run(&dropped).unwrap().matches("Loop time").count(), 2);
    let other = run(&format!("plugin load /somewhere/otherplugin.so\n{text}")).unwrap_err();
    assert!(other.contains("can load no other plugin"), "{other}");
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn mistakes_stop_all_ranks_with_a_clear_line() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    let base = script(&model());
    for (from, to, message) in [
        ("dpd/psi 1.0 5", "dpd/psi -1 5", "the temperature must be positive, found -1"),
        ("comm_modify vel yes", "", "add 'comm_modify vel yes'"),
        ("units lj", "units real", "use 'units lj'"),
        (" F\n", " G\n", "no species \"G\"; the model has F"),
        ("run 10", "set atom 1 vx 1e300\nrun 10", "ERROR"),
        ("dpd/psi 1.0 5", "mdpd 1.0 5", "Unrecognized pair style"),
    ] {
        for ranks in [1, 2] {
            let text = base.replacen(from, to, 1);
            let error = psidpd_tests::last_words(ranks, || outcome(debian, &text, ranks, folder.path()));
            assert!(error.contains(message), "{to} on {ranks}\nexpected: {message}\nfound: {error}");
        }
    }
}

/// In Python the plugin gets the handle of the instance.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn python_registers_the_styles() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("in.lammps"), script(&model())).unwrap();
    let code = "import sys, ctypes, lammps\n\
                plugin = sys.argv[1]\n\
                L = lammps.lammps(cmdargs=['-nocite', '-log', 'none'])\n\
                register = ctypes.CDLL(plugin).psidpd_register\n\
                register.argtypes = [ctypes.c_void_p]\n\
                register.restype = ctypes.c_char_p\n\
                assert b'no LAMMPS instance' in register(None)\n\
                assert register(L.lmp) is None\n\
                L.file('in.lammps')\n\
                L.command('clear')\n\
                sys.path.append(sys.argv[2])\n\
                import psidpd_lammps\n\
                psidpd_lammps.register(L, plugin)\n\
                L.file('in.lammps')\n";
    let out = python(code, &debian.plugin, folder.path());
    assert!(out.status.success(), "{}", said(&out));
    assert_eq!(said(&out).matches("Loop time").count(), 2, "{}", said(&out));
}

/// The output of Debian's Python when it registers a plugin in its LAMMPS.
fn register_in_python(plugin: &Path) -> Output {
    let code = "import sys, lammps\n\
                sys.path.append(sys.argv[2])\n\
                import psidpd_lammps\n\
                L = lammps.lammps(cmdargs=['-nocite', '-log', 'none'])\n\
                psidpd_lammps.register(L, sys.argv[1])\n";
    python(code, plugin, &std::env::temp_dir())
}

/// Runs Debian's Python with the plugin and the folder of the Python package as arguments.
fn python(code: &str, plugin: &Path, folder: &Path) -> Output {
    Command::new("/usr/bin/python3")
        .args(["-c", code])
        .arg(plugin)
        .arg(root().join("lammps-plugin/python"))
        .env("OMP_NUM_THREADS", "1")
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(folder)
        .output()
        .expect("Python starts")
}

/// A plugin for another version gives a message and a failure, from the launcher and from
/// Python, before its code uses LAMMPS.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn a_plugin_for_another_lammps_is_refused() {
    let debian = debian();
    let mut other = debian.host.version().unwrap();
    other.number = 20_240_829;
    let base = debian.plugin.parent().unwrap().join("other-version");
    let stranger = plugin::build_for(&debian.host, &other, &base, &|_| {}).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("in.lammps"), script(&model())).unwrap();
    let expected = "was built for LAMMPS 20240829 (29 Aug 2024), this is LAMMPS";
    for ranks in [1, 2] {
        let host = debian.host.with_program(&plugin::launcher(&stranger).unwrap());
        let out = host.command(ranks).args(["-in", "in.lammps"]).current_dir(folder.path()).output().unwrap();
        assert_eq!(out.status.code(), Some(1), "{}", said(&out));
        assert_eq!(said(&out).matches(expected).count(), 1, "{}", said(&out));
        assert!(!said(&out).contains("Loop time"), "{}", said(&out));
    }
    let out = register_in_python(&stranger);
    assert_eq!(out.status.code(), Some(1), "{}", said(&out));
    assert!(said(&out).contains(&format!("RuntimeError: The psidpd plugin {expected}")), "{}", said(&out));
    let refused = plugin::check(&debian.host, &stranger).unwrap_err().to_string();
    assert!(refused.contains("20240829"), "{refused}");
    plugin::check(&debian.host, &debian.plugin).unwrap();
}

/// The plugin refuses a LAMMPS with plugins that it was not built for, where some of its symbols are missing.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn the_wheel_refuses_it_with_both_versions() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, format!("plugin load \"{}\"\n{}", debian.plugin.display(), script(&model())))
        .unwrap();
    let here = lammps().0.version().unwrap().number;
    for ranks in [1, 2] {
        let error = psidpd_tests::last_words(ranks, || {
            let run = lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT);
            run.map(|run| run.stdout).map_err(|e| e.to_string())
        });
        let there = debian.host.version().unwrap().number;
        assert!(error.contains(&format!("was built for LAMMPS {there} (")), "{error}");
        assert!(error.contains(&format!("this is LAMMPS {here} (")), "{error}");
        assert!(!error.contains("Unrecognized pair style"), "{error}");
    }
}

/// The scripts of the examples and of the README run here unchanged.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn examples_and_the_readme_run_here() {
    let debian = debian();
    let host = debian.runs().host;
    let arguments = ["-log", "none", "-var", "plugin", "./psidpdplugin.so", "-var", "models", "models"];
    let arguments = [&arguments[..], &["-var", "steps", "50"]].concat();
    for script in psidpd_tests::examples() {
        let folder = tempfile::tempdir().unwrap();
        // LAMMPS does not expand variables within quotes, so values with a space would be split.
        symlink(&debian.plugin, folder.path().join("psidpdplugin.so")).unwrap();
        symlink(root().join("validation/models"), folder.path().join("models")).unwrap();
        let run = host.run_script(1, folder.path(), &script, &arguments, LIMIT);
        let run = run.unwrap_or_else(|e| panic!("{}: {e}", script.display()));
        assert!(run.stdout.contains("Loop time"), "{}", run.stdout);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.readme");
    std::fs::write(&path, psidpd_tests::readme_block("lammps", "pair_style   dpd/psi")).unwrap();
    let run = host.run_script(2, &root(), &path, &["-log", "none"], LIMIT).unwrap();
    assert!(run.stdout.contains("Loop time"), "{}", run.stdout);
}

/// The plugin refuses the right version with another MPI: its headers give LAMMPS's objects another layout.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn a_plugin_for_another_mpi_is_refused() {
    let debian = debian();
    let mixed = Host { mpi_include: lammps().0.mpi_include.clone(), ..debian.host.clone() };
    // The host gets no launcher, which could not be linked to that MPI.
    let version = HostVersion { plugins: true, ..debian.host.version().unwrap() };
    let base = debian.plugin.parent().unwrap().join("other-mpi");
    let stranger = plugin::build_for(&mixed, &version, &base, &|_| {}).unwrap();
    let out = register_in_python(&stranger);
    assert_eq!(out.status.code(), Some(1), "{}", said(&out));
    assert!(said(&out).contains("built for another MPI than this LAMMPS uses"), "{}", said(&out));
}

#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn the_program_builds_for_the_system_and_says_how_to_use_it() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    for place in ["system", "/usr"] {
        let out = psidpd(folder.path(), &["lammps", "plugin", "--lammps", place, "--json", "built.json"]);
        assert!(out.status.success(), "{}", said(&out));
        let command = format!("{} -in SCRIPT", debian.launcher.display());
        assert!(said(&out).contains(&command), "{}", said(&out));
        let built = std::fs::read_to_string(folder.path().join("built.json")).unwrap();
        let built: serde_json::Value = serde_json::from_str(&built).unwrap();
        assert_eq!(built["launcher"].as_str().map(Path::new), Some(debian.launcher.as_path()));
        assert_eq!(built["lammps_version"], debian.host.version().unwrap().number);
    }
    let out = psidpd(folder.path(), &["lammps", "plugin", "--lammps", "nowhere"]);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("no LAMMPS at nowhere"), "{}", said(&out));
}

/// A source tree, made of links to the parts of the installed LAMMPS.
#[test]
#[ignore = "needs the LAMMPS of Debian: apt install lammps liblammps-dev python3-lammps"]
fn a_source_tree_is_a_host() {
    let debian = debian();
    let folder = tempfile::tempdir().unwrap();
    let build = folder.path().join("build");
    std::fs::create_dir(&build).unwrap();
    symlink(&debian.host.include, folder.path().join("src")).unwrap();
    symlink(&debian.host.library, build.join("liblammps.so")).unwrap();
    symlink(std::fs::canonicalize(&debian.host.library).unwrap(), build.join("liblammps.so.0")).unwrap();
    symlink(&debian.host.lmp, build.join("lmp")).unwrap();
    let host = Host::at(folder.path()).unwrap();
    assert_eq!((host.kind, &host.lmp), (HostKind::Source, &build.join("lmp")));
    assert_eq!(host.mpi_include, debian.host.mpi_include);
    let plugin = plugin::build(&host, &|_| {}).unwrap();
    let host = host.with_program(&plugin::launcher(&plugin).unwrap());
    std::fs::write(folder.path().join("in.lammps"), script(&model())).unwrap();
    let run = host.run_script(2, folder.path(), Path::new("in.lammps"), &[], LIMIT).unwrap();
    assert!(run.stdout.contains("Loop time"), "{}", run.stdout);
}
