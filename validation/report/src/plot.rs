//! Plots of data as SVG, drawn by plotters.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::chart::{Area, Chart, Fallible, GREY, INK, LEFT, SMALL, chart, font, note, pen, px, svg};
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
    /// What is written beside its points, where there is room; those of the last series come first.
    pub notes: Vec<String>,
    /// Which points are upper limits: an arrow points down from these. Missing ones are none.
    pub limits: Vec<bool>,
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
        Series { name: name.into(), points, style, ..Series::default() }
    }

    pub fn with_errors(self, errors: Vec<f64>) -> Series {
        Series { errors: Some(errors), ..self }
    }

    pub fn with_notes(self, notes: Vec<String>) -> Series {
        Series { notes, ..self }
    }

    pub fn with_limits(self, limits: Vec<bool>) -> Series {
        Series { limits, ..self }
    }

    /// The error of a point, if it can be drawn.
    fn error(&self, index: usize) -> Option<f64> {
        let error = *self.errors.as_ref()?.get(index)?;
        (error.is_finite() && error > 0.0).then_some(error)
    }
}

/// A point that can be shown, the lower and upper end of its error bar, and whether it is an upper limit.
#[derive(Clone, Copy)]
struct Shown {
    at: (f64, f64),
    low: f64,
    high: f64,
    is_limit: bool,
}

/// A part of the drawing that is taken, in drawing units: left, top, right, bottom.
type Taken = [i32; 4];

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
            self.draw_notes(area, &chart, [x, y], &runs)?;
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
            Some(Shown { at, low, high, is_limit: series.limits.get(k) == Some(&true) })
        };
        let points: Vec<Option<Shown>> = series.points.iter().enumerate().map(shown).collect();
        points
            .split(Option::is_none)
            .filter(|run| !run.is_empty())
            .map(|run| run.iter().flatten().copied().collect())
            .collect()
    }

    /// Writes the notes of points beside them where they cover no point, bar or other note, and leaves out the others.
    fn draw_notes(
        &self,
        area: &Area,
        chart: &Chart,
        [x, y]: [&Scale; 2],
        runs: &[Vec<Vec<Shown>>],
    ) -> Fallible {
        if self.series.iter().all(|series| series.notes.is_empty()) {
            return Ok(());
        }
        let mut covered: Vec<Taken> = runs.iter().flatten().flatten().map(|s| taken(chart, s)).collect();
        // Of lines, what is between their points too.
        let lines = self.series.iter().zip(runs).filter(|(series, _)| series.style != Style::Points);
        for ends in lines.flat_map(|(_, runs)| runs).flat_map(|run| run.windows(2)) {
            let [a, b] = [ends[0].at, ends[1].at].map(|at| chart.backend_coord(&at));
            let parts = ((b.0 - a.0).abs().max((b.1 - a.1).abs()) / px(4.0)).max(1);
            covered.extend((0..=parts).map(|k| {
                let [x, y] = [a.0 + (b.0 - a.0) * k / parts, a.1 + (b.1 - a.1) * k / parts];
                [x - px(2.0), y - px(2.0), x + px(2.0), y + px(2.0)]
            }));
        }
        let (across, up) = chart.plotting_area().get_pixel_range();
        let mut noted: Vec<(i32, i32)> = Vec::new();
        for series in self.series.iter().rev() {
            for (text, &(a, b)) in series.notes.iter().zip(&series.points) {
                let (Some(a), Some(b)) = (x.clamp(a), y.clamp(b)) else { continue };
                let at = chart.backend_coord(&(a, b));
                let text = fit(text, SMALL, NAME);
                if noted.contains(&at) || text.trim().is_empty() {
                    continue;
                }
                let [long, high] = [px(width(&text, SMALL)), px(SMALL)];
                let beside = [
                    (at.0 + px(6.0), at.1 - high / 2),
                    (at.0 - px(6.0) - long, at.1 - high / 2),
                    (at.0 - long / 2, at.1 - px(6.0) - high),
                    (at.0 - long / 2, at.1 + px(6.0)),
                    (at.0 + px(4.0), at.1 - px(4.0) - high),
                    (at.0 - px(4.0) - long, at.1 - px(4.0) - high),
                    (at.0 + px(4.0), at.1 + px(4.0)),
                    (at.0 - px(4.0) - long, at.1 + px(4.0)),
                ];
                let boxes = beside.map(|(left, top)| [left, top, left + long, top + high]);
                let is_free = |[left, top, right, bottom]: &Taken| {
                    let inside = across.contains(left)
                        && across.contains(right)
                        && up.contains(top)
                        && up.contains(bottom);
                    inside
                        && covered
                            .iter()
                            .all(|c| *right < c[0] || c[2] < *left || *bottom < c[1] || c[3] < *top)
                };
                if let Some(place) = boxes.into_iter().find(is_free) {
                    let style = font(SMALL, INK).pos(Pos::new(HPos::Left, VPos::Center));
                    area.draw(&Text::new(text, (place[0], (place[1] + place[3]) / 2), style))?;
                    covered.push(place);
                    noted.push(at);
                }
            }
        }
        Ok(())
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

/// How far the arrow of an upper limit reaches down from its point, in pixels.
const ARROW: f64 = 14.0;

/// What the marker of a point, its bar and its arrow take, in a chart.
fn taken(chart: &Chart, s: &Shown) -> Taken {
    let (x, y) = chart.backend_coord(&s.at);
    let [top, bottom] = [s.high, s.low].map(|end| chart.backend_coord(&(s.at.0, end)).1);
    let arrow = if s.is_limit { px(ARROW) } else { 0 };
    let r = px(4.0);
    [x - r, top.min(y - r), x + r, bottom.max(y + r + arrow)]
}

/// Draws a band along a line, bars at single points, and arrows down from upper limits.
fn draw_errors(chart: &mut Chart, k: usize, series: &Series, runs: &[Vec<Shown>]) -> Fallible {
    let colour = colour_of(k);
    for run in runs {
        if series.style == Style::Points || run.len() == 1 {
            let thin = pen(colour, 1.2);
            let stroke = |path: &[(i32, i32)]| PathElement::new(path.to_vec(), thin);
            let end = [(px(-3.0), 0), (px(3.0), 0)];
            for s in run.iter().filter(|s| s.low < s.high) {
                let (low, high) = ((s.at.0, s.low), (s.at.0, s.high));
                chart.draw_series([PathElement::new([low, high], thin)])?;
                chart.draw_series([low, high].map(|at| EmptyElement::at(at) + stroke(&end)))?;
            }
            let shaft = [(0, 0), (0, px(ARROW))];
            let head = [(px(-3.0), px(ARROW - 4.0)), (0, px(ARROW)), (px(3.0), px(ARROW - 4.0))];
            let limits = run.iter().filter(|s| s.is_limit);
            chart.draw_series(limits.map(|s| EmptyElement::at(s.at) + stroke(&shaft) + stroke(&head)))?;
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
                    ..Series::default()
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

    /// Where the texts of a plot are, in drawing units: left, top, right, bottom.
    fn boxes(svg: &str, of: impl Fn(&str) -> bool) -> Vec<[f64; 4]> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let nodes = document.descendants().filter(|n| n.has_tag_name(("http://www.w3.org/2000/svg", "text")));
        let wanted = nodes.filter(|n| n.text().is_some_and(|t| of(t.trim())));
        let place = |n: roxmltree::Node| {
            let of = |name: &str| n.attribute(name).unwrap().parse::<f64>().unwrap();
            let long = f64::from(px(width(n.text().unwrap().trim(), SMALL)));
            let high = f64::from(px(SMALL));
            [of("x"), of("y") - high / 2.0, of("x") + long, of("y") + high / 2.0]
        };
        wanted.map(place).collect()
    }

    #[test]
    fn notes_stand_beside_points_and_cover_none() {
        let points: Vec<(f64, f64)> = (0..60).map(|k| (f64::from(k % 8), f64::from(k * k % 17))).collect();
        let notes = (0..60).map(|k| format!("n{k}")).collect();
        let crowd = Series::new("crowd", points, Style::Points).with_notes(notes);
        let one = Series::new("one", vec![(3.5, 8.5)], Style::Points).with_notes(vec!["n-one".into()]);
        let svg = Plot::new("t", ["x", "y"], vec![crowd, one]).render().unwrap();
        let all = boxes(&svg, |t| t.starts_with('n'));
        assert!(all.len() > 20 && texts(&svg).contains(&"n-one".to_owned()), "{}", all.len());
        let apart = |a: &[f64; 4], b: &[f64; 4]| a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
        for (k, a) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|b| apart(a, b)), "{a:?}");
        }
    }

    /// A bar leaves the marker of its series as it is in the legend.
    #[test]
    fn bars_and_limits_keep_the_markers() {
        let of = |k: usize| {
            let none = Series::new("", vec![(0.0, 1.0)], Style::Points);
            let last = Series::new("s", vec![(1.0, 2.0), (2.0, 1.0)], Style::Points);
            let last = last.with_errors(vec![0.5, f64::NAN]).with_limits(vec![false, true]);
            let series = std::iter::repeat_n(none, k).chain([last]).collect();
            Plot::new("t", ["x", "y"], series).render().unwrap()
        };
        // Of the first series the points are circles, and one is in the legend; of the second triangles.
        assert_eq!(of(0).matches("<circle").count(), 3);
        assert_eq!((of(1).matches("<circle").count(), of(1).matches("<polygon").count()), (1, 3));
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
            notes in prop::collection::vec(".*", 0..6),
            limits in prop::collection::vec(any::<bool>(), 0..6),
        ) -> Series {
            Series { name, points, errors, style, notes, limits, colour: None }
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
