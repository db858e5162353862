//! Plots as SVG.
//!
//! Shapes and text go through the SVG backend of plotters, which needs no
//! fonts: text stays text, and the viewer's sans-serif font shows it. Axes,
//! ticks and layout are computed here, since text can only be measured
//! roughly without fonts.

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::axis::Axis;
use super::text::{escape, fit, width};
use crate::output::picture::colour;

/// How a series is drawn.
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

/// One set of data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend; an empty one is left out.
    pub name: String,
    /// The data. Points that are not finite, or not positive on a logarithmic
    /// axis, are skipped and interrupt a line.
    pub points: Vec<(f64, f64)>,
    /// Errors of the ordinates, one by one; missing, negative and non-finite
    /// ones are not drawn.
    pub errors: Option<Vec<f64>>,
    /// How it is drawn.
    pub style: Style,
}

/// A plot with linear or logarithmic axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// Title above the plot; may be empty.
    pub title: String,
    /// Label of the horizontal axis; may be empty.
    pub x_label: String,
    /// Label of the vertical axis; may be empty.
    pub y_label: String,
    /// The data, in order of drawing.
    pub series: Vec<Series>,
    /// Whether the horizontal axis is logarithmic.
    pub log_x: bool,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// Horizontal reference lines with labels.
    pub levels: Vec<(f64, String)>,
    /// Vertical reference lines, such as the ends of stages, with labels above the plot.
    pub marks: Vec<(f64, String)>,
}

/// Drawing units per pixel: plotters has whole coordinates only.
const UNITS: f64 = 10.0;
const WIDTH: f64 = 720.0;
/// Height between the upper and the lower end of the vertical axis.
const HEIGHT: f64 = 320.0;
/// Room to the right of the plot if no labels stand there.
const RIGHT: f64 = 20.0;
/// Most room for the labels of reference lines.
const LEVEL_ROOM: f64 = 150.0;
const SMALL: f64 = 12.0;
const MEDIUM: f64 = 13.0;
const LARGE: f64 = 15.0;

const INK: RGBColor = RGBColor(0x33, 0x33, 0x33);
const GREY: RGBColor = RGBColor(0x6B, 0x6B, 0x6B);
const GRID: RGBColor = RGBColor(0xE3, 0xE3, 0xE3);
const FAINT: RGBColor = RGBColor(0xF2, 0xF2, 0xF2);

/// The colour of the k-th series.
fn colour_of(k: usize) -> RGBColor {
    let [r, g, b] = colour::of_species(k);
    RGBColor(r, g, b)
}

impl Plot {
    /// Draws the plot as an SVG document without prolog, fit for embedding.
    pub fn render(&self) -> Result<String, ReportError> {
        let layout = Layout::of(self);
        let units = |px: f64| (px * UNITS).round() as u32;
        let mut drawn = String::new();
        {
            let area =
                SVGBackend::with_string(&mut drawn, (units(WIDTH), units(layout.total))).into_drawing_area();
            let mut canvas = Canvas { area, layout };
            canvas.draw(self).map_err(|e| ReportError::Plot(e.to_string()))?;
            canvas.area.present().map_err(|e| ReportError::Plot(e.to_string()))?;
        }
        // The root element comes from here: a size in pixels, whatever the
        // drawing units, and a name for screen readers.
        let body = drawn
            .find('>')
            .and_then(|end| drawn.get(end + 1..))
            .ok_or_else(|| ReportError::Plot("the drawing has no root element".into()))?;
        let total = Layout::of(self).total;
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{total}\" \
             viewBox=\"0 0 {} {}\" role=\"img\" stroke-linejoin=\"round\">\n<title>{}</title>{body}",
            units(WIDTH),
            units(total),
            escape(if self.title.is_empty() { "Plot" } else { &self.title }),
        ))
    }

    /// Every named series, with its index.
    fn named(&self) -> impl Iterator<Item = (usize, &Series)> {
        self.series.iter().enumerate().filter(|(_, s)| !s.name.trim().is_empty())
    }
}

impl Series {
    /// The error of a point, if it can be drawn.
    fn error(&self, index: usize) -> Option<f64> {
        let error = *self.errors.as_ref()?.get(index)?;
        (error.is_finite() && error > 0.0).then_some(error)
    }
}

/// An entry of the legend: series, position of its left end, text.
struct Entry {
    series: usize,
    x: f64,
    y: f64,
    name: String,
}

/// Where everything goes, in pixels.
struct Layout {
    x: Axis,
    y: Axis,
    left: f64,
    right: f64,
    top: f64,
    total: f64,
    legend: Vec<Entry>,
}

impl Layout {
    fn of(plot: &Plot) -> Self {
        // Points that cannot be shown must not widen the axes either.
        let fits = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
        let shown = |s: &Series| -> Vec<(usize, f64, f64)> {
            let points = s.points.iter().enumerate().map(|(i, &(x, y))| (i, x, y));
            points.filter(|&(_, x, y)| fits(x, plot.log_x) && fits(y, plot.log_y)).collect()
        };
        let mut xs: Vec<f64> =
            plot.marks.iter().map(|mark| mark.0).filter(|x| fits(*x, plot.log_x)).collect();
        let mut ys: Vec<f64> = plot.levels.iter().map(|level| level.0).collect();
        for series in &plot.series {
            for (i, x, y) in shown(series) {
                xs.push(x);
                ys.push(y);
                if let Some(error) = series.error(i) {
                    ys.extend([y - error, y + error]);
                }
            }
        }
        let x = Axis::around(xs.into_iter(), plot.log_x, 7);
        let y = Axis::around(ys.into_iter(), plot.log_y, 6);

        let labels = y.ticks.iter().filter_map(|t| t.label.as_deref());
        let widest = labels.map(|l| width(l, SMALL)).fold(0.0, f64::max);
        let left = widest + if plot.y_label.is_empty() { 22.0 } else { 44.0 };
        let mut top = if plot.title.is_empty() { 14.0 } else { 40.0 };
        if y.factor.is_some() {
            top += 14.0;
        }
        if plot.marks.iter().any(|m| !m.1.trim().is_empty()) {
            top += 16.0;
        }
        let mut below = top + HEIGHT + 24.0;
        if !plot.x_label.is_empty() {
            below += 22.0;
        } else if x.factor.is_some() {
            below += 16.0;
        }
        let levels = plot.levels.iter().filter(|(level, _)| y.fraction(*level).is_some());
        let room = levels.map(|(_, text)| width(&fit(text, SMALL, LEVEL_ROOM), SMALL) + 26.0);
        let right = WIDTH - room.fold(RIGHT, f64::max);
        let (legend, below) = legend(plot, left, below);
        Self { x, y, left, right, top, total: (below + 12.0).ceil(), legend }
    }

    /// Pixel of a point, if it can be shown.
    fn place(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.place_x(self.x.fraction(x)?), self.place_y(self.y.fraction(y)?)))
    }

    fn place_x(&self, fraction: f64) -> f64 {
        self.left + fraction * (self.right - self.left)
    }

    fn place_y(&self, fraction: f64) -> f64 {
        self.top + (1.0 - fraction) * HEIGHT
    }
}

/// Length of the sample of a line in the legend.
const SAMPLE: f64 = 24.0;

/// Entries of the legend in rows below the plot, and the lower end.
fn legend(plot: &Plot, left: f64, top: f64) -> (Vec<Entry>, f64) {
    let mut entries = Vec::new();
    let (mut x, mut y) = (left, top + 14.0);
    for (series, named) in plot.named() {
        let name = fit(&named.name, SMALL, WIDTH - RIGHT - left - SAMPLE - 8.0);
        let room = SAMPLE + 8.0 + width(&name, SMALL);
        if x > left && x + room > WIDTH - RIGHT {
            x = left;
            y += 19.0;
        }
        entries.push(Entry { series, x, y, name });
        x += room + 18.0;
    }
    let end = if entries.is_empty() { top } else { y + 6.0 };
    (entries, end)
}

type Fallible = Result<(), Box<dyn std::error::Error>>;
type Pixel = (f64, f64);

/// The drawing area with helpers that take pixels.
struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    layout: Layout,
}

fn unit(p: Pixel) -> (i32, i32) {
    ((p.0 * UNITS).round() as i32, (p.1 * UNITS).round() as i32)
}

impl Canvas<'_> {
    fn draw(&mut self, plot: &Plot) -> Fallible {
        self.area.fill(&WHITE)?;
        self.grid()?;
        for (i, series) in plot.series.iter().enumerate() {
            self.spread(series, colour_of(i))?;
        }
        for &(level, _) in &plot.levels {
            if let Some(y) = self.layout.y.fraction(level) {
                let y = self.layout.place_y(y);
                self.dashed(&[(self.layout.left, y), (self.layout.right, y)], GREY, 1.2, (2.0, 3.0))?;
            }
        }
        self.marks(plot)?;
        for (i, series) in plot.series.iter().enumerate() {
            self.series(i, series)?;
        }
        self.frame(plot)?;
        self.level_labels(plot)?;
        self.legend(plot)
    }

    fn grid(&self) -> Fallible {
        let l = &self.layout;
        let (low, high) = (l.place_y(0.0), l.place_y(1.0));
        for major in [false, true] {
            let colour = if major { GRID } else { FAINT };
            for tick in l.x.ticks.iter().filter(|t| t.label.is_some() == major) {
                let x = l.place_x(tick.at);
                self.line(&[(x, low), (x, high)], colour.stroke_width(UNITS as u32))?;
            }
            for tick in l.y.ticks.iter().filter(|t| t.label.is_some() == major) {
                let y = l.place_y(tick.at);
                self.line(&[(l.left, y), (l.right, y)], colour.stroke_width(UNITS as u32))?;
            }
        }
        Ok(())
    }

    fn frame(&self, plot: &Plot) -> Fallible {
        let l = &self.layout;
        let (low, right) = (l.place_y(0.0), l.right);
        self.line(&[(l.left, l.top), (l.left, low), (right, low)], INK.stroke_width(UNITS as u32))?;
        // Labels are centred on their ticks; one that would touch the label
        // before it is left out.
        let mut free = f64::NEG_INFINITY;
        for tick in &l.x.ticks {
            let x = l.place_x(tick.at);
            let length = if tick.label.is_some() { 5.0 } else { 3.0 };
            self.line(&[(x, low), (x, low + length)], INK.stroke_width(UNITS as u32))?;
            if let Some(label) = &tick.label {
                let half = width(label, SMALL) / 2.0;
                if x - half > free {
                    free = x + half + 6.0;
                    self.text(label, (x, low + 8.0), SMALL, INK, (HPos::Center, VPos::Top))?;
                }
            }
        }
        for tick in &l.y.ticks {
            let y = l.place_y(tick.at);
            let length = if tick.label.is_some() { 5.0 } else { 3.0 };
            self.line(&[(l.left - length, y), (l.left, y)], INK.stroke_width(UNITS as u32))?;
            if let Some(label) = &tick.label {
                self.text(label, (l.left - 8.0, y), SMALL, INK, (HPos::Right, VPos::Center))?;
            }
        }
        if let Some(factor) = &l.x.factor {
            self.text(factor, (right, low + 27.0), SMALL, INK, (HPos::Right, VPos::Top))?;
        }
        if let Some(factor) = &l.y.factor {
            self.text(factor, (l.left, l.top - 7.0), SMALL, INK, (HPos::Left, VPos::Bottom))?;
        }
        let middle = (l.left + right) / 2.0;
        let room = right - l.left - if l.x.factor.is_some() { 110.0 } else { 0.0 };
        let label = fit(&plot.x_label, MEDIUM, room);
        self.text(&label, (middle, low + 28.0), MEDIUM, INK, (HPos::Center, VPos::Top))?;

        let label = fit(&plot.y_label, MEDIUM, HEIGHT);
        let turned = self
            .style(MEDIUM, INK, (HPos::Center, VPos::Center), FontStyle::Normal)
            .transform(FontTransform::Rotate270);
        let at = unit((16.0, l.top + HEIGHT / 2.0));
        if !label.is_empty() {
            self.area.draw(&Text::new(label, at, turned))?;
        }

        let title = fit(&plot.title, LARGE, WIDTH - RIGHT - l.left);
        if !title.is_empty() {
            let style = self.style(LARGE, INK, (HPos::Left, VPos::Center), FontStyle::Bold);
            self.area.draw(&Text::new(title, unit((l.left, 20.0)), style))?;
        }
        Ok(())
    }

    /// Vertical reference lines. Labels begin at their lines; one that would touch the label before it is
    /// left out.
    fn marks(&self, plot: &Plot) -> Fallible {
        let l = &self.layout;
        let mut marks: Vec<(f64, &str)> = plot
            .marks
            .iter()
            .filter_map(|(x, text)| Some((l.place_x(l.x.inside(*x)?), text.as_str())))
            .collect();
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = l.left;
        for (x, text) in marks {
            self.dashed(&[(x, l.place_y(0.0)), (x, l.place_y(1.0))], GREY, 1.2, (2.0, 3.0))?;
            let text = fit(text, SMALL, LEVEL_ROOM);
            let end = x + 4.0 + width(&text, SMALL);
            if x >= free && end <= WIDTH {
                self.text(&text, (x + 4.0, l.top - 5.0), SMALL, GREY, (HPos::Left, VPos::Bottom))?;
                free = end + 6.0;
            }
        }
        Ok(())
    }

    /// Labels of reference lines to the right of the plot, kept apart.
    fn level_labels(&self, plot: &Plot) -> Fallible {
        let l = &self.layout;
        let mut labels: Vec<(f64, &str)> = plot
            .levels
            .iter()
            .filter_map(|(level, text)| Some((l.place_y(l.y.fraction(*level)?), text.as_str())))
            .filter(|(_, text)| !text.trim().is_empty())
            .collect();
        // From the bottom up; a label too close to the one below is raised,
        // and a short stroke leads to it from its line.
        labels.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut free = f64::INFINITY;
        for (level, text) in labels {
            let y = level.min(free);
            free = y - 15.0;
            let ends = [(l.right + 1.0, level), (l.right + 7.0, y)];
            self.line(&ends, GREY.stroke_width(UNITS as u32))?;
            let text = fit(text, SMALL, LEVEL_ROOM);
            let at = (l.right + 10.0, y);
            self.text(&text, at, SMALL, GREY, (HPos::Left, VPos::Center))?;
        }
        Ok(())
    }

    fn legend(&self, plot: &Plot) -> Fallible {
        for entry in &self.layout.legend {
            let Some(series) = plot.series.get(entry.series) else {
                continue;
            };
            let colour = colour_of(entry.series);
            let ends = [(entry.x, entry.y), (entry.x + SAMPLE, entry.y)];
            match series.style {
                Style::Line => self.line(&ends, colour.stroke_width(stroke(2.0)))?,
                Style::Faint => self.line(&ends, colour.mix(FAINTNESS).stroke_width(stroke(1.4)))?,
                Style::Dashed => self.dashed(&ends, colour, 2.0, DASH)?,
                Style::Points => self.marker(entry.series, (entry.x + SAMPLE / 2.0, entry.y))?,
            }
            let at = (entry.x + SAMPLE + 8.0, entry.y);
            self.text(&entry.name, at, SMALL, INK, (HPos::Left, VPos::Center))?;
        }
        Ok(())
    }

    /// Runs of points that can be shown, as pixels with the ends of the error.
    fn runs(&self, series: &Series) -> Vec<Vec<Shown>> {
        let l = &self.layout;
        let mut runs = vec![Vec::new()];
        for (i, &(x, y)) in series.points.iter().enumerate() {
            let Some(at) = l.place(x, y) else {
                runs.push(Vec::new());
                continue;
            };
            let error = series.error(i).map(|e| {
                let end = |v: f64, beyond| l.place_y(l.y.fraction(v).unwrap_or(beyond));
                (end(y + e, 1.0), end(y - e, 0.0))
            });
            if let Some(run) = runs.last_mut() {
                run.push(Shown { at, error });
            }
        }
        runs.retain(|run| !run.is_empty());
        runs
    }

    /// Errors, drawn below all data.
    fn spread(&self, series: &Series, colour: RGBColor) -> Fallible {
        for run in self.runs(series) {
            if series.style == Style::Points || run.len() == 1 {
                for (x, (high, low)) in run.iter().filter_map(|s| Some((s.at.0, s.error?))) {
                    let style = colour.stroke_width(stroke(1.2));
                    self.line(&[(x, high), (x, low)], style)?;
                    for y in [high, low] {
                        self.line(&[(x - 3.0, y), (x + 3.0, y)], style)?;
                    }
                }
            } else if run.iter().any(|s| s.error.is_some()) {
                let ends = |s: &Shown| s.error.unwrap_or((s.at.1, s.at.1));
                let upper = run.iter().map(|s| unit((s.at.0, ends(s).0)));
                let lower = run.iter().rev().map(|s| unit((s.at.0, ends(s).1)));
                let outline: Vec<_> = upper.chain(lower).collect();
                self.area.draw(&Polygon::new(outline, colour.mix(0.18).filled()))?;
            }
        }
        Ok(())
    }

    fn series(&self, index: usize, series: &Series) -> Fallible {
        let colour = colour_of(index);
        for run in self.runs(series) {
            let path: Vec<Pixel> = run.iter().map(|s| s.at).collect();
            match (series.style, path.as_slice()) {
                (Style::Points, path) => {
                    for &at in path {
                        self.marker(index, at)?;
                    }
                }
                (_, &[at]) => {
                    self.area.draw(&Circle::new(unit(at), stroke(2.0) as i32, colour.filled()))?;
                }
                (Style::Line, path) => self.line(path, colour.stroke_width(stroke(1.8)))?,
                (Style::Faint, path) => self.line(path, colour.mix(FAINTNESS).stroke_width(stroke(1.0)))?,
                (Style::Dashed, path) => self.dashed(path, colour, 1.8, DASH)?,
            }
        }
        Ok(())
    }

    /// A marker whose shape, too, tells series apart.
    fn marker(&self, index: usize, at: Pixel) -> Fallible {
        let fill = colour_of(index).filled();
        let polygon = |corners: &[Pixel]| {
            let corners = corners.iter().map(|c| unit((at.0 + c.0, at.1 + c.1)));
            Polygon::new(corners.collect::<Vec<_>>(), fill)
        };
        match index % 4 {
            0 => self.area.draw(&Circle::new(unit(at), stroke(3.4) as i32, fill))?,
            1 => self.area.draw(&polygon(&[(-3.1, -3.1), (3.1, -3.1), (3.1, 3.1), (-3.1, 3.1)]))?,
            2 => self.area.draw(&polygon(&[(0.0, -4.2), (4.0, 3.0), (-4.0, 3.0)]))?,
            _ => self.area.draw(&polygon(&[(0.0, -4.4), (4.4, 0.0), (0.0, 4.4), (-4.4, 0.0)]))?,
        }
        Ok(())
    }

    fn line(&self, path: &[Pixel], style: ShapeStyle) -> Fallible {
        let mut path: Vec<_> = path.iter().map(|&p| unit(p)).collect();
        path.dedup();
        self.area.draw(&PathElement::new(path, style))?;
        Ok(())
    }

    fn dashed(&self, path: &[Pixel], colour: RGBColor, wide: f64, dash: (f64, f64)) -> Fallible {
        let mut path: Vec<_> = path.iter().map(|&p| unit(p)).collect();
        path.dedup();
        let (on, off) = (stroke(dash.0) as i32, stroke(dash.1) as i32);
        let style = colour.stroke_width(stroke(wide));
        self.area.draw(&DashedPathElement::new(path, on, off, style))?;
        Ok(())
    }

    fn style(
        &self,
        size: f64,
        colour: RGBColor,
        anchor: (HPos, VPos),
        weight: FontStyle,
    ) -> TextStyle<'static> {
        // The backend divides sizes by 1.24.
        FontDesc::new(FontFamily::SansSerif, size * UNITS * 1.24, weight)
            .color(&colour)
            .pos(Pos::new(anchor.0, anchor.1))
    }

    fn text(&self, text: &str, at: Pixel, size: f64, colour: RGBColor, anchor: (HPos, VPos)) -> Fallible {
        if !text.is_empty() {
            let style = self.style(size, colour, anchor, FontStyle::Normal);
            self.area.draw(&Text::new(text, unit(at), style))?;
        }
        Ok(())
    }
}

/// Opacity of faint lines.
const FAINTNESS: f64 = 0.55;

/// Dash and gap of dashed series.
const DASH: (f64, f64) = (7.0, 4.0);

/// A length in drawing units.
fn stroke(px: f64) -> u32 {
    (px * UNITS).round() as u32
}

/// A point that can be shown, and the upper and lower end of its error.
struct Shown {
    at: Pixel,
    error: Option<(f64, f64)>,
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
            Series { name, points, errors, style }
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
            let plot = Plot { title, x_label, y_label, series, log_x: logs.0, log_y: logs.1, levels, marks };
            texts(&plot.render().unwrap());
        }
    }
}
