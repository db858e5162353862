//! Pictures made of pixels, with axes, legends and colour bars, as SVG.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::chart::{Area, BELOW, Chart, Fallible, GREY, LEFT, SMALL, axes, chart, font, note, pen, px, svg};
use super::scale::Scale;
use super::text::{fit, width};
use super::{ReportError, extremes};
use psidpd_formats::Frame;
use psidpd_pictures::colour::{self, Rgb};
use psidpd_pictures::{
    Field, FieldOptions, Image, ParticleOptions, View, draw_coloured, draw_particles, paint_field,
};

/// A picture in an SVG document without external resources.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The title above the picture; may be empty.
    pub title: String,
    pub image: Image,
    /// The decoration on the left and below the picture.
    pub border: Border,
    /// Names and colours below the picture.
    pub legend: Vec<(String, Rgb)>,
    /// The lowest value, the highest value and the label of a colour bar on the right.
    pub bar: Option<(f64, f64, String)>,
    /// Lines over a picture with axes, through points of these.
    pub lines: Vec<Outline>,
}

/// A line over a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pub colour: Rgb,
    pub dashed: bool,
    pub points: Vec<(f64, f64)>,
}

/// The decoration that shows directions and lengths.
#[derive(Debug, Clone, PartialEq)]
pub enum Border {
    /// Axes with the names and the ends of the two directions.
    Axes([String; 2], [[f64; 2]; 2]),
    /// Three small arrows for x, y and z.
    Arrows(View),
}

/// The room above the picture, in pixels.
const TOP: f64 = 36.0;
/// The width of a colour bar with its numbers and label, in pixels.
const BAR: f64 = 90.0;
/// The largest room for a name of the legend, in pixels.
const NAMES: f64 = 150.0;
const CENTRE: Pos = Pos { h_pos: HPos::Center, v_pos: VPos::Center };

impl Figure {
    pub fn particles(title: &str, frame: &Frame, options: &ParticleOptions) -> Figure {
        let (image, projection) = draw_particles(frame, options);
        let view = if frame.dimensions == 2 { View::Z } else { options.view };
        let counts = frame.counts();
        let legend = frame
            .names
            .iter()
            .enumerate()
            // A slice does not show all particles.
            .map(|(k, name)| match options.slice {
                Some(_) => (name.clone(), colour::of_species(k)),
                None => (format!("{name} ({})", counts[k]), colour::of_species(k)),
            });
        let border = match view.names() {
            Some(names) => Border::Axes(names.map(of_length), projection.ranges()),
            None => Border::Arrows(view),
        };
        Figure { title: title.into(), image, border, legend: legend.collect(), bar: None, lines: Vec::new() }
    }

    /// Draws the particles of a frame in the colours of values between two ends.
    pub fn valued(
        title: &str,
        label: &str,
        frame: &Frame,
        options: &ParticleOptions,
        values: &[f64],
        [low, high]: [f64; 2],
    ) -> Figure {
        let span = if high > low { high - low } else { 1.0 };
        let colours: Vec<Rgb> = values.iter().map(|v| colour::of_value((v - low) / span)).collect();
        let plain = Figure::particles(title, frame, options);
        let (image, _) = draw_coloured(frame, options, &colours);
        Figure { image, legend: Vec::new(), bar: Some((low, low + span, label.into())), ..plain }
    }

    /// Draws a weighted local density of a frame, with colours from 0 to its highest value in the picture.
    pub fn field(title: &str, label: &str, frame: &Frame, options: &FieldOptions) -> Figure {
        let field = Field::of(frame, options);
        let high = if field.max() > 0.0 { field.max() } else { 1.0 };
        let names = options.view_of(frame.dimensions).names().unwrap_or(["x", "z"]);
        Figure {
            title: title.into(),
            image: paint_field(&field, 0.0, high),
            border: Border::Axes(names.map(of_length), field.projection.ranges()),
            legend: Vec::new(),
            bar: Some((0.0, high, label.into())),
            lines: Vec::new(),
        }
    }

    /// The picture alone. A field has a scale bar, since its axes are left out.
    pub fn with_scale_bar(self) -> Image {
        let mut image = self.image;
        if let (Border::Axes(_, [[left, right], _]), Some(_)) = (&self.border, &self.bar) {
            image.draw_scale_bar(right - left);
        }
        image
    }

    /// Makes the SVG document, without prolog, fit for embedding.
    pub fn render(&self) -> Result<String, ReportError> {
        let png = self.image.to_data_url().map_err(|e| ReportError::Plot(e.to_string()))?;
        let (w, h) = (self.image.width as f64, self.image.height as f64);
        let names = self.legend.iter().map(|(name, _)| width(&fit(name, SMALL, NAMES), SMALL) + 30.0);
        let right = names.fold(if self.bar.is_some() { BAR } else { 20.0 }, f64::max) + 20.0;
        let size = [LEFT + w + right, TOP + h + BELOW];
        let [x, y, across, down] = [LEFT, TOP, w, h].map(px);
        let image =
            format!("<image x=\"{x}\" y=\"{y}\" width=\"{across}\" height=\"{down}\" href=\"{png}\"/>");
        svg(&self.title, size, &image, |area| {
            match &self.border {
                Border::Axes(names, ends) => {
                    let [x, y] = ends.map(|[low, high]| Scale::exact(low, high));
                    let mut chart = chart(area, [TOP, right], [&names[0], &names[1]], [&x, &y], false)?;
                    for line in &self.lines {
                        draw_outline(&mut chart, line, [&x, &y])?;
                    }
                }
                Border::Arrows(view) => arrows(area, *view, [40.0, TOP + h + 10.0])?,
            }
            for (k, (name, colour)) in self.legend.iter().enumerate() {
                let at = (px(LEFT + w + 24.0), px(TOP + 8.0 + 20.0 * k as f64));
                let below = (at.0 + px(12.0), at.1 + px(6.0));
                area.draw(&Circle::new(at, px(6.0), rgb(*colour).filled()))?;
                area.draw(&note(&fit(name, SMALL, NAMES), below))?;
            }
            if let Some((low, high, label)) = &self.bar {
                bar(
                    &area.clone().shrink((px(LEFT + w + 20.0), 0), (px(BAR), px(size[1]))),
                    *low,
                    *high,
                    label,
                )?;
            }
            Ok(())
        })
    }
}

/// A figure of values on a regular grid, row after row, the lowest row first; `size` is columns and rows.
pub(super) fn field_of_values(
    title: &str,
    label: &str,
    names: [String; 2],
    ranges: [[f64; 2]; 2],
    size: [usize; 2],
    values: &[f64],
) -> Figure {
    let [low, high] = extremes(values.iter().copied());
    let (low, high) = if high > low { (low, high) } else { (0.0, 1.0) };
    // The rows are given with the lowest first. The longer side gets about 500 pixels.
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
        lines: Vec::new(),
    }
}

/// The name of an axis of the box with its unit.
fn of_length(name: &str) -> String {
    format!("{name} [length]")
}

fn rgb([r, g, b]: Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

/// Draws a line without its points beyond the axes.
fn draw_outline(chart: &mut Chart, line: &Outline, scales: [&Scale; 2]) -> Fallible {
    let is_within = |scale: &Scale, value: f64| {
        let (low, high) = scale.ends();
        (low..=high).contains(&value)
    };
    let inside = line.points.iter().filter(|p| is_within(scales[0], p.0) && is_within(scales[1], p.1));
    let points: Vec<(f64, f64)> = inside.copied().collect();
    let pen = pen(rgb(line.colour), 2.0);
    match line.dashed {
        _ if points.len() < 2 => {}
        true => {
            chart.draw_series([DashedPathElement::new(points, px(7.0), px(5.0), pen)])?;
        }
        false => {
            chart.draw_series([PathElement::new(points, pen)])?;
        }
    }
    Ok(())
}

/// Draws the colours from a lowest value to a highest, with numbers on the right.
fn bar(area: &Area, low: f64, high: f64, label: &str) -> Fallible {
    let (values, across) = (Scale::exact(low, high), Scale::exact(0.0, 1.0));
    let mut chart: Chart = ChartBuilder::on(area)
        .margin_top(px(TOP))
        .margin_bottom(px(BELOW))
        .right_y_label_area_size(px(BAR - 16.0))
        .build_cartesian_2d(across.clone(), values.clone())?;
    let ends = values.ends();
    // Each band goes from its own lower end to the top of the bar. The next band covers the rest, so no seams show.
    chart.draw_series((0..128).map(|k| {
        let from = f64::from(k) / 128.0;
        let colour = rgb(colour::of_value(from + 0.5 / 128.0)).filled();
        Rectangle::new([(0.0, ends.0 + from * (ends.1 - ends.0)), (1.0, ends.1)], colour)
    }))?;
    axes(&mut chart, ["", label], [&across, &values], false)
}

/// Draws x, y and z as arrows from a point.
fn arrows(area: &Area, view: View, [x, y]: [f64; 2]) -> Fallible {
    for ([right, up], name) in view.directions().into_iter().zip(["x", "y", "z"]) {
        let along = |length: f64| (px(x + length * right), px(y - length * up));
        area.draw(&PathElement::new([along(0.0), along(28.0)], pen(GREY, 1.6)))?;
        area.draw(&Text::new(name, along(36.0), font(SMALL, GREY).pos(CENTRE)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;

    fn texts(svg: &str) -> Vec<String> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let nodes = document.descendants().filter(|n| n.tag_name().name() == "text");
        nodes.filter_map(|n| n.text().map(|text| text.trim().to_owned())).collect()
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
        assert!(svg.contains("href=\"data:image/png;base64,") && svg.to_lowercase().contains("#0072b2"));
        // The embedded picture is the picture that was drawn.
        let document = roxmltree::Document::parse(&svg).unwrap();
        let image = document.descendants().find(|n| n.tag_name().name() == "image").unwrap();
        assert_eq!(image.attribute("width"), Some(px(oblique.image.width as f64).to_string().as_str()));

        let slice = ParticleOptions { view: View::Y, slice: Some(1.0), ..Default::default() };
        let found = texts(&Figure::particles("", &frame, &slice).render().unwrap());
        assert!(
            found.iter().any(|t| t == "x [length]") && !found.iter().any(|t| t == "y [length]"),
            "{found:?}"
        );
        // The numbers of all particles are not those of a slice.
        let sliced = Figure::particles("", &frame, &slice);
        assert!(sliced.legend.iter().all(|(name, _)| !name.contains('(')), "{:?}", sliced.legend);

        let field = Figure::field("density", "n", &frame, &FieldOptions::coarse(3));
        let found = texts(&field.render().unwrap());
        for text in ["density", "n", "x [length]", "z [length]", "0", "8"] {
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
        let line =
            Outline { colour: [255; 3], dashed: false, points: vec![(0.5, 0.5), (1.5, 1.0), (9.0, 1.0)] };
        let lined = Figure { lines: vec![line], ..figure.clone() }.render().unwrap();
        // The point outside is not drawn.
        let added = |svg: &str| svg.matches("<polyline").count();
        assert_eq!(added(&lined), added(&figure.render().unwrap()) + 1);
    }
}
