//! Hard cases: what must happen in each, and what did, by integrator and precision.
//!
//! A file for each group of cases; [`case`] says what a case is and judges, [`native`] and [`plugin`] carry it out.

mod case;
mod data_file;
mod forces;
mod long;
mod native;
mod phases;
mod plugin;
mod singular;
mod starts;
mod steps;

use crate::ExperimentError;
use crate::code::Host;
use crate::jobs::{self, Job};
use crate::lammps::host::PluginHost;
use case::{Case, Found, Must};
use psidpd_core::engine::{Fault, Precision};
use psidpd_dynamics::integrator::Integrator;
use psidpd_report::{Progress, Table};
use serde::Serialize;
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// The integrators that are recommended, in mixed precision, and velocity Verlet in double.
    Quick,
    /// All integrators in both precisions.
    All,
    /// That, and 10⁶ steps.
    Full,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub group: &'static str,
    pub case: &'static str,
    /// The native runner or the plugin.
    pub host: Host,
    pub integrator: &'static str,
    pub precision: String,
    pub must: String,
    pub did: String,
    /// Why that is not what must; nothing if it is.
    pub wrong: Option<String>,
}

fn cases(extent: Extent) -> Vec<Case> {
    let mut all = starts::cases();
    all.extend(singular::cases());
    all.extend(phases::cases());
    all.extend(steps::cases());
    all.extend(forces::cases());
    all.extend(long::cases(extent == Extent::Full));
    all
}

/// The settings in which cases are carried out.
fn settings(extent: Extent) -> Vec<(Integrator, Precision)> {
    let quick = ["velocity-verlet", "shardlow-s1", "aboba", "two-stage"];
    let mut found = Vec::new();
    for (name, integrator) in Integrator::ALL {
        if extent != Extent::Quick || quick.contains(&name) {
            found.push((integrator, Precision::Mixed));
        }
        if extent != Extent::Quick || name == "velocity-verlet" {
            found.push((integrator, Precision::Double));
        }
    }
    found
}

/// Carries out all cases; in LAMMPS too, if `lammps` is set. With a `fault` the native engine is wrong on purpose.
///
/// # Errors
/// Files cannot be written or read, or LAMMPS is asked for and missing.
pub fn run(
    extent: Extent,
    lammps: bool,
    only: Option<&str>,
    fault: Option<Fault>,
    progress: &Progress,
) -> Result<Vec<Verdict>, ExperimentError> {
    let folder = tempfile::tempdir().map_err(ExperimentError::io(std::env::temp_dir()))?;
    let lammps = lammps.then(|| PluginHost::find(&|line| progress.note(line))).transpose()?;
    let mut cases = cases(extent);
    cases.retain(|case| only.is_none_or(|words| case.name.contains(words) || case.group.contains(words)));
    let mut jobs: Vec<Job<Result<Verdict, ExperimentError>>> = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let mut settings = settings(extent);
        if let Must::Agrees(_) = case.must {
            // No step is made.
            settings.retain(|(integrator, _)| *integrator == Integrator::VelocityVerlet);
        }
        for (integrator, precision) in settings {
            let place = folder.path().join(format!("{k}-{}-{precision}", integrator.name()));
            jobs.push(Box::new(move || {
                within(&place, || {
                    let found = native::carry_out(case, integrator, precision, &place, fault)?;
                    Ok(verdict(case, Host::Native, integrator, precision, case.must(integrator), &found))
                })
            }));
        }
        if let Some((lammps, must)) = lammps.as_ref().zip(plugin::must(case)) {
            for precision in [Precision::Mixed, Precision::Double] {
                let place = folder.path().join(format!("{k}-plugin-{precision}"));
                jobs.push(Box::new(move || {
                    within(&place, || {
                        let found = plugin::carry_out(lammps, case, precision, &place)?;
                        Ok(verdict(case, Host::Plugin, Integrator::VelocityVerlet, precision, must, &found))
                    })
                }));
            }
        }
    }
    let bar = progress.bar("hard cases", jobs.len() as u64);
    jobs::counted(jobs, &bar).into_iter().collect()
}

/// Makes a folder for a case, and removes it after `carry_out`.
fn within<T>(
    place: &Path,
    carry_out: impl FnOnce() -> Result<T, ExperimentError>,
) -> Result<T, ExperimentError> {
    std::fs::create_dir_all(place).map_err(ExperimentError::io(place))?;
    let made = carry_out()?;
    let _ = std::fs::remove_dir_all(place);
    Ok(made)
}

fn verdict(
    case: &Case,
    host: Host,
    integrator: Integrator,
    precision: Precision,
    must: Must,
    found: &Found,
) -> Verdict {
    Verdict {
        group: case.group,
        case: case.name,
        host,
        integrator: integrator.name(),
        precision: precision.to_string(),
        must: must.words(),
        did: case::said(found),
        wrong: case::judge(must, found, precision == Precision::Mixed).err(),
    }
}

pub fn table(results: &[Verdict]) -> Table {
    let mut table = Table::new(["case", "host", "integrator", "precision", "must be", "was", "verdict"]);
    for r in results {
        let verdict = if r.wrong.is_some() { "fail" } else { "pass" };
        // Messages are long, and their beginning says what happened.
        let did: String = r.did.chars().take(90).collect();
        table.push([
            r.case,
            r.host.name(),
            r.integrator,
            r.precision.as_str(),
            r.must.as_str(),
            did.as_str(),
            verdict,
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `psidpd hardcases --quick` does.
    #[test]
    fn every_case_does_what_it_must() {
        let results = run(Extent::Quick, false, None, None, &Progress::new()).unwrap();
        let wrong: Vec<&Verdict> = results.iter().filter(|r| r.wrong.is_some()).collect();
        assert!(wrong.is_empty(), "{}\n{wrong:#?}", table(&results).to_text_with(false));
        assert!(results.len() > 100);
    }
}
