use super::{
    Context, Part, conclusion, energy, equilibrium, forces, mixture, observables, thermostat, trajectory,
};
use crate::ExperimentError;
use crate::files;
use crate::lammps::host::PluginHost;
use crate::machine::machine;
use psidpd_formats::files::{Existing, write_bytes, write_json};
use psidpd_report::{Item, Progress, Report, Results, Section, Table};
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, Clone)]
pub struct Options {
    /// Larger systems and longer runs: hours instead of minutes.
    pub full: bool,
    /// Folder for `report.html`, `results.json` and what the runs leave.
    pub out: PathBuf,
    pub existing: Existing,
    /// The one comparison that is made, if not all are: for tests.
    pub only: Option<&'static str>,
}

#[derive(Debug)]
pub struct Validation {
    pub results: Results,
    pub report: PathBuf,
}

/// Installs what is missing, builds the plugin, runs every comparison and writes the report.
pub fn validate(options: &Options, progress: &Progress) -> Result<Validation, ExperimentError> {
    let start = Instant::now();
    let out = files::absolute_folder(&options.out)?;
    let prepared = || PluginHost::prepared(None, &|line| progress.note(line));
    let (lammps, version) = progress.spinner("LAMMPS and the plugin", prepared)?;
    let context = Context { lammps: &lammps, work: out.join("runs"), full: options.full, progress };

    let mut results = Results::new("psidpd cross-code validation", env!("CARGO_PKG_VERSION"));
    let facts = [
        ("psidpd", env!("CARGO_PKG_VERSION").to_owned()),
        ("LAMMPS", version),
        ("mode", if options.full { "full" } else { "quick" }.to_owned()),
        ("machine", machine()),
    ];
    results.facts = facts.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    results.seeds = vec![
        forces::SEED,
        energy::SEED,
        equilibrium::SEED,
        trajectory::SEED,
        thermostat::SEED,
        mixture::SEED,
        observables::SEED,
    ];
    let mut sections = Vec::new();
    type Comparison = fn(&Context) -> Result<Part, ExperimentError>;
    let parts: [(&str, Comparison); 7] = [
        ("forces", forces::run),
        ("thermostat", thermostat::run),
        ("mixture", mixture::run),
        ("observables", observables::run),
        ("trajectories", trajectory::run),
        ("energy", energy::run),
        ("equilibrium", equilibrium::run),
    ];
    for (name, run) in parts.into_iter().filter(|(name, _)| options.only.is_none_or(|only| only == *name)) {
        let part = progress.spinner(name, || run(&context))?;
        for check in part.checks {
            results.push(check);
        }
        for (key, value) in part.values {
            results.record(key, value)?;
        }
        sections.push(part.section);
    }
    results.facts.insert("wall time".into(), format!("{:.0} s", start.elapsed().as_secs_f64()));
    let report = write(&out, options.existing, &results, sections)?;
    Ok(Validation { results, report })
}

pub fn check_table(results: &Results) -> Table {
    let mut table = Table::new(["", "check", "value", "bound"]);
    for check in &results.checks {
        table.push([
            if check.passed { "pass" } else { "FAIL" }.to_owned(),
            check.description.clone(),
            match check.error {
                Some(error) => format!("{:.3e} ± {error:.1e}", check.value),
                None => format!("{:.3e}", check.value),
            },
            format!("{} {:.1e}", if check.at_least { "≥" } else { "≤" }, check.limit),
        ]);
    }
    table
}

fn write(
    out: &Path,
    existing: Existing,
    results: &Results,
    mut sections: Vec<Section>,
) -> Result<PathBuf, ExperimentError> {
    write_json(&out.join("results.json"), existing, results)?;
    sections.insert(0, conclusion::what_is_compared());
    sections.insert(0, conclusion::section(results));
    sections.push(Section::new("Checks", vec![Item::Table(check_table(results))]));
    let mut facts: Vec<(String, String)> = results.facts.clone().into_iter().collect();
    let seeds: Vec<String> = results.seeds.iter().map(u64::to_string).collect();
    facts.push(("seeds".into(), seeds.join(", ")));
    let report = Report {
        title: results.title.clone(),
        subtitle: "Warren's many-body DPD fluid in the native runner, in the LAMMPS plugin, in LAMMPS's mdpd and as \
                   eam/alloy tables"
            .into(),
        facts,
        sections,
        passed: results.passed_count(),
        failed: results.failed_count(),
    };
    let path = out.join("report.html");
    write_bytes(&path, existing, report.render().as_bytes())?;
    Ok(path)
}
