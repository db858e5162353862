//! Drawing for plots and pictures: an SVG document, and a chart with its axes.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::scale::Scale;
use super::text::{escape, fit, one_line};

/// Drawing units per pixel. Plotters supports only whole coordinates.
const UNITS: f64 = 10.0;
/// The room for the numbers and the name of an axis on the left, in pixels.
pub(super) const LEFT: f64 = 76.0;
/// The room for the numbers and the name of an axis at the bottom, in pixels.
pub(super) const BELOW: f64 = 52.0;
pub(super) const SMALL: f64 = 12.0;
const MEDIUM: f64 = 13.0;
const LARGE: f64 = 15.0;
pub(super) const INK: RGBColor = RGBColor(0x33, 0x33, 0x33);
pub(super) const GREY: RGBColor = RGBColor(0x6B, 0x6B, 0x6B);
const GRID: RGBColor = RGBColor(0xE3, 0xE3, 0xE3);

pub(super) type Fallible = Result<(), Box<dyn std::error::Error>>;
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Scale, Scale>>;

/// Converts pixels to drawing units.
pub(super) fn px(length: f64) -> i32 {
    (length * UNITS).round() as i32
}

pub(super) fn pen(colour: impl Color, width: f64) -> ShapeStyle {
    colour.stroke_width(px(width) as u32)
}

pub(super) fn font(size: f64, colour: RGBColor) -> TextStyle<'static> {
    // The backend divides sizes by 1.24. It needs no fonts: the viewer's sans-serif font shows the text.
    ("sans-serif", size * UNITS * 1.24).into_font().color(&colour)
}

/// Draws on an area with a size in pixels. The result is an SVG document without prolog, fit for embedding. `below` is
/// appended to the drawing.
pub(super) fn svg(
    title: &str,
    [width, height]: [f64; 2],
    below: &str,
    draw: impl FnOnce(&Area) -> Fallible,
) -> Result<String, ReportError> {
    let mut drawn = String::new();
    {
        let area =
            SVGBackend::with_string(&mut drawn, (px(width) as u32, px(height) as u32)).into_drawing_area();
        let title = fit(title, LARGE, width - LEFT - 10.0);
        let font = ("sans-serif", LARGE * UNITS * 1.24, FontStyle::Bold).into_font();
        area.draw(&Text::new(title, (px(LEFT), px(14.0)), font.color(&INK)))
            .map_err(Into::into)
            .and_then(|()| draw(&area))
            .and_then(|()| Ok(area.present()?))
            .map_err(|e| ReportError::Plot(e.to_string()))?;
    }
    // Replace the root element: its size is in pixels instead of drawing units, and it has a name for screen readers.
    let body = drawn.find('>').and_then(|end| drawn.get(end + 1..));
    let body = body.ok_or_else(|| ReportError::Plot("the drawing has no root element".into()))?;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {} {}\" \
         role=\"img\" stroke-linejoin=\"round\">\n<title>{}</title>\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>{below}{body}",
        px(width),
        px(height),
        escape(if title.is_empty() { "Plot" } else { title }),
    ))
}

/// A chart with axes and an optional grid, which leaves `top` and `right` pixels of the area free.
pub(super) fn chart<'a>(
    area: &Area<'a>,
    [top, right]: [f64; 2],
    names: [&str; 2],
    scales: [&Scale; 2],
    grid: bool,
) -> Result<Chart<'a>, Box<dyn std::error::Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(top))
        .margin_right(px(right))
        .margin_left(px(8.0))
        .x_label_area_size(px(BELOW))
        .y_label_area_size(px(LEFT - 8.0))
        .build_cartesian_2d(scales[0].clone(), scales[1].clone())?;
    axes(&mut chart, names, scales, grid)?;
    Ok(chart)
}

/// Draws numbers, ticks and names around a chart.
pub(super) fn axes(chart: &mut Chart, names: [&str; 2], scales: [&Scale; 2], grid: bool) -> Fallible {
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let labels = |length: u32, each: i32| (length as usize / px(1.0) as usize / each as usize).clamp(3, 9);
    let name = |k: usize| one_line(&fit(&scales[k].name(names[k]), MEDIUM, 400.0));
    let mut mesh = chart.configure_mesh();
    if !grid {
        mesh.disable_mesh();
    }
    mesh.x_desc(name(0))
        .y_desc(name(1))
        .x_labels(labels(width, 80))
        .y_labels(labels(height, 50))
        .max_light_lines(0)
        .bold_line_style(pen(GRID, 1.0))
        .axis_style(pen(INK, 1.0))
        .set_all_tick_mark_size(px(5.0))
        .label_style(font(SMALL, INK))
        .axis_desc_style(font(MEDIUM, INK))
        .draw()?;
    Ok(())
}

pub(super) fn note<At>(text: &str, at: At) -> Text<'static, At, String> {
    Text::new(one_line(text), at, font(SMALL, GREY).pos(Pos::new(HPos::Left, VPos::Bottom)))
}
