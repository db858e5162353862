//! The command line: one file for each verb.
//!
//! The exit code is 0 on success; 1 if a check fails, a run stops, or existing results cannot be written; 2 for bad input and
//! for missing requirements. A run that a signal stopped exits with 128 plus the number of the signal: 130 for Ctrl-C, 143
//! for SIGTERM.

mod bench;
mod calibrate;
mod check;
mod devices;
mod diagnostic;
mod error;
mod examples;
mod export;
mod forces;
mod hardcases;
mod inputs;
mod lammps;
mod model;
mod new;
mod pareto;
mod report;
mod reproduce;
mod run;
mod say;
mod settings;
mod shell;
mod snapshot;
mod sweep;
mod theory;
mod validate;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
pub use diagnostic::Failure;
use error::CliError;
use inputs::Files;
use psidpd_core::document::{Document, printable};
use psidpd_core::model::Model;
use psidpd_dynamics::checkpoint::Caller;
use psidpd_experiments::ExperimentError;
use psidpd_formats::files::{Existing, PathError, may_replace, protect, write_bytes};
use psidpd_report::{Progress, Table};
use say::say;
use serde::Serialize;
use serde_json::json;
use settings::{Settings, temperature};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

/// Many-body dissipative particle dynamics: native runner and cross-code validator.
#[derive(Debug, Parser)]
#[command(name = "psidpd", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
    /// Write machine-readable results to a file.
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Replace files that psidpd did not make, and start over in folders that hold runs. Inputs are never replaced.
    #[arg(long, global = true)]
    overwrite: bool,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Write a scene and its model as a starting point.
    New(new::Arguments),
    /// Say what a model or scene will compute, and what cannot work.
    Check(check::Arguments),
    /// Run a scene natively.
    Run(run::Arguments),
    /// Make report.html of a run again, from the files in its folder.
    Report(report::Arguments),
    /// Run a scene at many values of its keys.
    Sweep(sweep::Arguments),
    /// Draw the particles, or their density, in a data, dump, XYZ or GSD file.
    Snapshot(snapshot::Arguments),
    /// Compute mean field: equation of state, critical point, spinodal, binodal, surface tension.
    Theory(theory::Arguments),
    /// Compute energy, virial, densities and forces of one configuration.
    Forces(forces::Arguments),
    /// Make a model file of a real liquid.
    #[command(subcommand)]
    Model(model::Verb),
    /// Find the corrected density with which a model has its target pressure.
    Calibrate(calibrate::Arguments),
    /// Measure what a unit of simulated time costs with each integrator, time step and precision, and the errors of the results.
    Pareto(pareto::Arguments),
    /// Write a fluid for another code.
    #[command(subcommand)]
    Export(export::Verb),
    /// Install LAMMPS into a local environment, build the plugin for it, or convert a script.
    #[command(subcommand)]
    Lammps(lammps::Verb),
    /// Compare the native runner, the LAMMPS plugin, LAMMPS's mdpd and eam/alloy in one fluid.
    Validate(validate::Arguments),
    /// Measure figures and tables of the papers, and compare with the published values.
    Reproduce(reproduce::Arguments),
    /// Time LAMMPS, the plugin and the native runner side by side.
    Bench(bench::Arguments),
    /// Run cases that are hard for a simulation, and check that each ends as required.
    Hardcases(hardcases::Arguments),
    /// List the GPUs that can compute a run.
    Devices(devices::Arguments),
    /// Print a script that completes verbs and options in a shell.
    Completions(shell::Completions),
    /// Write manual pages.
    Man(shell::Man),
}

/// The outcome of a verb without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Good,
    CheckFailed,
    /// The run stopped after a complete step because of this signal.
    Interrupted(u8),
}

/// The command line, with examples.
fn command() -> clap::Command {
    examples::add(Arguments::command())
}

/// The file that starts this program, if the program is part of another.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

pub fn main() -> ExitCode {
    ExitCode::from(with_arguments(std::env::args_os()))
}

/// Runs the program inside another one, such as Python, and returns the exit code. The first of the arguments is the name
/// of the program; `program` is a file that starts it, for verbs that need processes of their own.
pub fn run(program: &Path, arguments: impl IntoIterator<Item = OsString>) -> u8 {
    PROGRAM.get_or_init(|| program.to_owned());
    with_arguments(arguments)
}

fn with_arguments(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    survive_size_limits();
    psidpd_core::memory::keep_released();
    let matches = command().try_get_matches_from(arguments);
    match matches.and_then(|matches| Arguments::from_arg_matches(&matches)) {
        Ok(arguments) => carry_out(arguments),
        Err(error) => {
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            // A closed terminal or pipe is not an error.
            match error.print() {
                Err(lost) if code == 0 && lost.kind() != ErrorKind::BrokenPipe => {
                    complain(&CliError::Lost(lost).into(), Caller::Neither)
                }
                _ => code,
            }
        }
    }
}

/// Without a handler, a file beyond the size limit of the shell would kill the program, and not fail as on a full disk.
fn survive_size_limits() {
    static HANDLER: std::sync::Once = std::sync::Once::new();
    // A system that refuses the handler has no such limits.
    HANDLER.call_once(|| {
        _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)))
    });
}

/// The file that starts this program.
fn program() -> std::io::Result<PathBuf> {
    PROGRAM.get().cloned().map_or_else(std::env::current_exe, Ok)
}

fn carry_out(arguments: Arguments) -> u8 {
    let told = Told { json: arguments.json.as_deref(), existing: arguments.overwrite.into() };
    let files = arguments.verb.files();
    let _inputs = files.protect();
    let outcome = files
        .check(told)
        .map_err(Failure::from)
        .and_then(|()| run_verb(&arguments.verb, told))
        .map_err(|failure| failure.of(&files.given))
        .and_then(|verdict| say::lost().map_or(Ok(verdict), |cause| Err(CliError::Lost(cause).into())));
    match outcome {
        Ok(Verdict::Good) => 0,
        Ok(Verdict::CheckFailed) => 1,
        Ok(Verdict::Interrupted(signal)) => 128 + signal,
        Err(failure) => complain(&failure, arguments.verb.caller()),
    }
}

/// Reports a failure, and returns its exit code.
fn complain(failure: &Failure, caller: Caller) -> u8 {
    // If standard error is closed, the message has no reader.
    let _ = writeln!(anstream::stderr(), "{}", failure.render(caller));
    failure.exit_code()
}

impl Verb {
    /// The input and output files, for verbs that read files named by the user.
    fn files(&self) -> Files {
        match self {
            Verb::Check(a) => a.files(),
            Verb::Theory(a) => a.files(),
            Verb::Calibrate(a) => a.files(),
            Verb::Forces(a) => a.files(),
            Verb::Export(a) => a.files(),
            Verb::Run(a) => a.files(),
            Verb::Sweep(a) => a.files(),
            Verb::Pareto(a) => a.files(),
            Verb::Snapshot(a) => a.files(),
            Verb::Report(a) => a.files(),
            Verb::Lammps(a) => a.files(),
            Verb::Validate(a) => a.files(),
            Verb::Bench(a) => a.files(),
            Verb::Model(a) => a.files(),
            // These verbs read no files named by the user, and look at the files that they write when they write them.
            Verb::Devices(_)
            | Verb::Hardcases(_)
            | Verb::Reproduce(_)
            | Verb::New(_)
            | Verb::Completions(_)
            | Verb::Man(_) => Files::default(),
        }
    }

    /// Tells whether the verb has `--resume` and `--overwrite`.
    fn caller(&self) -> Caller {
        match self {
            Verb::Run(_) | Verb::Sweep(_) => Caller::Options,
            _ => Caller::Neither,
        }
    }
}

/// What every verb is told.
#[derive(Debug, Clone, Copy)]
struct Told<'a> {
    /// The file for the results.
    json: Option<&'a Path>,
    existing: Existing,
}

fn run_verb(verb: &Verb, told: Told) -> Result<Verdict, Failure> {
    match verb {
        Verb::Validate(a) => validate::run(a, told),
        Verb::Bench(a) => bench::run(a, told),
        Verb::Pareto(a) => pareto::run(a, told),
        Verb::Hardcases(a) => hardcases::run(a, told),
        Verb::Check(a) => check::run(a, told),
        Verb::Theory(a) => theory::run(a, told),
        Verb::Export(a) => export::run(a, told),
        Verb::Calibrate(a) => calibrate::run(a, told),
        Verb::Reproduce(a) => reproduce::run(a, told),
        Verb::Model(a) => model::run(a, told),
        Verb::New(a) => new::run(a, told),
        Verb::Run(a) => run::run(a, told),
        Verb::Devices(a) => devices::run(a, told),
        Verb::Sweep(a) => sweep::run(a, told),
        Verb::Report(a) => report::run(a, told),
        Verb::Snapshot(a) => snapshot::run(a, told),
        Verb::Forces(a) => forces::run(a, told),
        Verb::Lammps(a) => lammps::run(a, told),
        Verb::Completions(a) => shell::completions(a),
        Verb::Man(a) => shell::man(a, told),
    }
}

/// Writes `value` to the file of `--json`, if the user named one.
fn write_json(told: Told, value: &impl Serialize) -> Result<(), PathError> {
    told.json.map_or(Ok(()), |path| psidpd_formats::files::write_json(path, told.existing, value))
}

/// A path as text for results in JSON, which cannot hold every path.
fn shown(path: impl AsRef<Path>) -> String {
    path.as_ref().display().to_string()
}

/// The last part of a path, for the command in the head of a file.
fn file_name(path: &Path) -> String {
    path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

/// Writes the results of a verb as [`write_json`] does, and ends it: well, or with a failed check.
fn conclude(told: Told, value: &impl Serialize, good: bool) -> Result<Verdict, Failure> {
    write_json(told, value)?;
    Ok(if good { Verdict::Good } else { Verdict::CheckFailed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::Fault;

    /// The exit code of a command line. With a fault, a term of the engine is 5 % too strong. OUT is a folder of its own, in which no run
    /// is found.
    fn exit_code(line: &str, fault: Option<Fault>) -> u8 {
        let folder = tempfile::tempdir().unwrap();
        let line = line.replace("OUT", &folder.path().display().to_string());
        let mut arguments = Arguments::try_parse_from(line.split(' ')).unwrap();
        if let Verb::Validate(a) = &mut arguments.verb {
            a.only = Some("trajectories");
        }
        Fault::during(fault, || carry_out(arguments))
    }

    /// Every verb that compares results exits with 1 for a faulty engine, and with 0 for a correct one.
    #[test]
    fn a_wrong_engine_is_an_exit_code_of_1() {
        for line in [
            "psidpd validate --out OUT",
            "psidpd hardcases --quick --only cancel",
            "psidpd reproduce berendsen-water --out OUT",
        ] {
            assert_eq!(exit_code(line, None), 0, "{line}");
            assert_eq!(exit_code(line, Some(Fault::PairForce)), 1, "{line}");
        }
    }
}
