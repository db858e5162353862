//! The results of a sweep: a table for other programs, and a page.

use super::{Axis, Point};
use psidpd_report::quantity::with_error;
use psidpd_report::{Item, Plot, Report, ReportError, Section, Series, Style, Table, distinct, named};

/// Names of the results that any run has, in the order in which they come first. A key whose values are given, such as the
/// density, is not a result.
fn quantities(axes: &[Axis], points: &[Point]) -> Vec<String> {
    let given = |name: &String| axes.iter().any(|a| a.key == *name);
    let names = points.iter().flat_map(|p| &p.headline.values).map(|value| value.name.clone());
    distinct(names.filter(|name| !given(name)))
}

/// A row for each run: the keys, each result with its error, whether it is finished, and how many notes there are.
pub fn csv(axes: &[Axis], points: &[Point]) -> String {
    let names = quantities(axes, points);
    let mut header: Vec<String> = axes.iter().map(|a| quoted(&a.key)).collect();
    header.extend(names.iter().flat_map(|n| [n.clone(), format!("{n}_error")]));
    header.extend(["finished", "notes", "folder"].map(String::from));
    let mut text = header.join(",") + "\n";
    for p in points {
        let mut row: Vec<String> = p.edits.iter().map(|e| quoted(e.value())).collect();
        for name in &names {
            let value = p.headline.get(name);
            row.push(value.map_or(String::new(), |v| format!("{:?}", v.value)));
            row.push(value.and_then(|v| v.error).map_or(String::new(), |e| format!("{e:?}")));
        }
        row.push(p.finished.to_string());
        row.push(p.headline.notes.len().to_string());
        row.push(quoted(&folder_name(p)));
        text += &(row.join(",") + "\n");
    }
    text
}

pub(super) fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

fn folder_name(p: &Point) -> String {
    p.folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

pub fn table(axes: &[Axis], points: &[Point]) -> Table {
    let names = quantities(axes, points);
    let keys = axes.iter().map(|a| a.key.clone());
    let mut table = Table::new(keys.chain(names.iter().cloned()).chain(["notes".to_owned()]));
    for p in points {
        let mut row: Vec<String> = p.edits.iter().map(|e| e.value().to_owned()).collect();
        row.extend(
            names.iter().map(|n| p.headline.get(n).map_or(String::new(), |v| with_error(v.value, v.error))),
        );
        row.push(match (&p.error, p.finished, p.headline.notes.len()) {
            (Some(_), _, _) => "failed".into(),
            (None, false, _) => "stopped".into(),
            (None, true, 0) => String::new(),
            (None, true, n) => n.to_string(),
        });
        table.push(row);
    }
    table
}

pub fn page(title: &str, axes: &[Axis], points: &[Point]) -> Result<Report, ReportError> {
    let mut sections = vec![Section::new("Results", vec![Item::Table(table(axes, points))])];
    let mut plots = Vec::new();
    if let Some(x) = axes.iter().position(Axis::is_numeric) {
        for name in quantities(axes, points) {
            let plot = plot(&name, x, axes, points);
            plots.push(Item::figure(&plot, "Bars are one standard deviation.")?);
        }
    }
    if !plots.is_empty() {
        sections.push(Section::new("Plots", plots));
    }
    let mut notes = Table::new(["run", "note"]);
    for p in points {
        p.error.iter().chain(&p.headline.notes).for_each(|n| notes.push([folder_name(p), n.clone()]));
    }
    if !notes.rows.is_empty() {
        sections.push(Section::new("Before you use them", vec![Item::Table(notes)]));
    }
    let values = |a: &Axis| a.edits.iter().map(|e| e.value().to_owned()).collect::<Vec<_>>().join(", ");
    let mut facts: Vec<(String, String)> = axes.iter().map(|a| (a.key.clone(), values(a))).collect();
    let finished = points.iter().filter(|p| p.finished).count();
    facts.push(("runs".into(), format!("{finished} of {} finished", points.len())));
    Ok(Report { title: title.into(), subtitle: "psidpd sweep".into(), facts, sections, ..Report::default() })
}

/// One result against the axis `x`, a series for each combination of the values of the others.
fn plot<'a>(name: &str, x: usize, axes: &[Axis], points: &'a [Point]) -> Plot {
    let others = |p: &Point| {
        let others = p.edits.iter().enumerate().filter(|(k, _)| *k != x).map(|(_, e)| e.to_string());
        others.collect::<Vec<_>>().join(", ")
    };
    let value = |p: &'a Point| Some((others(p), p.edits[x].number()?, p.headline.get(name)?));
    let found: Vec<_> = points.iter().filter_map(value).collect();
    let of = |others: &String| {
        let these = || found.iter().filter(move |(of, ..)| of == others);
        let errors = these().map(|(.., v)| v.error.unwrap_or(f64::NAN)).collect();
        let points = these().map(|(_, at, v)| (*at, v.value)).collect();
        Series::new(others, points, Style::Points).with_errors(errors)
    };
    let mut series: Vec<Series> =
        distinct(found.iter().map(|(others, ..)| others)).into_iter().map(of).collect();
    let mut theory: Vec<_> = found.iter().filter_map(|(_, at, v)| Some((*at, v.mean_field?))).collect();
    let unit = found.last().map_or("", |(.., v)| v.unit.as_str());
    // Beside a single series, theory is one curve.
    if series.len() == 1 && theory.len() > 1 {
        theory.sort_by(|a, b| a.0.total_cmp(&b.0));
        series[0].name = "measured".into();
        series.push(Series::new("mean field", theory, Style::Dashed));
    }
    Plot::new(name, [axes[x].key.clone(), named(name, unit)], series)
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_report::{Headline, HeadlineValue};

    /// A density that the sweep sets is one column; what the runs measured are the others, with their errors.
    #[test]
    fn a_key_is_not_a_result_too() {
        let value = |name: &str, value, error| HeadlineValue {
            name: name.into(),
            value,
            error,
            unit: "1/length^3".into(),
            source: String::new(),
            mean_field: None,
            published: None,
        };
        let axes: Vec<Axis> = vec!["density=3,4".parse().unwrap()];
        let point = |k: usize| Point {
            edits: vec![axes[0].edits[k].clone()],
            folder: format!("run-{k}").into(),
            headline: Headline {
                values: vec![value("density", 3.0 + k as f64, None), value("viscosity", 0.8, Some(0.1))],
                notes: Vec::new(),
            },
            error: None,
            finished: true,
        };
        let points = [point(0), point(1)];
        let table = csv(&axes, &points);
        let header = table.lines().next().unwrap();
        assert_eq!(header, "density,viscosity,viscosity_error,finished,notes,folder");
        assert_eq!(table.lines().nth(2).unwrap(), "4,0.8,0.1,true,0,run-1");
        let page = page("t", &axes, &points).unwrap().render();
        assert!(page.contains("viscosity [1/length³]") && !page.contains("density [1/length"), "{page}");
    }
}
