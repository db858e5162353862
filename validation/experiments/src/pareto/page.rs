//! Results as tables, plots and a page.

use super::outcome::{Comparison, Point, Reference};
use super::quantity::{Class, Deviation};
use super::tolerance::Tolerance;
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
        Host::Plugin => "psidpd in LAMMPS".to_owned(),
        Host::Lammps => "LAMMPS's own style".to_owned(),
    }
}

/// An error as it is drawn: its place, its bar, and whether it is an upper limit.
struct Drawn {
    at: f64,
    bar: f64,
    is_limit: bool,
}

/// Points of error against cost, in groups, with their time steps; errors are in percent or in units of a tolerance.
fn groups(outcome: &Comparison, error: impl Fn(&Point) -> Option<Drawn>) -> Vec<Series> {
    let place = |p: &Point| Some((p.cost.as_ref()?.value, error(p)?.at));
    let shown: Vec<&Point> = outcome.points.iter().filter(|p| place(p).is_some()).collect();
    let series = |name: String| {
        let own: Vec<&&Point> = shown.iter().filter(|p| group(p) == name).collect();
        let points = own.iter().filter_map(|p| place(p)).collect();
        let drawn: Vec<Drawn> = own.iter().filter_map(|p| error(p)).collect();
        Series::new(name, points, Style::Points)
            .with_errors(drawn.iter().map(|e| e.bar).collect())
            .with_limits(drawn.iter().map(|e| e.is_limit).collect())
            .with_notes(own.iter().map(|p| p.dt.to_string()).collect())
    };
    distinct(shown.iter().map(|p| group(p))).into_iter().map(series).collect()
}

fn plot(title: &str, y_label: String, series: Vec<Series>, levels: Vec<(f64, String)>) -> Plot {
    let labels = ["wall time per unit of simulated time [s]".to_owned(), y_label];
    Plot { log_x: true, log_y: true, levels, ..Plot::new(title, labels, series) }
}

/// The worst error of every setting against its cost; the front is a line.
fn plot_of_worst(outcome: &Comparison) -> Option<Plot> {
    let error = |p: &Point| {
        let worst = p.worst.as_ref()?;
        let is_limit = p.errors.iter().any(|d| d.name == worst.quantity && !d.resolved);
        Some(Drawn { at: worst.ratio, bar: f64::NAN, is_limit })
    };
    let mut series = groups(outcome, error);
    if series.is_empty() {
        return None;
    }
    let mut front: Vec<&Point> = outcome.points.iter().filter(|p| p.front).collect();
    let cost = |p: &Point| p.cost.as_ref().map_or(f64::INFINITY, |c| c.value);
    front.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let points = front.iter().map(|p| (cost(p), error(p).map_or(f64::NAN, |e| e.at))).collect();
    let steps = front.iter().map(|p| p.dt.to_string()).collect();
    series.push(Series::new("front", points, Style::Line).with_notes(steps));
    let label = "worst error over its tolerance".to_owned();
    Some(plot("Worst error against cost", label, series, vec![(1.0, "tolerance".into())]))
}

/// Error against cost for one kind of quantity. The pressure that LAMMPS prints, which is too noisy, is not judged unless it was asked for.
pub(super) fn plot_of(outcome: &Comparison, class: Class) -> Option<Plot> {
    let is_judged = |d: &&Deviation| {
        d.class == class && (d.name != "p_total" || outcome.tolerances.iter().any(|t| t.name == d.name))
    };
    let error = |p: &Point| {
        let d = p.errors.iter().filter(is_judged).max_by(|a, b| a.shown().total_cmp(&b.shown()))?;
        let bar = if d.resolved { 100.0 * d.error } else { f64::NAN };
        Some(Drawn { at: 100.0 * d.shown(), bar, is_limit: !d.resolved })
    };
    let series = groups(outcome, error);
    let judged = outcome.points.iter().flat_map(|p| &p.errors).filter(is_judged);
    let names = distinct(judged.map(|d| d.name.clone()));
    let bounds = outcome.tolerances.iter().filter(|t| t.name == class.name() || names.contains(&t.name));
    let bounds: Vec<_> = bounds.collect();
    let same = bounds.iter().all(|t| t.bound == bounds[0].bound);
    let name = |t: &Tolerance| match same {
        true => "tolerance".to_owned(),
        false => format!("tolerance of {}, {} %", t.name, (1e6 * t.bound).round() / 1e4),
    };
    let levels = bounds.iter().take(if same { 1 } else { usize::MAX });
    let levels = levels.map(|t| (100.0 * t.bound, name(t))).collect();
    let [words, unit] = class.words();
    let of_which = if names.len() > 1 { "largest error" } else { "error" };
    let label = format!("{of_which} of the {words} [{unit}]");
    (!series.is_empty()).then(|| plot(&format!("Error of the {words}"), label, series, levels))
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
    let open = match outcome.undecided.len() {
        1 => format!("one setting is not decided, {name}"),
        n => format!("{n} settings are not decided, the cheapest of them {name}"),
    };
    format!(
        "Each error counts with two of its standard deviations. By the {margin:.1} that all looks at all settings ask for, \
         {open}; longer runs (--minutes) decide more."
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
    let what = "Numbers are time steps Δt, where there is room for them; the table has all. An arrow: the error is not resolved, and \
                is probably below the point.";
    let worst = "Of each setting the error that is the largest multiple of its tolerance. Front: nothing cheaper has a smaller one.";
    if let Some(plot) = plot_of_worst(outcome) {
        plots.push(Item::figure(&plot, format!("{worst} {what}"))?);
    }
    for plot in Class::ALL.into_iter().filter_map(|(_, class)| plot_of(outcome, class)) {
        plots.push(Item::figure(&plot, what)?);
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
