//! Plots of data as SVG, drawn by plotters.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::chart::{Chart, Fallible, GREY, INK, LEFT, SMALL, chart, font, note, pen, px, svg};
use super::scale::Scale;
use super::text::{fit, one_line, width};
use psidpd_pictures::colour;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A line; errors appear as a band.
    #[default]
    Line,
    /// Markers; errors appear as bars.
    Points,
    /// A dashed line; errors appear as a band.
    Dashed,
    /// A thin pale line, for single values behind their mean.
    Faint,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// The name in the legend. A series without a name is not in the legend.
    pub name: String,
    /// Points that are not finite, and points that are not positive on a logarithmic axis, are skipped and interrupt a line.
    pub points: Vec<(f64, f64)>,
    /// The errors of the ordinates. Missing, negative and non-finite errors are not drawn.
    pub errors: Option<Vec<f64>>,
    pub style: Style,
    /// The number of its colour, such as that of a series that belongs to it; its place in the plot if left out.
    pub colour: Option<usize>,
}

/// A plot with linear or logarithmic axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    /// Series are drawn in this order.
    pub series: Vec<Series>,
    pub log_x: bool,
    pub log_y: bool,
    /// Horizontal reference lines with labels.
    pub levels: Vec<(f64, String)>,
    /// Vertical reference lines, such as the ends of stages, with labels above the plot.
    pub marks: Vec<(f64, String)>,
    /// What the ordinates cannot be beyond, such as 0 and 1 of fractions: bars and bands end there.
    pub bounds: Option<[f64; 2]>,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;
/// The room for the title, for a row of the legend and for the sample before a name, in pixels.
const TITLE: f64 = 30.0;
const ROW: f64 = 18.0;
const SAMPLE: f64 = 24.0;
/// The largest room for a name, in pixels.
const NAME: f64 = 260.0;

fn colour_of(k: usize) -> RGBColor {
    let [r, g, b] = colour::of_species(k);
    RGBColor(r, g, b)
}

impl Series {
    /// Points without errors.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>, style: Style) -> Series {
        Series { name: name.into(), points, errors: None, style, colour: None }
    }

    pub fn with_errors(self, errors: Vec<f64>) -> Series {
        Series { errors: Some(errors), ..self }
    }

    /// The error of a point, if it can be drawn.
    fn error(&self, index: usize) -> Option<f64> {
        let error = *self.errors.as_ref()?.get(index)?;
        (error.is_finite() && error > 0.0).then_some(error)
    }
}

/// A point that can be shown, and the lower and upper end of its error bar.
#[derive(Clone, Copy)]
struct Shown {
    at: (f64, f64),
    low: f64,
    high: f64,
}

impl Plot {
    pub fn new(title: impl Into<String>, labels: [impl Into<String>; 2], series: Vec<Series>) -> Plot {
        let [x_label, y_label] = labels.map(Into::into);
        Plot { title: title.into(), x_label, y_label, series, ..Plot::default() }
    }

    /// Draws the plot as an SVG document without prolog, fit for embedding.
    pub fn render(&self) -> Result<String, ReportError> {
        let [x, y] = &self.scales();
        let (legend, rows) = self.legend();
        let below = TITLE + ROW * rows as f64;
        let top = below + if self.marks.is_empty() { 6.0 } else { 22.0 };
        svg(&self.title, [WIDTH, HEIGHT + ROW * rows as f64], "", |area| {
            for (at, name, sample) in legend {
                let [left, middle] = [px(at[0]), px(at[1])];
                // A marker stands in the middle of the room that a line fills.
                let marker = matches!(sample, Sample::Series(_, Style::Points));
                let from = left + if marker { px(0.5 * SAMPLE) } else { 0 };
                area.draw(&sample.element([(from, middle), (left + px(SAMPLE), middle)]))?;
                area.draw(&Text::new(
                    one_line(&name),
                    (left + px(SAMPLE + 6.0), middle),
                    font(SMALL, INK).pos(Pos::new(HPos::Left, VPos::Center)),
                ))?;
            }
            let mut chart = chart(area, [top, 20.0], [&self.x_label, &self.y_label], [x, y], true)?;
            let runs: Vec<_> = self.series.iter().map(|s| self.runs(s, x, y)).collect();
            // Errors are drawn behind all data.
            for (k, (series, runs)) in self.series.iter().zip(&runs).enumerate() {
                draw_errors(&mut chart, series.colour.unwrap_or(k), series, runs)?;
            }
            self.draw_references(&mut chart, x, y)?;
            for (k, (series, runs)) in self.series.iter().zip(&runs).enumerate() {
                draw_series(&mut chart, series.colour.unwrap_or(k), series, runs)?;
            }
            Ok(())
        })
    }

    /// The entries of the legend, in rows above the chart, where they cover no data, and the number of rows.
    fn legend(&self) -> (Vec<([f64; 2], String, Sample)>, usize) {
        let levels = self.levels.iter().filter(|(level, _)| level.is_finite());
        let series = self
            .series
            .iter()
            .enumerate()
            .map(|(k, s)| (&s.name, Sample::Series(s.colour.unwrap_or(k), s.style)));
        let entries = series.chain(levels.map(|(_, name)| (name, Sample::Level)));
        let (mut placed, mut rows, mut free) = (Vec::new(), 0, f64::INFINITY);
        for (name, sample) in entries {
            let name = fit(name, SMALL, NAME);
            if name.trim().is_empty() {
                continue;
            }
            let room = SAMPLE + 6.0 + width(&name, SMALL);
            if free + room > WIDTH - 20.0 {
                (rows, free) = (rows + 1, LEFT);
            }
            placed.push(([free, TITLE + ROW * (rows as f64 - 0.5)], name, sample));
            free += room + 18.0;
        }
        (placed, rows)
    }

    /// Axes with room for all visible points. A point that cannot be shown must not widen the other axis.
    fn scales(&self) -> [Scale; 2] {
        let finite = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
        let mut xs: Vec<f64> = self.marks.iter().map(|mark| mark.0).collect();
        let mut ys: Vec<f64> = self.levels.iter().map(|level| level.0).collect();
        for series in &self.series {
            for (k, &(x, y)) in series.points.iter().enumerate() {
                if finite(x, self.log_x) && finite(y, self.log_y) {
                    let error = series.error(k).unwrap_or(0.0);
                    let [low, high] = self.within(y, error);
                    xs.push(x);
                    ys.extend([low, y, high]);
                }
            }
        }
        [Scale::around(xs.into_iter(), self.log_x), Scale::around(ys.into_iter(), self.log_y)]
    }

    /// The ends of the error bar of an ordinate.
    fn within(&self, y: f64, error: f64) -> [f64; 2] {
        let [least, most] = self.bounds.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        [(y - error).max(least.min(y)), (y + error).min(most.max(y))]
    }

    /// Uninterrupted runs of points that can be shown.
    fn runs(&self, series: &Series, x: &Scale, y: &Scale) -> Vec<Vec<Shown>> {
        let shown = |(k, &(a, b)): (usize, &(f64, f64))| {
            let at = (x.clamp(a)?, y.clamp(b)?);
            let error = series.error(k).unwrap_or(0.0);
            let [low, high] = self.within(b, error);
            let (low, high) = (y.clamp(low).unwrap_or(y.ends().0), y.clamp(high).unwrap_or(y.ends().1));
            Some(Shown { at, low, high })
        };
        let points: Vec<Option<Shown>> = series.points.iter().enumerate().map(shown).collect();
        points
            .split(Option::is_none)
            .filter(|run| !run.is_empty())
            .map(|run| run.iter().flatten().copied().collect())
            .collect()
    }

    /// Draws horizontal lines, whose names are in the legend, and vertical lines with names above them if there is room.
    fn draw_references(&self, chart: &mut Chart, x: &Scale, y: &Scale) -> Fallible {
        let (across, up) = (x.ends(), y.ends());
        for (level, _) in self.levels.iter().filter(|(level, _)| y.clamp(*level).is_some()) {
            chart.draw_series([Sample::Level.element([(across.0, *level), (across.1, *level)])])?;
        }
        let mut free = f64::NEG_INFINITY;
        let mut marks: Vec<_> = self.marks.iter().filter(|(mark, _)| x.clamp(*mark).is_some()).collect();
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (mark, name) in marks {
            chart.draw_series([Sample::Level.element([(*mark, up.0), (*mark, up.1)])])?;
            let at = chart.backend_coord(&(*mark, up.1)).0 as f64 / px(1.0) as f64;
            let name = fit(name, SMALL, NAME);
            if at > free {
                free = at + width(&name, SMALL) + 6.0;
                chart.draw_series([note(&name, (*mark, up.1))])?;
            }
        }
        Ok(())
    }
}

/// Draws a band along a line, and bars at single points.
fn draw_errors(chart: &mut Chart, k: usize, series: &Series, runs: &[Vec<Shown>]) -> Fallible {
    let colour = colour_of(k);
    for run in runs {
        if series.style == Style::Points || run.len() == 1 {
            let bar = |s: &Shown| {
                ErrorBar::new_vertical(s.at.0, s.low, s.at.1, s.high, pen(colour, 1.2), px(6.0) as u32)
            };
            chart.draw_series(run.iter().filter(|s| s.low < s.high).map(bar))?;
        } else if run.iter().any(|s| s.low < s.high) {
            let upper = run.iter().map(|s| (s.at.0, s.high));
            let outline: Vec<_> = upper.chain(run.iter().rev().map(|s| (s.at.0, s.low))).collect();
            chart.draw_series([Polygon::new(outline, colour.mix(0.18).filled())])?;
        }
    }
    Ok(())
}

fn draw_series(chart: &mut Chart, k: usize, series: &Series, runs: &[Vec<Shown>]) -> Fallible {
    let (colour, line) = (colour_of(k), line_of(k, series.style));
    let mut elements = Vec::new();
    for run in runs {
        let path: Vec<(f64, f64)> = run.iter().map(|s| s.at).collect();
        match (series.style, path.as_slice()) {
            (Style::Points, path) => elements.extend(path.iter().map(|at| marker(k, *at))),
            (_, &[at]) => elements.push(Circle::new(at, px(2.0), colour.filled()).into_dyn()),
            (style, _) => elements.push(stroke(path, style, line)),
        }
    }
    chart.draw_series(elements)?;
    Ok(())
}

fn line_of(k: usize, style: Style) -> ShapeStyle {
    match style {
        Style::Faint => pen(colour_of(k).mix(0.55), 1.0),
        _ => pen(colour_of(k), 1.8),
    }
}

/// What stands before a name in the legend.
#[derive(Clone, Copy)]
enum Sample {
    Series(usize, Style),
    /// A dotted reference line.
    Level,
}

impl Sample {
    /// A line between two points, or the marker of a series between them.
    fn element<'a, Part: Copy + 'static>(
        self,
        ends: [(Part, Part); 2],
    ) -> DynElement<'static, SVGBackend<'a>, (Part, Part)> {
        match self {
            Sample::Level => DashedPathElement::new(ends, px(2.0), px(3.0), pen(GREY, 1.2)).into_dyn(),
            Sample::Series(k, Style::Points) => marker(k, ends[0]),
            Sample::Series(k, style) => stroke(ends.to_vec(), style, line_of(k, style)),
        }
    }
}

fn stroke<'a, At: Clone + 'static>(
    path: Vec<At>,
    style: Style,
    line: ShapeStyle,
) -> DynElement<'static, SVGBackend<'a>, At> {
    match style {
        Style::Dashed => DashedPathElement::new(path, px(7.0), px(4.0), line).into_dyn(),
        _ => PathElement::new(path, line).into_dyn(),
    }
}

/// A marker. Its shape depends on `k` too, so that series differ in more than colour.
fn marker<'a, At: Clone + 'static>(k: usize, at: At) -> DynElement<'static, SVGBackend<'a>, At> {
    let fill = colour_of(k).filled();
    match k % 4 {
        0 => Circle::new(at, px(3.2), fill).into_dyn(),
        1 => TriangleMarker::new(at, px(4.0), fill).into_dyn(),
        2 => Cross::new(at, px(3.0), pen(colour_of(k), 1.8)).into_dyn(),
        _ => Circle::new(at, px(3.0), pen(colour_of(k), 1.4)).into_dyn(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texts(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let nodes = document.descendants().filter(|n| n.has_tag_name(("http://www.w3.org/2000/svg", "text")));
        nodes.filter_map(|n| n.text().map(|t| t.trim().to_owned())).collect()
    }

    #[test]
    fn series_that_belong_together_share_a_colour() {
        let line = |colour, style| Series { colour, ..Series::new("s", vec![(0.0, 0.0), (1.0, 1.0)], style) };
        let second = |shared: Option<usize>| {
            let series = vec![line(None, Style::Line), line(shared, Style::Dashed)];
            let svg = Plot::new("t", ["x", "y"], series).render().unwrap().to_lowercase();
            let [r, g, b] = colour::of_species(1);
            svg.contains(&format!("#{r:02x}{g:02x}{b:02x}"))
        };
        assert!(second(None) && !second(Some(0)));
    }

    #[test]
    fn everything_named_is_shown() {
        let plot = Plot {
            title: "Title".into(),
            x_label: "time".into(),
            y_label: "<script>alert(1)</script>".into(),
            series: vec![
                Series {
                    name: "a & b".into(),
                    points: vec![(0.0, 1.0), (f64::NAN, 2.0), (2.0, 3.0), (3.0, 2.0)],
                    errors: Some(vec![0.5, 0.1]),
                    style: Style::Line,
                    colour: None,
                },
                Series { name: "none".into(), ..Series::default() },
            ],
            levels: vec![(2.5, "level\0".into()), (f64::NAN, "hidden".into())],
            marks: vec![(1.0, "mark".into()), (f64::NAN, "hidden".into())],
            ..Plot::default()
        };
        let svg = plot.render().unwrap();
        assert!(!svg.contains("<script") && !svg.contains("NaN"));
        let texts = texts(&svg);
        for text in ["Title", "time", "<script>alert(1)</script>", "a & b", "none", "mark", "level\u{FFFD}"] {
            assert!(texts.iter().any(|t| t == text), "{text} is not in {texts:?}");
        }
        assert!(!texts.iter().any(|t| t == "hidden"));
    }

    #[test]
    fn an_empty_plot_is_a_plot() {
        let plot = Plot { log_y: true, ..Plot::default() };
        assert!(texts(&plot.render().unwrap()).len() > 4);
    }

    fn style() -> impl Strategy<Value = Style> {
        prop_oneof![Just(Style::Line), Just(Style::Points), Just(Style::Dashed), Just(Style::Faint)]
    }

    prop_compose! {
        fn series()(
            name in ".*",
            points in prop::collection::vec(any::<(f64, f64)>(), 0..6),
            errors in prop::option::of(prop::collection::vec(any::<f64>(), 0..8)),
            style in style(),
        ) -> Series {
            Series { name, points, errors, style, colour: None }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_plot_is_well_formed(
            labels in any::<(String, String, String)>(),
            series in prop::collection::vec(series(), 0..10),
            logs in any::<(bool, bool)>(),
            levels in prop::collection::vec(any::<(f64, String)>(), 0..4),
        ) {
            let (title, x_label, y_label) = labels;
            let marks = levels.clone();
            let plot = Plot { title, x_label, y_label, series, log_x: logs.0, log_y: logs.1, levels, marks, bounds: None };
            texts(&plot.render().unwrap());
        }
    }
}
