//! Results as tables, plots and a page.

use super::ParetoError;
use super::outcome::{Outcome, Point, Reference};
use super::quantity::{Class, Deviation};
use super::setting::Host;
use crate::report::{Item, Plot, Report, Section, Series, Style, Table};

/// An error in percent with its own; what is not resolved as what it is likely to be below.
fn shown(d: &Deviation) -> String {
    let percent = |x: f64| 100.0 * x;
    if !d.resolved {
        return format!("< {:.2}", percent(d.bound()));
    }
    let sign = if d.class == Class::Structure {
        ""
    } else if d.relative < 0.0 {
        "-"
    } else {
        "+"
    };
    format!("{sign}{:.2} ± {:.2}", percent(d.relative.abs()), percent(d.uncertainty))
}

/// The quantities that some point has an error of, in the order of the first that has them.
fn names(outcome: &Outcome) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for d in outcome.points.iter().flat_map(|p| &p.errors).chain(&outcome.reference.values) {
        if !names.contains(&d.name) {
            names.push(d.name.clone());
        }
    }
    names
}

fn row(names: &[String], errors: &[Deviation]) -> Vec<String> {
    let of = |name: &String| errors.iter().find(|d| d.name == *name).map_or_else(|| "–".into(), shown);
    names.iter().map(of).collect()
}

fn reference_row(names: &[String], who: &str, reference: &Reference) -> Vec<String> {
    let mut cells =
        vec![who.to_owned(), format!("{}", reference.dt), String::new(), String::new(), String::new()];
    cells.extend(row(names, &reference.values));
    cells.push(String::new());
    cells
}

/// Every setting, the cheapest first; errors in percent.
pub fn table(outcome: &Outcome) -> Table {
    let names = names(outcome);
    let mut header: Vec<String> =
        ["setting", "dt", "precision", "threads", "s per time unit"].map(str::to_owned).to_vec();
    header.extend(names.iter().map(|name| format!("{name} %")));
    header.push("front".into());
    let mut table = Table::new(header);
    let mut points: Vec<&Point> = outcome.points.iter().collect();
    let cost = |p: &Point| p.cost.as_ref().map_or(f64::INFINITY, |c| c.median);
    points.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    for p in points {
        let cost = match &p.cost {
            Some(c) => format!("{:.4} ({:.4}–{:.4})", c.median, c.min, c.max),
            None => "unstable".into(),
        };
        let mut cells = vec![p.name(), format!("{}", p.dt), p.precision.clone(), p.threads.to_string(), cost];
        cells.extend(row(&names, &p.errors));
        cells.push(p.front.iter().map(|c| c.name()).collect::<Vec<_>>().join(" "));
        table.push(cells);
    }
    table.push(reference_row(&names, "the reference itself", &outcome.reference));
    if let Some(reference) = &outcome.lammps_reference {
        table.push(reference_row(&names, "LAMMPS's reference itself", reference));
    }
    table
}

/// Energy without thermostat.
pub fn drifts(outcome: &Outcome) -> Table {
    let mut table = Table::new([
        "conservative steps of",
        "dt",
        "precision",
        "drift, kT per particle and time unit",
        "largest departure, kT",
    ]);
    for d in &outcome.drifts {
        let drift = match (d.slope, d.slope_error) {
            (Some(slope), Some(error)) => format!("{slope:.1e} ± {error:.0e}"),
            _ => d.stopped.clone().unwrap_or_else(|| "–".into()),
        };
        let largest = d.largest.map_or_else(|| "–".into(), |l| format!("{l:.1e}"));
        table.push([d.integrator.clone(), format!("{}", d.dt), d.precision.clone(), drift, largest]);
    }
    table
}

/// Error against cost for one kind of quantity; the front is a line.
fn plot(outcome: &Outcome, class: Class) -> Option<Plot> {
    let place = |p: &Point| Some((p.cost.as_ref()?.median, 100.0 * p.error(class)?.shown()));
    let mut groups: Vec<String> = Vec::new();
    let group = |p: &Point| match p.host {
        Host::Native => p.integrator.split(',').next().unwrap_or_default().to_owned(),
        Host::Plugin => "plugin in LAMMPS".to_owned(),
        Host::Lammps => "LAMMPS's own style".to_owned(),
    };
    for p in &outcome.points {
        if place(p).is_some() && !groups.contains(&group(p)) {
            groups.push(group(p));
        }
    }
    if groups.is_empty() {
        return None;
    }
    let mut series = Vec::new();
    let mut front: Vec<(f64, f64)> =
        outcome.points.iter().filter(|p| p.front.contains(&class)).filter_map(place).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    for name in groups {
        let own: Vec<&Point> =
            outcome.points.iter().filter(|p| group(p) == name && place(p).is_some()).collect();
        let bar = |p: &&Point| match p.error(class) {
            Some(d) if d.resolved => 100.0 * d.uncertainty,
            _ => f64::NAN,
        };
        series.push(Series {
            name,
            points: own.iter().filter_map(|p| place(p)).collect(),
            errors: Some(own.iter().map(bar).collect()),
            style: Style::Points,
        });
    }
    series.push(Series { name: "front".into(), points: front, errors: None, style: Style::Line });
    let levels = outcome.tolerances.iter().filter(|t| t.class == class);
    Some(Plot {
        title: format!("Error of {} against cost", class.name()),
        x_label: "wall seconds per unit of simulated time".into(),
        y_label: format!("error of {}, %", class.name()),
        series,
        log_x: true,
        log_y: true,
        levels: levels.map(|t| (100.0 * t.bound, "tolerance".to_owned())).collect(),
        marks: Vec::new(),
    })
}

/// What is recommended, in words.
pub fn recommendation(outcome: &Outcome) -> String {
    let within: Vec<String> = outcome.tolerances.iter().map(ToString::to_string).collect();
    let within = within.join(", ");
    let Some(best) = outcome.cheapest.and_then(|k| outcome.points.get(k)) else {
        return format!(
            "No setting has {within}, with twice the error of its error. Where errors in the table are not resolved, \
             longer runs (--minutes) may show one."
        );
    };
    let seconds = best.cost.as_ref().map_or(f64::NAN, |c| c.median);
    let mut text = format!(
        "The cheapest setting with {within}: {}, dt = {}, {} precision, {:.4} s per unit of simulated time.\n\n{}",
        best.name(),
        best.dt,
        best.precision,
        seconds,
        outcome.scene_lines.as_deref().unwrap_or_default()
    );
    if let Some(refusal) = &outcome.lammps_refusal {
        text += &format!("\nNot in LAMMPS: {refusal}.\n");
    }
    match (&outcome.lammps_lines, outcome.cheapest_in_lammps.and_then(|k| outcome.points.get(k))) {
        (Some(lines), Some(p)) => {
            text += &format!("\nIn LAMMPS, {}, dt = {}:\n\n{lines}", p.integrator, p.dt);
        }
        (Some(lines), None) => text += &format!("\nIn LAMMPS the same steps, not timed there:\n\n{lines}"),
        (None, _) => text += "\nNo setting within the tolerances can be written for LAMMPS.\n",
    }
    text
}

/// What the table means.
pub fn explanation(outcome: &Outcome) -> String {
    let temperature = match outcome.temperature_is_known {
        true => "of the temperatures from kT",
        false => "of the kinetic temperature from that of the reference",
    };
    format!(
        "Errors are in percent: {temperature}, of pressure, densities, tension, diffusion and g(r) from the \
         reference ({}, {} samples over {:.1} time units), whose own errors are in its row; \
         ± is one standard deviation, and \"<\" an error below twice that, with what it is likely to be below. \
         Points of the plugin have the errors of the native steps, which they are. Points of LAMMPS's own many-body \
         style are another force law, held against small steps of its own; they are not on the front.",
        outcome.reference.what, outcome.reference.samples, outcome.reference.time
    )
}

/// `pareto.html`.
///
/// # Errors
/// A plot cannot be drawn.
pub fn report(outcome: &Outcome) -> Result<String, ParetoError> {
    let mut plots = Vec::new();
    for (_, class) in Class::ALL {
        if let Some(plot) = plot(outcome, class) {
            plots.push(Item::Figure {
                svg: plot.render()?,
                caption: "Without a bar: not resolved, at what the error is likely to be below.".into(),
            });
        }
    }
    let section = |heading: &str, items: Vec<Item>| Section { heading: heading.into(), items };
    let mut settings = vec![Item::Prose(explanation(outcome)), Item::Table(table(outcome))];
    settings.extend(outcome.left_out.iter().cloned().map(Item::Prose));
    let mut sections = vec![
        section("Recommendation", vec![Item::Prose(recommendation(outcome))]),
        section("Speed against error", plots),
        section("All settings", settings),
    ];
    if !outcome.drifts.is_empty() {
        sections.push(section("Energy without thermostat", vec![Item::Table(drifts(outcome))]));
    }
    let report = Report {
        title: format!("Speed against error: {}", outcome.scene),
        subtitle: format!("{} particles, stage \"{}\"", outcome.particles, outcome.stage),
        facts: vec![
            ("psidpd".into(), outcome.version.into()),
            ("machine".into(), outcome.machine.clone()),
            ("kT".into(), outcome.kt.to_string()),
            ("dt of the scene".into(), outcome.dt.to_string()),
        ],
        sections,
        ..Report::default()
    };
    Ok(report.render())
}
