//! The content of `observables.json`: each observable as a number with its error, or as a plot.

use super::super::figure::field_of_values;
use super::super::text::typeset;
use super::super::{Plot, Series, Style, Table};
use super::{Item, Observation, Section, with_error};
use psidpd_observe::Kind;
use psidpd_observe::observation::Column;

/// A curve with more points is a line with a band; one with fewer is points with bars.
const SINGLE_POINTS: usize = 40;

pub fn section(observables: Option<&[Observation]>) -> Section {
    let heading = "Observables";
    let Some(all) = observables.filter(|o| !o.is_empty()) else {
        let text = match observables {
            None => "There is no observables.json: the scene asks for no observables.",
            Some(_) => "observables.json is empty.",
        };
        return Section::new(heading, vec![Item::prose(text)]);
    };
    let mut items =
        vec![Item::prose("Errors are one standard deviation of the mean; bands and bars show them.")];
    let scalars = scalar_table(all);
    if !scalars.rows.is_empty() {
        items.push(Item::Table(scalars));
    }
    for observable in all.iter().filter(|o| !is_scalar(o)) {
        if observable.x.is_some() {
            draw_curve(observable, &mut items);
        } else {
            draw_field(observable, &mut items);
        }
    }
    Section::new(heading, items)
}

fn scalar_table(all: &[Observation]) -> Table {
    let mut table = Table::new(["observable", "value ± error", "unit", "stage", "samples", "note"]);
    for o in all.iter().filter(|o| is_scalar(o)) {
        let samples = o.samples.to_string();
        if o.columns.is_empty() {
            table.push([
                label(o),
                "—".into(),
                String::new(),
                o.stage.clone(),
                samples.clone(),
                o.note.clone(),
            ]);
        }
        for (k, c) in o.columns.iter().enumerate() {
            let several = o.columns.len() > 1 || c.values.len() > 1;
            let label = if several { format!("{}: {}", label(o), c.name) } else { label(o) };
            let values: Vec<String> =
                c.values.iter().enumerate().map(|(i, v)| with_error(*v, c.errors.get(i).copied())).collect();
            let note = if k == 0 { o.note.clone() } else { String::new() };
            let value = if values.is_empty() { "—".into() } else { values.join(", ") };
            table.push([label, value, typeset(&c.unit), o.stage.clone(), samples.clone(), note]);
        }
    }
    use super::super::Align::{Left, Right};
    table.align = vec![Left, Right, Left, Left, Right, Left];
    table
}

fn is_scalar(o: &Observation) -> bool {
    o.x.is_none() && o.kind != Kind::Field
}

fn label(o: &Observation) -> String {
    if o.title.is_empty() { o.name.clone() } else { o.title.clone() }
}

fn caption(o: &Observation) -> String {
    let stage = if o.stage.is_empty() { String::new() } else { format!("Stage “{}”, ", o.stage) };
    format!("{stage}{} samples. {}", o.samples, o.note).trim().to_owned()
}

/// A name with its unit, unless it is a pure number.
fn named(name: &str, unit: &str) -> String {
    match unit {
        "" | "1" => name.to_owned(),
        unit => format!("{name} [{}]", typeset(unit)),
    }
}

fn figure(o: &Observation, plot: Result<String, super::ReportError>) -> Item {
    match plot {
        Ok(svg) => Item::Figure { svg, caption: caption(o) },
        Err(error) => Item::Prose(format!("{}: {error}", label(o))),
    }
}

const COORDINATES: [&str; 4] = ["x", "y", "z", "r"];

/// Draws values on a grid as a map, and other values as points.
fn draw_field(o: &Observation, items: &mut Vec<Item>) {
    let coordinates = o.columns.iter().take_while(|c| COORDINATES.contains(&c.name.as_str())).count();
    let [first, second, ..] = o.columns.as_slice() else {
        let error = super::ReportError::Plot("a field needs columns of coordinates".into());
        return items.push(figure(o, Err(error)));
    };
    let (xs, ys) = (&first.values, &second.values);
    let axes = [first, second].map(|c| named(&c.name, &c.unit));
    let grid = if coordinates == 2 { Grid::of(xs, ys) } else { None };
    let values = &o.columns[coordinates.clamp(1, 2)..];
    let Some(grid) = grid.filter(|_| !values.is_empty()) else {
        let series = with_errors(second, xs, "", Style::Points);
        return items.push(figure(o, Plot::new(label(o), axes, vec![series]).render()));
    };
    for c in values {
        let title = if values.len() > 1 { format!("{}: {}", label(o), c.name) } else { label(o) };
        let (values, label) = (grid.sort(&c.values), named(&c.name, &c.unit));
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

fn draw_curve(o: &Observation, items: &mut Vec<Item>) {
    let Some(x) = &o.x else { return };
    let mut push = |svg| items.push(figure(o, svg));
    // Each unit gets its own plot, because a shared axis would be meaningless.
    let unit_of = |c: &Column| if c.unit == "1" { String::new() } else { c.unit.clone() };
    let units = crate::distinct(o.columns.iter().map(unit_of));
    if units.is_empty() {
        push(Err(super::ReportError::Plot("there are no values".into())));
    }
    let is_line = o.kind == Kind::Series || x.values.len() > SINGLE_POINTS;
    let style = if is_line { Style::Line } else { Style::Points };
    for unit in &units {
        let columns: Vec<&Column> = o.columns.iter().filter(|c| unit_of(c) == *unit).collect();
        let single = columns.len() == 1;
        let y_label = if single { named(&columns[0].name, unit) } else { named("", unit).trim().to_owned() };
        let name = |c: &Column| if single { String::new() } else { c.name.clone() };
        let series = columns.iter().map(|c| with_errors(c, &x.values, name(c), style)).collect();
        push(Plot::new(label(o), [named(&x.name, &x.unit), y_label], series).render());
    }
}

/// A column against `x`, with its errors if it has any.
fn with_errors(c: &Column, x: &[f64], name: impl Into<String>, style: Style) -> Series {
    let errors = (!c.errors.is_empty()).then(|| c.errors.clone());
    Series { errors, ..Series::new(name, x.iter().copied().zip(c.values.iter().copied()).collect(), style) }
}

/// The outer edges of evenly spaced cells whose middles are given.
fn ends(values: &[f64]) -> [f64; 2] {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return [0.0, 1.0] };
    let half = if values.len() > 1 { 0.5 * (last - first) / (values.len() - 1) as f64 } else { 0.5 };
    [first - half, last + half]
}
