//! Results as tables, plots and a page.

use super::outcome::{Comparison, Point, Reference};
use super::quantity::{Class, Deviation};
use crate::ExperimentError;
use crate::code::Host;
use psidpd_report::{Item, Plot, Report, Section, Series, Style, Table, distinct};

/// An error in percent with its own; what is not resolved as what it is likely to be below.
fn shown(d: &Deviation) -> String {
    if !d.resolved {
        return format!("< {:.2}", 100.0 * d.bound());
    }
    let sign = match d.class {
        Class::Structure => "",
        _ if d.value < 0.0 => "-",
        _ => "+",
    };
    format!("{sign}{:.2} ± {:.2}", 100.0 * d.value.abs(), 100.0 * d.error)
}

/// The quantities that some point has an error of, in the order of the first that has them.
fn names(outcome: &Comparison) -> Vec<String> {
    let errors = outcome.points.iter().flat_map(|p| &p.errors).chain(&outcome.reference.values);
    distinct(errors.map(|d| d.name.clone()))
}

fn row(names: &[String], errors: &[Deviation]) -> Vec<String> {
    let of = |name: &String| errors.iter().find(|d| d.name == *name).map_or_else(|| "–".into(), shown);
    names.iter().map(of).collect()
}

/// Every setting, the cheapest first; errors in percent.
pub fn table(outcome: &Comparison) -> Table {
    let names = names(outcome);
    let mut header: Vec<String> =
        ["setting", "dt", "precision", "threads", "s per time unit"].map(str::to_owned).to_vec();
    header.extend(names.iter().map(|name| format!("{name} %")));
    header.extend(["worst".into(), "front".into()]);
    let mut table = Table::new(header);
    let mut points: Vec<&Point> = outcome.points.iter().collect();
    let cost = |p: &Point| p.cost.as_ref().map_or(f64::INFINITY, |c| c.value);
    points.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    for p in points {
        let cost = match &p.cost {
            Some(c) => format!("{:.4} ({:.4}–{:.4})", c.value, c.min, c.max),
            None => "unstable".into(),
        };
        let mut cells = vec![p.name(), format!("{}", p.dt), p.precision.clone(), p.threads.to_string(), cost];
        cells.extend(row(&names, &p.errors));
        cells.push(p.worst.as_ref().map_or_else(String::new, |w| format!("{} {:.2}", w.quantity, w.ratio)));
        cells.push(if p.front { "front".into() } else { String::new() });
        table.push(cells);
    }
    for (who, reference) in [
        ("the reference itself", Some(&outcome.reference)),
        ("that of D and eta itself", outcome.reference_of_dynamics.as_ref()),
        ("LAMMPS's reference itself", outcome.lammps_reference.as_ref()),
    ] {
        let Some(Reference { dt, values, .. }) = reference else { continue };
        let dt = dt.map_or_else(|| "none".into(), |dt| dt.to_string());
        let mut cells = vec![who.to_owned(), dt, String::new(), String::new(), String::new()];
        cells.extend(row(&names, values));
        cells.extend([String::new(), String::new()]);
        table.push(cells);
    }
    table
}

pub fn drifts(outcome: &Comparison) -> Table {
    let errors = ["drift, kT per particle and time unit", "largest departure, kT"];
    let mut table = Table::new(["conservative steps of", "dt", "precision"].into_iter().chain(errors));
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

/// Who makes the steps, and what kind they are.
fn group(p: &Point) -> String {
    match p.code {
        Host::Native => p.integrator.split(',').next().unwrap_or_default().to_owned(),
        Host::Plugin => "plugin in LAMMPS".to_owned(),
        Host::Lammps => "LAMMPS's own style".to_owned(),
    }
}

/// Points of error against cost, in groups; `error` and its bar are in percent or in units of a tolerance.
fn groups(outcome: &Comparison, error: impl Fn(&Point) -> Option<[f64; 2]>) -> Vec<Series> {
    let place = |p: &Point| Some((p.cost.as_ref()?.value, error(p)?[0]));
    let shown: Vec<&Point> = outcome.points.iter().filter(|p| place(p).is_some()).collect();
    let series = |name: String| {
        let own: Vec<&&Point> = shown.iter().filter(|p| group(p) == name).collect();
        let points = own.iter().filter_map(|p| place(p)).collect();
        let errors = own.iter().map(|p| error(p).map_or(f64::NAN, |e| e[1])).collect();
        Series::new(name, points, Style::Points).with_errors(errors)
    };
    distinct(shown.iter().map(|p| group(p))).into_iter().map(series).collect()
}

fn plot(title: &str, y_label: String, series: Vec<Series>, levels: Vec<(f64, String)>) -> Plot {
    let labels = ["wall seconds per unit of simulated time".to_owned(), y_label];
    Plot { log_x: true, log_y: true, levels, ..Plot::new(title, labels, series) }
}

/// The worst error of every setting against its cost; the front is a line.
fn plot_of_worst(outcome: &Comparison) -> Option<Plot> {
    let error = |p: &Point| Some([p.worst.as_ref()?.ratio, f64::NAN]);
    let mut series = groups(outcome, error);
    if series.is_empty() {
        return None;
    }
    let front = outcome.points.iter().filter(|p| p.front);
    let mut points: Vec<(f64, f64)> =
        front.filter_map(|p| Some((p.cost.as_ref()?.value, error(p)?[0]))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    series.push(Series::new("front", points, Style::Line));
    let label = "worst error over its tolerance".to_owned();
    Some(plot("Worst error against cost", label, series, vec![(1.0, "tolerance".into())]))
}

/// Error against cost for one kind of quantity.
fn plot_of(outcome: &Comparison, class: Class) -> Option<Plot> {
    let error = |p: &Point| {
        let d = p.error(class)?;
        Some([100.0 * d.shown(), if d.resolved { 100.0 * d.error } else { f64::NAN }])
    };
    let series = groups(outcome, error);
    let title = format!("Error of {} against cost", class.name());
    let levels = outcome.tolerances.iter().filter(|t| t.name == class.name());
    let levels = levels.map(|t| (100.0 * t.bound, "tolerance".to_owned())).collect();
    (!series.is_empty()).then(|| plot(&title, format!("error of {}, %", class.name()), series, levels))
}

/// How sure the recommendation is.
fn decision(outcome: &Comparison) -> String {
    let margin = outcome.margin;
    if outcome.undecided.is_empty() {
        return format!(
            "This is decided: by {margin:.1} standard deviations, for all looks at all settings."
        );
    }
    let cost = |k: &usize| outcome.points[*k].cost.map_or(f64::INFINITY, |c| c.value);
    let cheapest = outcome.undecided.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let cheapest = cheapest.map(|k| &outcome.points[*k]);
    let name = cheapest.map_or_else(String::new, |p| format!("{}, dt = {}", p.name(), p.dt));
    format!(
        "Each error counts with two of its standard deviations. By the {margin:.1} that all looks at all settings ask for, {} \
         settings are not decided, the cheapest of them {name}; longer runs (--minutes) decide more.",
        outcome.undecided.len()
    )
}

pub fn recommendation(outcome: &Comparison) -> String {
    let within: Vec<String> = outcome.tolerances.iter().map(ToString::to_string).collect();
    let within = within.join(", ");
    let mut text = match &outcome.unresolved[..] {
        [] => String::new(),
        names => format!("Not judged, as most runs do not resolve 10 % of it: {}.\n\n", names.join(", ")),
    };
    let Some(best) = &outcome.recommended else {
        text += &format!("No setting has {within}. {}", decision(outcome));
        return text;
    };
    let point = &outcome.points[best.point];
    text += &format!(
        "The cheapest setting with {within}: {}, dt = {}, {} precision, {:.4} s per unit of simulated time. {}\n\n{}",
        point.name(),
        point.dt,
        point.precision,
        point.cost.as_ref().map_or(f64::NAN, |c| c.value),
        decision(outcome),
        best.scene
    );
    if let Some(refusal) = &best.lammps_refusal {
        text += &format!("\nNot in LAMMPS: {refusal}.\n");
    }
    match (&best.lammps, best.point_in_lammps.and_then(|k| outcome.points.get(k))) {
        (Some(lines), Some(p)) => {
            text += &format!("\nIn LAMMPS, {}, dt = {}:\n\n{lines}", p.integrator, p.dt);
        }
        (Some(lines), None) => text += &format!("\nIn LAMMPS the same steps, not timed there:\n\n{lines}"),
        (None, _) => text += "\nNo setting within the tolerances can be written for LAMMPS.\n",
    }
    text
}

pub fn explanation(outcome: &Comparison) -> String {
    let temperature = match outcome.temperature_is_known {
        true => "of the temperatures from kT",
        false => "of the kinetic temperature from that of the reference",
    };
    let dynamics = match &outcome.reference_of_dynamics {
        Some(r) => format!(", and those of D and eta from {}", r.what),
        None => String::new(),
    };
    format!(
        "Errors are in percent: of u and of temperatures in percent of kT, of pressures of ρkT, of densities of the liquid's, of \
         others of themselves. They are those {temperature}, of all else from the reference ({}, {} samples over {:.1} time \
         units or sweeps){dynamics}; the references' own errors are in their rows. ± is one standard deviation. \"<\" marks \
         an error that is smaller than twice its uncertainty; the number is an upper limit. \"worst\" is the error that is most of its tolerance. \
         p_carried is the pressure of the momentum flux, which walls and coexisting phases feel. Points of the plugin have the \
         errors of the native steps, which they are. Points of LAMMPS's own many-body style are another force law, compared \
         with small steps of its own; they are not on the front.",
        outcome.reference.what, outcome.reference.samples, outcome.reference.time
    )
}

pub fn report(outcome: &Comparison) -> Result<String, ExperimentError> {
    let mut plots = Vec::new();
    let all = Class::ALL.into_iter().map(|(_, class)| plot_of(outcome, class));
    for plot in std::iter::once(plot_of_worst(outcome)).chain(all).flatten() {
        let caption =
            "Points without a bar: the error was not resolved; it is probably below the value shown.";
        plots.push(Item::figure(&plot, caption)?);
    }
    let mut settings = vec![Item::Prose(explanation(outcome)), Item::Table(table(outcome))];
    settings.extend(outcome.left_out.iter().cloned().map(Item::Prose));
    let mut sections = vec![
        Section::new("Recommendation", vec![Item::Prose(recommendation(outcome))]),
        Section::new("Speed against error", plots),
        Section::new("All settings", settings),
    ];
    if !outcome.drifts.is_empty() {
        sections.push(Section::new("Energy without thermostat", vec![Item::Table(drifts(outcome))]));
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
