//! The content of `observables.json`: each observable as a number with its error, or as a plot.

use super::super::figure::{Figure, Outline, field_of_values};
use super::super::text::{named, typeset};
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
            draw_curve(observable, all, &mut items);
        } else {
            draw_field(observable, all, &mut items);
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

fn figure(o: &Observation, plot: Result<String, super::ReportError>) -> Item {
    match plot {
        Ok(svg) => Item::Figure { svg, caption: caption(o) },
        Err(error) => Item::Prose(format!("{}: {error}", label(o))),
    }
}

const COORDINATES: [&str; 5] = ["x", "y", "z", "r", "height"];

const WHITE: [u8; 3] = [255; 3];
const RED: [u8; 3] = [0xFF, 0x5A, 0x36];

/// The surface in the field of a drop, and of a drop on a wall the circle that was fitted, as lines over the field, with what
/// they are.
fn surfaces(o: &Observation, all: &[Observation]) -> (Vec<Outline>, String) {
    let Some(drop) = o.name.strip_suffix("_field") else { return (Vec::new(), String::new()) };
    let of = |name: &str| all.iter().find(|other| other.name == name && other.stage == o.stage);
    let Some((heights, radii)) =
        of(&format!("{drop}_profile")).and_then(|p| Some((p.x.as_ref()?, p.get("radius")?)))
    else {
        return (Vec::new(), String::new());
    };
    let points = radii.values.iter().copied().zip(heights.values.iter().copied());
    let points = points.filter(|p| p.0.is_finite()).collect();
    let mut lines = vec![Outline { colour: WHITE, dashed: false, points }];
    let mut caption = "White: the surface.".to_owned();
    if let Some(points) = circle(drop, o, all) {
        lines.push(Outline { colour: RED, dashed: true, points });
        caption += " Red, dashed: the fitted circle.";
    }
    (lines, caption)
}

/// The circle that was fitted to a drop on a wall, from its top to the wall's surface, as distances from the vertical and
/// heights above the surface.
fn circle(drop: &str, o: &Observation, all: &[Observation]) -> Option<Vec<(f64, f64)>> {
    let fit = all.iter().find(|other| other.name == drop && other.stage == o.stage)?;
    let [angle, radius] = ["angle", "radius"].map(|column| fit.scalar(column).map(|found| found.value));
    let (angle, radius) = (angle?.to_radians(), radius?);
    let at = |k: u32| {
        let turned = angle * f64::from(k) / 120.0;
        (radius * turned.sin(), radius * (turned.cos() - angle.cos()))
    };
    (angle.is_finite() && radius.is_finite()).then(|| (0..=120).map(at).collect())
}

/// Draws values on a grid as a map, and other values as points.
fn draw_field(o: &Observation, all: &[Observation], items: &mut Vec<Item>) {
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
        let (lines, told) = surfaces(o, all);
        let map = Figure { lines, ..field_of_values(&title, &label, axes.clone(), ranges, size, &values) };
        let mut item = figure(o, map.render());
        if let Item::Figure { caption, .. } = &mut item {
            *caption = format!("{caption} {told}").trim().to_owned();
        }
        items.push(item);
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

fn draw_curve(o: &Observation, all: &[Observation], items: &mut Vec<Item>) {
    let Some(x) = &o.x else { return };
    let mut push = |svg| items.push(figure(o, svg));
    // Each unit gets its own plot, because a shared axis would be meaningless.
    // So does a number of drops, which is far from their sizes.
    let unit_of = |c: &Column| if c.unit == "1" { String::new() } else { c.unit.clone() };
    let group = |c: &Column| (unit_of(c), c.name == "count");
    let groups = crate::distinct(o.columns.iter().map(group));
    if groups.is_empty() {
        push(Err(super::ReportError::Plot("there are no values".into())));
    }
    let is_line = o.kind == Kind::Series || x.values.len() > SINGLE_POINTS;
    let style = if is_line { Style::Line } else { Style::Points };
    for of in &groups {
        let unit = &of.0;
        let columns: Vec<&Column> = o.columns.iter().filter(|c| group(c) == *of).collect();
        let single = columns.len() == 1;
        let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
        let y_label = if names.len() <= 3 { named(&names.join(", "), unit) } else { named(&label(o), unit) };
        let name = |c: &Column| if single { String::new() } else { c.name.clone() };
        let mut series: Vec<Series> =
            columns.iter().map(|c| with_errors(c, &x.values, name(c), style)).collect();
        // The outline of a drop stands upright; errors of its radius are in the table.
        let upright = x.name == "height";
        if upright {
            for outline in &mut series {
                outline.points.iter_mut().for_each(|point| *point = (point.1, point.0));
                outline.errors = None;
            }
        }
        if upright && let Some(points) = o.name.strip_suffix("_profile").and_then(|drop| circle(drop, o, all))
        {
            series[0].name = "measured".into();
            series.push(Series::new("fitted circle", points, Style::Dashed));
        }
        let shares = columns.iter().all(|c| c.name.starts_with("fraction_"));
        let bounds = shares.then_some([0.0, 1.0]);
        let mut labels = [named(&x.name, &x.unit), y_label];
        if upright {
            labels.reverse();
        }
        let plot = Plot { bounds, ..Plot::new(label(o), labels, series) };
        push(plot.render());
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
