//! `observables.json`: each observable as a number with its error, or as a plot.

use super::super::figure::field_of_values;
use super::super::quantity::with_error;
use super::super::{Item, Plot, Section, Series, Style, Table};
use crate::output::OutputError;
use serde::Deserialize;
use std::path::Path;

/// An observable of a stage, as `observables.json` lists it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Observable {
    /// Its name, for machines.
    pub name: String,
    /// What it is, for people.
    #[serde(default)]
    pub title: String,
    /// The stage it was measured in.
    #[serde(default)]
    pub stage: String,
    /// scalar, profile, curve, series or field.
    #[serde(default)]
    pub kind: String,
    /// The abscissa; none for scalars.
    #[serde(default)]
    pub x: Option<ObservableAxis>,
    /// The second abscissa of a field; its values go row after row, x fastest.
    #[serde(default)]
    pub y: Option<ObservableAxis>,
    /// The values.
    #[serde(default)]
    pub columns: Vec<ObservableColumn>,
    /// How many samples they are means of.
    #[serde(default)]
    pub samples: Option<f64>,
    /// What else there is to know.
    #[serde(default)]
    pub note: Option<String>,
}

/// An abscissa.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ObservableAxis {
    /// What it is.
    pub name: String,
    /// Its unit; empty for a pure number.
    #[serde(default)]
    pub unit: Option<String>,
    /// Its values.
    pub values: Vec<Option<f64>>,
}

/// Values with errors.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ObservableColumn {
    /// What it is.
    pub name: String,
    /// Its unit; empty for a pure number.
    #[serde(default)]
    pub unit: Option<String>,
    /// The values; null where there is none.
    #[serde(deserialize_with = "one_or_many")]
    pub values: Vec<Option<f64>>,
    /// One standard deviation of each.
    #[serde(default, deserialize_with = "one_or_many")]
    pub errors: Vec<Option<f64>>,
}

/// A number counts as a list of one, null as an empty one.
fn one_or_many<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Vec<Option<f64>>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Values {
        Many(Vec<Option<f64>>),
        One(f64),
        None(()),
    }
    Ok(match Values::deserialize(from)? {
        Values::Many(many) => many,
        Values::One(one) => vec![Some(one)],
        Values::None(()) => Vec::new(),
    })
}

/// Reads the list; `None` if there is no such file.
pub fn read(path: &Path) -> Result<Option<Vec<Observable>>, OutputError> {
    let Some(text) = super::text(path)? else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|cause| OutputError::Json { path: path.to_owned(), cause })
}

/// More points than this are a line with a band, fewer are points with bars.
const SINGLE_POINTS: usize = 40;

pub fn section(observables: Option<&[Observable]>) -> Section {
    let heading = "Observables".to_owned();
    let Some(all) = observables.filter(|o| !o.is_empty()) else {
        let text = match observables {
            None => "There is no observables.json: the scene asks for no observables.",
            Some(_) => "observables.json is empty.",
        };
        return Section { heading, items: vec![Item::Prose(text.into())] };
    };
    let mut items = vec![Item::Prose(
        "Errors are one standard deviation of the mean; bands and bars show them.".to_owned(),
    )];
    let scalars = scalar_table(all);
    if !scalars.rows.is_empty() {
        items.push(Item::Table(scalars));
    }
    for observable in all.iter().filter(|o| o.x.is_some()) {
        draw(observable, &mut items);
    }
    Section { heading, items }
}

fn scalar_table(all: &[Observable]) -> Table {
    let mut table = Table::new(["observable", "value ± error", "unit", "stage", "samples", "note"]);
    for o in all.iter().filter(|o| o.x.is_none()) {
        if o.columns.is_empty() {
            let note = o.note.clone().unwrap_or_default();
            table.push([o.label(), "—".into(), String::new(), o.stage.clone(), o.samples(), note]);
        }
        for (k, c) in o.columns.iter().enumerate() {
            let several = o.columns.len() > 1 || c.values.len() > 1;
            let label = if several { format!("{}: {}", o.label(), c.name) } else { o.label() };
            let values: Vec<String> = c
                .values
                .iter()
                .enumerate()
                .map(|(i, v)| with_error(v.unwrap_or(f64::NAN), c.errors.get(i).copied().flatten()))
                .collect();
            let note = if k == 0 { o.note.clone().unwrap_or_default() } else { String::new() };
            let unit = c.unit.clone().unwrap_or_default();
            let value = if values.is_empty() { "—".into() } else { values.join(", ") };
            table.push([label, value, unit, o.stage.clone(), o.samples(), note]);
        }
    }
    use super::super::Align::{Left, Right};
    table.align = vec![Left, Right, Left, Left, Right, Left];
    table
}

impl Observable {
    fn label(&self) -> String {
        if self.title.is_empty() { self.name.clone() } else { self.title.clone() }
    }

    fn samples(&self) -> String {
        self.samples.map_or(String::new(), |n| n.to_string())
    }

    fn caption(&self) -> String {
        let mut parts = Vec::new();
        if !self.stage.is_empty() {
            parts.push(format!("Stage “{}”", self.stage));
        }
        if let Some(n) = self.samples {
            parts.push(format!("{n} samples"));
        }
        let mut caption = parts.join(", ");
        if !caption.is_empty() {
            caption.push('.');
        }
        if let Some(note) = self.note.as_deref().filter(|n| !n.is_empty()) {
            caption.push(' ');
            caption.push_str(note);
        }
        caption.trim().to_owned()
    }
}

fn named(name: &str, unit: Option<&String>) -> String {
    match unit.map(String::as_str) {
        None | Some("" | "1") => name.to_owned(),
        Some(unit) => format!("{name} [{unit}]"),
    }
}

fn draw(o: &Observable, items: &mut Vec<Item>) {
    let Some(x) = &o.x else { return };
    let mut push = |svg: Result<String, super::ReportError>| {
        items.push(match svg {
            Ok(svg) => Item::Figure { svg, caption: o.caption() },
            Err(error) => Item::Prose(format!("{}: {error}", o.label())),
        });
    };
    let numbers = |v: &[Option<f64>]| v.iter().map(|v| v.unwrap_or(f64::NAN)).collect::<Vec<f64>>();
    let xs = numbers(&x.values);
    if let Some(y) = &o.y {
        let ys = numbers(&y.values);
        for c in &o.columns {
            let values = numbers(&c.values);
            let title = if o.columns.len() > 1 { format!("{}: {}", o.label(), c.name) } else { o.label() };
            if values.len() != xs.len() * ys.len() || values.is_empty() {
                push(Err(super::ReportError::Plot(format!(
                    "{} values for {} by {} places",
                    values.len(),
                    xs.len(),
                    ys.len()
                ))));
                continue;
            }
            let axes = [named(&x.name, x.unit.as_ref()), named(&y.name, y.unit.as_ref())];
            let label = named(&c.name, c.unit.as_ref());
            let size = [xs.len(), ys.len()];
            push(field_of_values(&title, &label, axes, [ends(&xs), ends(&ys)], size, &values).render());
        }
        return;
    }
    // One plot for each unit: a shared axis would mean nothing.
    let mut units: Vec<Option<&String>> = Vec::new();
    for c in &o.columns {
        let unit = c.unit.as_ref().filter(|u| !u.is_empty() && *u != "1");
        if !units.contains(&unit) {
            units.push(unit);
        }
    }
    if units.is_empty() {
        push(Err(super::ReportError::Plot("there are no values".into())));
    }
    let style = match o.kind.as_str() {
        "series" => Style::Line,
        _ if xs.len() <= SINGLE_POINTS => Style::Points,
        _ => Style::Line,
    };
    for unit in &units {
        let of_unit = |c: &&ObservableColumn| c.unit.as_ref().filter(|u| !u.is_empty() && *u != "1") == *unit;
        let columns: Vec<&ObservableColumn> = o.columns.iter().filter(of_unit).collect();
        let single = columns.len() == 1;
        let y_label =
            if single { named(&columns[0].name, *unit) } else { named("", *unit).trim().to_owned() };
        let series = columns.iter().map(|c| Series {
            name: if single { String::new() } else { c.name.clone() },
            points: xs.iter().copied().zip(numbers(&c.values)).collect(),
            errors: (!c.errors.is_empty()).then(|| numbers(&c.errors)),
            style,
        });
        let plot = Plot {
            title: o.label(),
            x_label: named(&x.name, x.unit.as_ref()),
            y_label,
            series: series.collect(),
            ..Plot::default()
        };
        push(plot.render());
    }
}

/// The outer edges of evenly spaced cells whose middles are given.
fn ends(values: &[f64]) -> [f64; 2] {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return [0.0, 1.0] };
    let half = if values.len() > 1 { 0.5 * (last - first) / (values.len() - 1) as f64 } else { 0.5 };
    [first - half, last + half]
}
