//! Hard cases: the required and the actual result of each, by integrator and precision.
//!
//! A file for each group of cases; [`case`] says what a case is and judges, [`native`] and [`plugin`] carry it out.

mod case;
mod forces;
mod native;
mod phases;
mod plugin;
mod singular;
mod starts;
mod steps;

use crate::ExperimentError;
use crate::code::Host;
use crate::jobs;
use crate::lammps::host::PluginHost;
use crate::shipped::SET6;
use case::{Case, Inputs, Must, cube};
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::Integrator;
use psidpd_formats::files::{remove_work, temporary_folder, work_folder};
use psidpd_report::{Progress, Table};
use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// The integrators that are recommended, in mixed precision, and velocity Verlet in double.
    Quick,
    All,
    /// All integrators, and long runs of 10⁶ steps.
    Full,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub group: &'static str,
    pub case: &'static str,
    pub host: Host,
    pub integrator: &'static str,
    pub precision: String,
    pub must: String,
    pub did: String,
    /// Why that is not what must; nothing if it is.
    pub wrong: Option<String>,
}

fn cases(extent: Extent) -> Vec<Case> {
    let groups = [
        ("starts and boxes", starts::cases()),
        ("singular formulas", singular::cases()),
        ("phases", phases::cases()),
        ("time steps and masses", steps::cases()),
        ("forces", forces::cases()),
        ("long runs", vec![long(extent == Extent::Full)]),
    ];
    let named = |(group, cases): (_, Vec<Case>)| cases.into_iter().map(move |case| Case { group, ..case });
    groups.into_iter().flat_map(named).collect()
}

/// Momentum, and energy without thermostat.
fn long(full: bool) -> Case {
    let (name, steps) = match full {
        true => ("10^6 steps without thermostat", 1_000_000),
        false => ("2000 steps without thermostat", 2_000),
    };
    let run = Inputs::new(SET6, 1.0, cube(3.0, 6.05), 0.002, [500, steps]);
    Case::new(name, run, Must::Conserves(0.02))
}

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

/// Carries out all cases; in LAMMPS too, if `lammps` is set.
pub fn run(
    extent: Extent,
    lammps: bool,
    only: Option<&str>,
    progress: &Progress,
) -> Result<Vec<Verdict>, ExperimentError> {
    let folder = temporary_folder()?;
    let lammps = lammps.then(|| PluginHost::find(&|line| progress.note(line))).transpose()?;
    let mut cases = cases(extent);
    let mut groups: Vec<&str> = cases.iter().map(|case| case.group).collect();
    groups.dedup();
    cases.retain(|case| only.is_none_or(|words| case.name.contains(words) || case.group.contains(words)));
    if let Some(words) = only.filter(|_| cases.is_empty()) {
        return Err(ExperimentError::NoCase(words.to_owned(), groups.join(", ")));
    }
    let mut runs = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let mut settings = settings(extent);
        if let Must::Agrees(_) = case.must {
            // No step is made.
            settings.retain(|(integrator, _)| *integrator == Integrator::VelocityVerlet);
        }
        for (integrator, precision) in settings {
            let place = folder.path().join(format!("{k}-{}-{precision}", integrator.name()));
            runs.push((case, None, integrator, precision, case.must(integrator), place));
        }
        if let Some((lammps, must)) = lammps.as_ref().zip(plugin::must(case)) {
            for precision in [Precision::Mixed, Precision::Double] {
                let place = folder.path().join(format!("{k}-plugin-{precision}"));
                runs.push((case, Some(lammps), Integrator::VelocityVerlet, precision, must, place));
            }
        }
    }
    let bar = (progress, "hard cases");
    let verdicts = jobs::counted(bar, runs, |(case, lammps, integrator, precision, must, place)| {
        work_folder(&place)?;
        let (host, found) = match lammps {
            None => (Host::Native, native::carry_out(case, integrator, precision, &place)?),
            Some(lammps) => (Host::Plugin, plugin::carry_out(lammps, case, precision, &place)?),
        };
        let _ = remove_work(&place);
        Ok(Verdict {
            group: case.group,
            case: case.name,
            host,
            integrator: integrator.name(),
            precision: precision.to_string(),
            must: must.words(),
            did: case::said(&found),
            wrong: case::judge(must, &found, precision == Precision::Mixed).err(),
        })
    });
    verdicts.into_iter().collect()
}

pub fn table(results: &[Verdict]) -> Table {
    let mut table = Table::new(["case", "host", "integrator", "precision", "must be", "was", "verdict"]);
    for r in results {
        let verdict = if r.wrong.is_some() { "fail" } else { "pass" };
        // Messages are long, and their beginning says what happened.
        let did: String = r.did.chars().take(90).collect();
        table.push([r.case, r.host.name(), r.integrator, &r.precision, &r.must, &did, verdict]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `psidpd hardcases --quick` does.
    #[test]
    fn every_case_does_what_it_must() {
        let results = run(Extent::Quick, false, None, &Progress::new()).unwrap();
        let wrong: Vec<&Verdict> = results.iter().filter(|r| r.wrong.is_some()).collect();
        assert!(wrong.is_empty(), "{}\n{wrong:#?}", table(&results).to_text_with(false));
        assert!(results.len() > 100);
    }

    /// The page names the groups with their files, and how many rows the quick extent has.
    #[test]
    fn the_page_has_the_groups_and_the_rows() {
        let page = include_str!("../../../../docs/hardcases.md");
        let all = cases(Extent::Quick);
        for case in &all {
            assert!(page.contains(&format!("| {} (`", case.group)), "{}", case.group);
        }
        let quick = settings(Extent::Quick);
        let alone = quick.iter().filter(|(integrator, _)| *integrator == Integrator::VelocityVerlet).count();
        let rows = |case: &Case| if matches!(case.must, Must::Agrees(_)) { alone } else { quick.len() };
        let count: usize = all.iter().map(rows).sum();
        assert!(page.contains(&format!(": {count} rows.")), "{count}");
    }

    /// Each row has what was judged; long messages are cut.
    #[test]
    fn rows_are_those_of_the_verdicts() {
        let verdict = |did: String, wrong: Option<String>| Verdict {
            group: "a group",
            case: "a case",
            host: Host::Plugin,
            integrator: "aboba",
            precision: "mixed".into(),
            must: "stop".into(),
            did,
            wrong,
        };
        let table = table(&[verdict("stopped".into(), None), verdict("ü".repeat(100), Some("late".into()))]);
        let beginning = ["a case", Host::Plugin.name(), "aboba", "mixed", "stop"];
        assert_eq!(table.header.len(), 7);
        assert_eq!(table.rows[0][..5], beginning);
        assert_eq!(table.rows[0][5..], ["stopped", "pass"]);
        assert_eq!(table.rows[1][5..], [&*"ü".repeat(90), "fail"]);
        assert_eq!(table.rows.len(), 2);
    }

    #[test]
    fn words_of_no_case_are_an_error() {
        let error = run(Extent::Quick, false, Some("zzz"), &Progress::new()).unwrap_err();
        assert!(
            error.to_string().contains("\"zzz\"") && error.to_string().contains("singular formulas"),
            "{error}"
        );
    }
}
