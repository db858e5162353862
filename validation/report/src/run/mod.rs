//! The report of one run, from the files in its folder.
//!
//! A folder may lack any of the files: a run that was stopped has no `summary.json`, a scene without `[output]` has no dump.
//! The page then says what is missing.

mod against;
mod facts;
mod headline;
mod observables;
mod series;
mod state;

use super::{Item, Report, ReportError, Section};
use crate::quantity::with_error;
use psidpd_formats::files::{Existing, may_replace, read_json_if_there, replace_inside};
use psidpd_formats::{About, FormatError};
use psidpd_observe::Observation;
use serde_json::Value;
use std::path::{Path, PathBuf};

pub use against::{Against, FALSE_ALARM};
pub use headline::{Headline, HeadlineValue, headline};
pub use series::Table as SeriesTable;

/// The files that a report is made from, with their descriptions.
const FILES: [(&str, &str); 12] = [
    ("about.json", "description of the run: species, stages, units, columns of thermo.csv"),
    ("thermo.csv", "totals every few steps"),
    ("summary.json", "summary of results"),
    ("timing.json", "duration of the run"),
    ("observables.json", "observables with their errors"),
    ("observables", "a CSV file for each observable"),
    ("final.data", "the state after the last step: LAMMPS data file"),
    ("dump.lammpstrj", "frames: LAMMPS text dump"),
    ("trajectory.xyz", "frames: extended XYZ"),
    ("trajectory.gsd", "frames: GSD"),
    ("vtk", "particles and their density for ParaView"),
    ("snapshots", "pictures of the particles along the run"),
];

/// Makes `report.html` from the files in the folder of a run, and returns its path. A file with invalid content is not an
/// error: the page says what is wrong with it.
pub fn write_run_report(folder: &Path, existing: Existing) -> Result<PathBuf, ReportError> {
    let path = folder.join("report.html");
    // A link is no file of anybody's, and is replaced itself.
    if path.symlink_metadata().is_ok_and(|about| about.is_file()) {
        may_replace(&path, existing)?;
    }
    let page = run_report(folder)?.render();
    replace_inside(&path, page.as_bytes(), true)?;
    Ok(path)
}

pub fn run_report(folder: &Path) -> Result<Report, ReportError> {
    if !FILES.iter().any(|(name, _)| folder.join(name).exists()) {
        let files: Vec<&str> = FILES.iter().map(|f| f.0).collect();
        return Err(ReportError::NoRun { folder: folder.to_owned(), files: files.join(", ") });
    }
    let mut notes = Vec::new();
    let about = keep(About::read(folder), &mut notes).flatten();
    let summary = keep(read_json_if_there::<Value>(&folder.join("summary.json")), &mut notes).flatten();
    let timing = keep(read_json_if_there::<Value>(&folder.join("timing.json")), &mut notes).flatten();
    let table = keep(series::Table::read(&folder.join("thermo.csv")), &mut notes).flatten();
    let observables =
        keep(read_json_if_there::<Vec<Observation>>(&folder.join("observables.json")), &mut notes).flatten();
    let observables = observables.map(|all| spelled(all, about.as_ref()));
    let state = state::State::find(folder, about.as_ref(), &mut notes);

    let title = about
        .as_ref()
        .map(|a| a.title.clone())
        .or_else(|| Some(summary.as_ref()?.get("title")?.as_str()?.to_owned()))
        .unwrap_or_else(|| folder.file_name().map_or("run".into(), |n| n.to_string_lossy().into_owned()));
    let particles = summary.as_ref().and_then(|s| s.get("particles")?.as_f64());
    let found = headline::gather(
        about.as_ref(),
        particles.or_else(|| Some(state.as_ref()?.configuration.x.len() as f64)),
        table.as_ref(),
        observables.as_deref().unwrap_or_default(),
    );
    let mut sections = vec![
        observables::section(observables.as_deref()),
        state::section(folder, state.as_ref(), about.as_ref()),
        series::section(table.as_ref(), about.as_ref(), state.as_ref().map(|s| s.configuration.x.len())),
        files_section(folder),
    ];
    if let Some(section) = found.section() {
        sections.insert(0, section);
    }
    if !notes.is_empty() {
        let items = vec![Item::Prose(notes.join("\n\n"))];
        sections.insert(0, Section::new("What could not be read", items));
    }
    Ok(Report {
        title,
        subtitle: about.as_ref().map_or(String::new(), |a| format!("psidpd run of {}", a.model)),
        facts: facts::facts(about.as_ref(), summary.as_ref(), timing.as_ref(), state.as_ref()),
        sections,
        passed: 0,
        failed: 0,
    })
}

/// Observables whose units are powers of the length, as in all other parts of the page.
fn spelled(mut all: Vec<Observation>, about: Option<&About>) -> Vec<Observation> {
    let dimensions = about.map_or(3, |a| a.dimensions);
    for observable in &mut all {
        let columns = observable.columns.iter_mut().map(|c| &mut c.unit);
        for unit in columns.chain(observable.x.iter_mut().map(|x| &mut x.unit)) {
            *unit = super::text::of_lengths(unit, dimensions);
        }
    }
    all
}

/// A value; an error is added to the notes instead.
fn keep<T>(result: Result<T, FormatError>, notes: &mut Vec<String>) -> Option<T> {
    result.map_err(|e| notes.push(e.to_string())).ok()
}

fn files_section(folder: &Path) -> Section {
    let mut table = super::Table::new(["file", "what it is", "size"]);
    let mut missing = Vec::new();
    for (name, what) in FILES {
        let path = folder.join(name);
        match path.symlink_metadata() {
            Ok(data) if data.is_file() => table.push([name.to_owned(), what.into(), size(data.len())]),
            Ok(data) if data.is_dir() => table.push([format!("{name}/"), what.into(), String::new()]),
            _ => missing.push(format!("{name} ({what})")),
        }
    }
    let mut items = vec![Item::Table(table)];
    if !missing.is_empty() {
        items.push(Item::Prose(format!("Not there: {}.", missing.join("; "))));
    }
    Section::new("Files", items)
}

fn size(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let power = (bytes.max(1).ilog10() / 3).min(4);
    let value = bytes as f64 / 1000f64.powi(power as i32);
    if power == 0 { format!("{bytes} B") } else { format!("{value:.1} {}", units[power as usize]) }
}

#[cfg(test)]
mod tests;
