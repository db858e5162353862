//! The content of `observables.json`: each observable as a number with its error, or as a plot.

use super::super::figure::field_of_values;
use super::super::quantity::with_error;
use super::super::text::typeset;
use super::super::{Item, Plot, Section, Series, Style, Table};
use psidpd_formats::FormatError;
use serde::Deserialize;
use std::path::Path;

/// An observable of a stage, as in `observables.json`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Observable {
    /// The name for machines.
    pub name: String,
    /// The name for people.
    #[serde(default)]
    pub title: String,
    #[serde(default)]
    pub stage: String,
    /// The kind is scalar, profile, curve, series or field.
    #[serde(default)]
    pub kind: String,
    /// The abscissa; `None` for scalars and fields.
    #[serde(default)]
    pub x: Option<ObservableAxis>,
    /// For a field the first columns are the coordinates of its points.
    #[serde(default)]
    pub columns: Vec<ObservableColumn>,
    /// The number of samples in the means.
    #[serde(default)]
    pub samples: Option<f64>,
    /// Remarks for readers.
    #[serde(default)]
    pub note: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ObservableAxis {
    pub name: String,
    /// The unit; empty for a pure number.
    #[serde(default)]
    pub unit: Option<String>,
    pub values: Vec<Option<f64>>,
}

/// Values with errors.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ObservableColumn {
    pub name: String,
    /// The unit; empty for a pure number.
    #[serde(default)]
    pub unit: Option<String>,
    /// Unknown values are null.
    #[serde(deserialize_with = "one_or_many")]
    pub values: Vec<Option<f64>>,
    /// One standard deviation of each value.
    #[serde(default, deserialize_with = "one_or_many")]
    pub errors: Vec<Option<f64>>,
}

/// Reads a single number as a list of one number, and null as an empty list.
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

/// Reads the list; `None` if the file does not exist.
pub fn read(path: &Path) -> Result<Option<Vec<Observable>>, FormatError> {
    let Some(text) = super::text(path)? else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|cause| FormatError::Json { path: path.to_owned(), cause })
}

/// A curve with more points is a line with a band; one with fewer is points with bars.
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
    for observable in all.iter().filter(|o| !o.is_scalar()) {
        if observable.x.is_some() {
            draw_curve(observable, &mut items);
        } else {
            draw_field(observable, &mut items);
        }
    }
    Section { heading, items }
}

fn scalar_table(all: &[Observable]) -> Table {
    let mut table = Table::new(["observable", "value ± error", "unit", "stage", "samples", "note"]);
    for o in all.iter().filter(|o| o.is_scalar()) {
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
            let unit = c.unit.as_deref().map_or(String::new(), typeset);
            let value = if values.is_empty() { "—".into() } else { values.join(", ") };
            table.push([label, value, unit, o.stage.clone(), o.samples(), note]);
        }
    }
    use super::super::Align::{Left, Right};
    table.align = vec![Left, Right, Left, Left, Right, Left];
    table
}

impl Observable {
    /// The value and error of a column, if the observable is a single number.
    pub fn scalar(&self, column: &str) -> Option<(f64, Option<f64>)> {
        let found = self.columns.iter().find(|c| self.is_scalar() && c.name == column)?;
        Some(((*found.values.first()?)?, found.errors.first().copied().flatten()))
    }

    fn is_scalar(&self) -> bool {
        self.x.is_none() && self.kind != "field"
    }

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
        Some(unit) => format!("{name} [{}]", typeset(unit)),
    }
}

fn numbers(values: &[Option<f64>]) -> Vec<f64> {
    values.iter().map(|v| v.unwrap_or(f64::NAN)).collect()
}

fn figure(o: &Observable, svg: Result<String, super::ReportError>) -> Item {
    match svg {
        Ok(svg) => Item::Figure { svg, caption: o.caption() },
        Err(error) => Item::Prose(format!("{}: {error}", o.label())),
    }
}

/// Names that mark leading columns as coordinates.
const COORDINATES: [&str; 4] = ["x", "y", "z", "r"];

/// Draws values on a grid as a map, and other values as points.
fn draw_field(o: &Observable, items: &mut Vec<Item>) {
    let coordinates = o.columns.iter().take_while(|c| COORDINATES.contains(&c.name.as_str())).count();
    let [first, second, ..] = o.columns.as_slice() else {
        let error = super::ReportError::Plot("a field needs columns of coordinates".into());
        return items.push(figure(o, Err(error)));
    };
    let (xs, ys) = (numbers(&first.values), numbers(&second.values));
    let axes = [first, second].map(|c| named(&c.name, c.unit.as_ref()));
    let grid = if coordinates == 2 { Grid::of(&xs, &ys) } else { None };
    let values = &o.columns[coordinates.clamp(1, 2)..];
    let Some(grid) = grid.filter(|_| !values.is_empty()) else {
        let series = Series {
            name: String::new(),
            points: xs.into_iter().zip(ys).collect(),
            errors: (!second.errors.is_empty()).then(|| numbers(&second.errors)),
            style: Style::Points,
        };
        let [x_label, y_label] = axes;
        let plot = Plot { title: o.label(), x_label, y_label, series: vec![series], ..Plot::default() };
        return items.push(figure(o, plot.render()));
    };
    for c in values {
        let title = if values.len() > 1 { format!("{}: {}", o.label(), c.name) } else { o.label() };
        let (values, label) = (grid.sort(&numbers(&c.values)), named(&c.name, c.unit.as_ref()));
        let size = [grid.x.len(), grid.y.len()];
        let ranges = [ends(&grid.x), ends(&grid.y)];
        let map = field_of_values(&title, &label, axes.clone(), ranges, size, &values);
        items.push(figure(o, map.render()));
    }
}

/// Points that are all the crossings of vertical and horizontal lines.
struct Grid {
    x: Vec<f64>,
    y: Vec<f64>,
    /// The index of each point in the picture: row after row, the lowest row first.
    place: Vec<usize>,
}

impl Grid {
    fn of(xs: &[f64], ys: &[f64]) -> Option<Grid> {
        let distinct = |values: &[f64]| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let (x, y) = (distinct(xs), distinct(ys));
        if xs.len() != ys.len() || xs.len() != x.len() * y.len() || x.len() < 2 || y.len() < 2 {
            return None;
        }
        let at = |of: &[f64], v: &f64| of.binary_search_by(|a| a.total_cmp(v)).ok();
        let place: Option<Vec<usize>> =
            xs.iter().zip(ys).map(|(a, b)| Some(at(&y, b)? * x.len() + at(&x, a)?)).collect();
        Some(Grid { x, y, place: place? })
    }

    fn sort(&self, values: &[f64]) -> Vec<f64> {
        let mut sorted = vec![f64::NAN; self.place.len()];
        for (place, value) in self.place.iter().zip(values) {
            sorted[*place] = *value;
        }
        sorted
    }
}

fn draw_curve(o: &Observable, items: &mut Vec<Item>) {
    let Some(x) = &o.x else { return };
    let mut push = |svg| items.push(figure(o, svg));
    let xs = numbers(&x.values);
    // Each unit gets its own plot, because a shared axis would be meaningless.
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
