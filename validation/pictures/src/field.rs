use super::Image;
use super::colour::{Rgb, of_value};
use super::projection::{Projection, View};
use psidpd_core::model::kernel::{Kernel, KernelKind};
use psidpd_formats::Frame;

/// The choice of a density and of the plane on which it is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldOptions {
    /// The direction along which the plane is seen. The plane cuts the box in the middle. The oblique view counts as y.
    pub view: View,
    /// The distance of the plane in front of the middle of the box.
    pub offset: f64,
    pub kernel: Kernel,
    /// One species, or all species without a number.
    pub species: Option<usize>,
    /// The largest width and height in pixels; 0 means 720 by 640.
    pub size: [usize; 2],
}

impl FieldOptions {
    /// The density of all species with this kernel, in the plane of x and z (in two dimensions x and y).
    pub fn new(kernel: Kernel) -> FieldOptions {
        FieldOptions { view: View::Y, offset: 0.0, kernel, species: None, size: [0, 0] }
    }

    /// The direction along which the plane of a frame is seen.
    pub fn view_of(&self, dimensions: usize) -> View {
        match (dimensions, self.view) {
            (2, _) => View::Z,
            (_, View::Oblique) => View::Y,
            (_, view) => view,
        }
    }

    /// The density for models without one: the quadratic kernel of range 1.
    pub fn coarse(dimensions: usize) -> FieldOptions {
        FieldOptions::new(Kernel::new(KernelKind::Quadratic, 1.0, dimensions))
    }
}

/// A weighted local density `n(r) = Σ_j w(|r − r_j|)` on the pixels of a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub projection: Projection,
    /// Number densities, row after row from the top; NaN outside the box.
    pub values: Vec<f64>,
}

impl Field {
    /// The density of a frame in the plane through the middle of the box. Every particle counts, also at its own
    /// position, so this is the density that a further particle there would feel.
    pub fn of(frame: &Frame, options: &FieldOptions) -> Field {
        let view = options.view_of(frame.dimensions);
        let projection = Projection::fit(frame.domain, frame.dimensions, view, options.size, 0.0);
        let [width, height] = projection.size;
        let mut values = vec![0.0; width * height];
        let range = options.kernel.range();
        let reach = range * projection.scale;
        // In two dimensions all particles are in the plane, for any z.
        let plane = if frame.dimensions == 2 { None } else { Some(projection.middle() + options.offset) };
        for (x, species) in frame.x.iter().zip(frame.species) {
            if options.species.is_some_and(|s| s != *species as usize) {
                continue;
            }
            for x in images(frame, *x, range) {
                let off = plane.map_or(0.0, |plane| projection.toward(x) - plane);
                if off.abs() >= range {
                    continue;
                }
                let ([across, down], _) = projection.place(x);
                let span = |middle: f64, most: usize| {
                    let low = (middle - reach).floor().max(0.0) as usize;
                    low..((middle + reach).ceil().clamp(0.0, most as f64) as usize)
                };
                for row in span(down, height) {
                    for column in span(across, width) {
                        let dx = (column as f64 + 0.5 - across) / projection.scale;
                        let dy = (row as f64 + 0.5 - down) / projection.scale;
                        let r = (dx * dx + dy * dy + off * off).sqrt();
                        values[row * width + column] += options.kernel.value(r);
                    }
                }
            }
        }
        for row in 0..height {
            for column in 0..width {
                let point = projection.back([column as f64 + 0.5, row as f64 + 0.5]);
                let inside = frame.domain.fraction(point)[..2].iter().all(|s| (0.0..=1.0).contains(s));
                if !inside {
                    values[row * width + column] = f64::NAN;
                }
            }
        }
        Field { projection, values }
    }

    /// The largest value; 0 if the field has no value.
    pub fn max(&self) -> f64 {
        self.values.iter().fold(0.0, |a, b| if *b > a { *b } else { a })
    }
}

/// The positions of a particle and its images within `range` of the box.
fn images(frame: &Frame, x: [f64; 3], range: f64) -> Vec<[f64; 3]> {
    let periodic = frame.domain.periodic();
    let s = frame.domain.fraction(x);
    let shifts: [Vec<f64>; 3] = std::array::from_fn(|k| {
        if !periodic[k] || k >= frame.dimensions {
            return vec![0.0];
        }
        let near = range / frame.domain.height(k);
        let low = (-near - s[k]).ceil() as i32;
        let high = (1.0 + near - s[k]).floor() as i32;
        (low..=high).map(f64::from).collect()
    });
    let mut all = Vec::new();
    for i in &shifts[0] {
        for j in &shifts[1] {
            for k in &shifts[2] {
                all.push(frame.domain.point([s[0] + i, s[1] + j, s[2] + k]));
            }
        }
    }
    all
}

/// A field as pixels, from the colour of `low` to that of `high`, grey outside the box.
pub fn paint_field(field: &Field, low: f64, high: f64) -> Image {
    let span = if high > low { high - low } else { 1.0 };
    let pixels: Vec<Rgb> = field.values.iter().map(|v| of_value((v - low) / span)).collect();
    let [width, height] = field.projection.size;
    Image { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;

    /// Each pixel agrees with the sum over all images, of which there are none beyond walls. The volume integral of one
    /// particle's density is 1.
    #[test]
    fn the_field_is_the_sum_over_all_images() {
        for (dimensions, walls) in [(2, false), (2, true), (3, false), (3, true)] {
            let periodic = [true, !walls, dimensions == 3];
            let domain = PeriodicBox::orthogonal([1.0, -1.0, 0.0], [3.0, 2.0, 2.5], periodic).unwrap();
            let x = [[1.1, -0.9, 0.1], [3.9, 0.9, 2.4], [2.5, 0.1, 1.2], [2.0, 0.05, 1.0]];
            let species = [0, 1, 0, 1];
            let names = ["A".to_owned(), "B".to_owned()];
            let frame = Frame {
                step: 0,
                time: 0.0,
                dimensions,
                domain: &domain,
                names: &names,
                x: &x,
                v: None,
                species: &species,
                tag: &[],
            };
            let kernel = Kernel::new(KernelKind::Lucy, 1.3, dimensions);
            for only in [None, Some(1)] {
                let options = FieldOptions { size: [60, 60], species: only, ..FieldOptions::new(kernel) };
                let field = Field::of(&frame, &options);
                for row in 0..field.projection.size[1] {
                    for column in 0..field.projection.size[0] {
                        let point = field.projection.back([column as f64 + 0.5, row as f64 + 0.5]);
                        let mut sum = 0.0;
                        for (x, s) in x.iter().zip(species) {
                            if only.is_some_and(|only| only != s as usize) {
                                continue;
                            }
                            for c in 0..125 {
                                let shift =
                                    [c % 5 - 2, c / 5 % 5 - 2, if dimensions == 3 { c / 25 - 2 } else { 0 }];
                                if dimensions == 2 && c >= 25 || walls && shift[1] != 0 {
                                    continue;
                                }
                                let r: f64 = (0..dimensions)
                                    .map(|k| x[k] + f64::from(shift[k]) * domain.lengths()[k] - point[k])
                                    .map(|d| d * d)
                                    .sum();
                                sum += kernel.value(r.sqrt());
                            }
                        }
                        assert!(
                            (field.values[row * field.projection.size[0] + column] - sum).abs() < 1e-12,
                            "{column} {row}"
                        );
                    }
                }
                if dimensions == 2 && !walls {
                    let cell = field.projection.scale.powi(-2);
                    let integral = field.values.iter().sum::<f64>() * cell;
                    let count = if only.is_some() { 2.0 } else { 4.0 };
                    assert!((integral - count).abs() < 0.02, "{integral}");
                }
            }
        }
    }

    #[test]
    fn outside_a_slanted_box_there_is_nothing() {
        let edges = nalgebra::Matrix3::new(4.0, 2.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 1.0);
        let domain = PeriodicBox::new([0.0; 3], edges, [true, true, false]).unwrap();
        let names = ["A".to_owned()];
        let frame = Frame {
            step: 0,
            time: 0.0,
            dimensions: 2,
            domain: &domain,
            names: &names,
            x: &[[3.0, 2.0, 0.0]],
            v: None,
            species: &[0],
            tag: &[],
        };
        let field = Field::of(&frame, &FieldOptions::coarse(2));
        assert!(field.values[0].is_nan() && field.max() > 0.0);
        let image = paint_field(&field, 0.0, field.max());
        assert_eq!(image.get(0, 0), Some(of_value(f64::NAN)));
        let at = field.projection.place([3.0, 2.0, 0.0]).0;
        assert_eq!(image.get(at[0] as usize, at[1] as usize).unwrap()[0], of_value(1.0)[0]);
    }
}
