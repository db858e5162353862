//! Pictures made of pixels, with axes, legends and colour bars around them, as SVG.

use super::ReportError;
use super::axis::Axis;
use super::text::{escape, fit, width};
use crate::output::Frame;
use crate::output::picture::colour::{self, Rgb};
use crate::output::picture::{
    Field, FieldOptions, Image, ParticleOptions, View, draw_particles, paint_field,
};
use std::fmt::Write;

/// A picture in an SVG document that needs nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title above the picture; may be empty.
    pub title: String,
    /// The picture.
    pub image: Image,
    /// What surrounds it on the left and below.
    pub border: Border,
    /// Names and colours below the picture.
    pub legend: Vec<(String, Rgb)>,
    /// Lowest value, highest value and label of a colour bar on the right.
    pub bar: Option<(f64, f64, String)>,
}

/// What tells directions and lengths.
#[derive(Debug, Clone, PartialEq)]
pub enum Border {
    /// Axes with the names and the ends of the two directions.
    Axes([String; 2], [[f64; 2]; 2]),
    /// Three small arrows.
    Arrows(View),
}

const SMALL: f64 = 12.0;
const MEDIUM: f64 = 13.0;
const LARGE: f64 = 15.0;
const INK: &str = "#333333";
/// Narrow pictures have room for their title and legend nevertheless.
const NARROWEST: f64 = 400.0;
const BAR: f64 = 16.0;

impl Figure {
    /// The particles of a frame.
    pub fn particles(title: &str, frame: &Frame, options: &ParticleOptions) -> Figure {
        let (image, projection) = draw_particles(frame, options);
        let view = if frame.dimensions == 2 { View::Z } else { options.view };
        let counts = frame.counts();
        let legend = frame
            .names
            .iter()
            .enumerate()
            .map(|(k, name)| (format!("{name} ({})", counts[k]), colour::of_species(k)));
        let border = match view.names() {
            Some(names) => Border::Axes(names.map(str::to_owned), projection.ranges()),
            None => Border::Arrows(view),
        };
        Figure { title: title.into(), image, border, legend: legend.collect(), bar: None }
    }

    /// A weighted local density of a frame, colours from 0 to its highest value in the picture.
    pub fn field(title: &str, label: &str, frame: &Frame, options: &FieldOptions) -> Figure {
        let field = Field::of(frame, options);
        let view = match (frame.dimensions, options.view) {
            (2, _) => View::Z,
            (_, View::Oblique) => View::Y,
            (_, view) => view,
        };
        let high = if field.max() > 0.0 { field.max() } else { 1.0 };
        let names = view.names().unwrap_or(["x", "z"]);
        Figure {
            title: title.into(),
            image: paint_field(&field, 0.0, high),
            border: Border::Axes(names.map(str::to_owned), field.projection.ranges()),
            legend: Vec::new(),
            bar: Some((0.0, high, label.into())),
        }
    }

    /// The document, without prolog, fit for embedding.
    ///
    /// # Errors
    /// A picture without pixels.
    pub fn render(&self) -> Result<String, ReportError> {
        let png = self.image.to_data_url().map_err(|e| ReportError::Plot(e.to_string()))?;
        Ok(self.around(&png))
    }

    /// The document with the picture at an address.
    fn around(&self, address: &str) -> String {
        let (w, h) = (self.image.width as f64, self.image.height as f64);
        let axes = match &self.border {
            Border::Axes(names, [across, up]) => {
                let ticks = |range: &[f64; 2], pixels: f64| {
                    Axis::exact(range[0], range[1], (pixels / 80.0).clamp(2.0, 8.0) as usize)
                };
                Some((names, ticks(across, w), ticks(up, h)))
            }
            Border::Arrows(_) => None,
        };
        let labels = |axis: &Axis| {
            axis.ticks.iter().filter_map(|t| t.label.as_deref()).map(|l| width(l, SMALL)).fold(0.0, f64::max)
        };
        let left = axes.as_ref().map_or(16.0, |(_, _, y)| 44.0 + labels(y));
        let top = if self.title.is_empty() { 16.0 } else { 40.0 };
        let bar = self.bar.as_ref().map(|(low, high, label)| (Axis::exact(*low, *high, 6), label));
        let right = bar.as_ref().map_or(20.0, |(axis, _)| 20.0 + BAR + 14.0 + labels(axis) + 30.0);
        let total = (left + w + right).max(NARROWEST);
        let mut out = String::new();
        // Writing to a string cannot fail.
        let mut put = |text: std::fmt::Arguments| {
            let _ = out.write_fmt(text);
        };
        let text = |x: f64, y: f64, anchor: &str, size: f64, words: &str| {
            format!(
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\">{}</text>\n",
                escape(words)
            )
        };
        put(format_args!(
            "<image x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" href=\"{address}\"/>\n"
        ));
        if !self.title.is_empty() {
            put(format_args!(
                "<text x=\"{left}\" y=\"25\" font-size=\"{LARGE}\" font-weight=\"bold\">{}</text>\n",
                escape(&fit(&self.title, LARGE, total - left - 12.0))
            ));
        }
        let mut below = top + h;
        if let Some((names, x, y)) = &axes {
            put(format_args!(
                "<rect x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"{INK}\"/>\n"
            ));
            let mut free = f64::NEG_INFINITY;
            for tick in x.ticks.iter().filter_map(|t| Some((left + t.at * w, t.label.as_deref()?))) {
                put(format_args!(
                    "<path d=\"M{:.1} {below:.1}v5\" stroke=\"{INK}\" fill=\"none\"/>\n",
                    tick.0
                ));
                let half = 0.5 * width(tick.1, SMALL);
                if tick.0 - half > free {
                    free = tick.0 + half + 6.0;
                    put(format_args!("{}", text(tick.0, below + 18.0, "middle", SMALL, tick.1)));
                }
            }
            for tick in y.ticks.iter().filter_map(|t| Some((top + (1.0 - t.at) * h, t.label.as_deref()?))) {
                put(format_args!(
                    "<path d=\"M{left:.1} {:.1}h-5\" stroke=\"{INK}\" fill=\"none\"/>\n",
                    tick.0
                ));
                put(format_args!("{}", text(left - 8.0, tick.0 + 4.0, "end", SMALL, tick.1)));
            }
            put(format_args!(
                "{}",
                text(left + 0.5 * w, below + 37.0, "middle", MEDIUM, &axis_label(&names[0], x))
            ));
            let (x, y, label) = (16.0, top + 0.5 * h, axis_label(&names[1], y));
            put(format_args!(
                "<text transform=\"translate({x} {y:.1}) rotate(-90)\" text-anchor=\"middle\" \
                 font-size=\"{MEDIUM}\">{}</text>\n",
                escape(&label)
            ));
            below += 44.0;
        }
        if let Some((axis, label)) = &bar {
            let x = left + w + 20.0;
            // As many bands as can be told apart, each from the top of the bar to its own lower end: the next
            // one covers the rest, and no seams show.
            let bands = 128;
            for k in 0..bands {
                let colour = colour::hex(colour::of_value((f64::from(k) + 0.5) / f64::from(bands)));
                let height = h * (1.0 - f64::from(k) / f64::from(bands));
                put(format_args!(
                    "<rect x=\"{x}\" y=\"{top}\" width=\"{BAR}\" height=\"{height:.2}\" fill=\"{colour}\"/>\n"
                ));
            }
            put(format_args!(
                "<rect x=\"{x}\" y=\"{top}\" width=\"{BAR}\" height=\"{h}\" fill=\"none\" stroke=\"{INK}\"/>\n"
            ));
            for tick in axis.ticks.iter().filter_map(|t| Some((top + (1.0 - t.at) * h, t.label.as_deref()?)))
            {
                let end = x + BAR;
                put(format_args!("<path d=\"M{end:.1} {:.1}h5\" stroke=\"{INK}\" fill=\"none\"/>\n", tick.0));
                put(format_args!("{}", text(end + 8.0, tick.0 + 4.0, "start", SMALL, tick.1)));
            }
            let (x, y) = (x + BAR + 14.0 + labels(axis) + 14.0, top + 0.5 * h);
            let label = match &axis.factor {
                Some(factor) => format!("{label} ({factor})"),
                None => (*label).clone(),
            };
            put(format_args!(
                "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"middle\" \
                 font-size=\"{MEDIUM}\">{}</text>\n",
                escape(&fit(&label, MEDIUM, h))
            ));
        }
        let mut x = left;
        let mut y = below + 20.0;
        if let Border::Arrows(view) = &self.border {
            for line in arrows(*view, left + 26.0, below + 36.0) {
                put(format_args!("{line}"));
            }
            x += 90.0;
            y += 12.0;
            below += 62.0;
        }
        let start = x;
        for (name, colour) in &self.legend {
            let name = fit(name, SMALL, total - start - 30.0);
            let room = 18.0 + width(&name, SMALL) + 18.0;
            if x > start && x + room > total {
                x = start;
                y += 20.0;
            }
            put(format_args!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"6\" fill=\"{}\"/>\n{}",
                x + 6.0,
                y,
                colour::hex(*colour),
                text(x + 18.0, y + 4.0, "start", SMALL, &name)
            ));
            x += room;
        }
        if !self.legend.is_empty() {
            below = below.max(y + 14.0);
        }
        let (name, height) = (if self.title.is_empty() { "Picture" } else { &self.title }, below + 10.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{total:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {total:.0} {height:.0}\" role=\"img\" font-family=\"sans-serif\" fill=\"{INK}\">\n\
             <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{out}</svg>",
            escape(name)
        )
    }
}

/// A figure of values on a regular grid, row after row, the lowest first; `size` is columns and rows.
pub(super) fn field_of_values(
    title: &str,
    label: &str,
    names: [String; 2],
    ranges: [[f64; 2]; 2],
    size: [usize; 2],
    values: &[f64],
) -> Figure {
    let (low, high) = values
        .iter()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let (low, high) = if high > low { (low, high) } else { (0.0, 1.0) };
    // Rows come with the lowest first, and are to be seen with a side of about 500 pixels.
    let factor = (500 / size[0].max(size[1]).max(1)).max(1);
    let mut pixels = Vec::new();
    for y in 0..size[1] * factor {
        for x in 0..size[0] * factor {
            let (row, column) = (size[1] - 1 - y / factor, x / factor);
            pixels.push(colour::of_value((values[row * size[0] + column] - low) / (high - low)));
        }
    }
    Figure {
        title: title.into(),
        image: Image { width: size[0] * factor, height: size[1] * factor, pixels },
        border: Border::Axes(names, ranges),
        legend: Vec::new(),
        bar: Some((low, high, label.into())),
    }
}

fn axis_label(name: &str, axis: &Axis) -> String {
    axis.factor.as_ref().map_or_else(|| name.to_owned(), |factor| format!("{name} ({factor})"))
}

/// x, y and z as arrows from a point.
fn arrows(view: View, x: f64, y: f64) -> Vec<String> {
    let arrow = |([right, up], name): ([f64; 2], &str)| {
        let (dx, dy) = (28.0 * right, -28.0 * up);
        let length = dx.hypot(dy).max(1e-9);
        let (lx, ly) = (x + dx + 9.0 * dx / length, y + dy + 9.0 * dy / length + 4.0);
        format!(
            "<path d=\"M{x:.1} {y:.1}l{dx:.1} {dy:.1}\" stroke=\"{INK}\" stroke-width=\"1.6\" fill=\"none\"/>\n\
             <text x=\"{lx:.1}\" y=\"{ly:.1}\" text-anchor=\"middle\" font-size=\"{SMALL}\">{name}</text>\n"
        )
    };
    view.directions().into_iter().zip(["x", "y", "z"]).map(arrow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;

    fn texts(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let nodes = document.descendants().filter(|n| n.tag_name().name() == "text");
        nodes.filter_map(|n| n.text().map(str::to_owned)).collect()
    }

    #[test]
    fn figures_tell_species_axes_and_values() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0, 3.0, 8.0], [true; 3]).unwrap();
        let names = ["oil & <b>".to_owned(), "water".to_owned()];
        let x = [[1.0, 1.5, 1.0], [3.0, 1.4, 6.0], [2.0, 1.6, 6.5]];
        let frame = Frame {
            step: 3,
            time: 0.1,
            dimensions: 3,
            domain: &domain,
            names: &names,
            x: &x,
            v: None,
            species: &[0, 1, 1],
            tag: &[],
        };
        let oblique = Figure::particles("all", &frame, &ParticleOptions::default());
        let svg = oblique.render().unwrap();
        let found = texts(&svg);
        for text in ["all", "oil & <b> (1)", "water (2)", "x", "y", "z"] {
            assert!(found.iter().any(|t| t == text), "{text} is not in {found:?}");
        }
        assert!(svg.contains("href=\"data:image/png;base64,") && svg.contains("#0072b2"));
        // The picture in the document is the picture drawn.
        let document = roxmltree::Document::parse(&svg).unwrap();
        let image = document.descendants().find(|n| n.tag_name().name() == "image").unwrap();
        assert_eq!(image.attribute("width"), Some(oblique.image.width.to_string().as_str()));

        let slice = ParticleOptions { view: View::Y, slice: Some(1.0), ..Default::default() };
        let found = texts(&Figure::particles("", &frame, &slice).render().unwrap());
        assert!(found.iter().any(|t| t == "x") && !found.iter().any(|t| t == "y"), "{found:?}");

        let field = Figure::field("density", "n", &frame, &FieldOptions::coarse(3));
        let found = texts(&field.render().unwrap());
        for text in ["density", "n", "x", "z", "0", "8"] {
            assert!(found.iter().any(|t| t == text), "{text} is not in {found:?}");
        }
    }

    #[test]
    fn values_on_a_grid_have_the_lowest_row_below() {
        let values = [0.0, 1.0, f64::NAN, 3.0];
        let figure =
            field_of_values("t", "l", ["x".into(), "y".into()], [[0.0, 2.0], [0.0, 2.0]], [2, 2], &values);
        let side = figure.image.width;
        assert_eq!(figure.image.get(0, side - 1), Some(colour::of_value(0.0)));
        assert_eq!(figure.image.get(side - 1, 0), Some(colour::of_value(1.0)));
        assert_eq!(figure.image.get(0, 0), Some(colour::of_value(f64::NAN)));
        assert_eq!(figure.bar, Some((0.0, 3.0, "l".into())));
    }
}
