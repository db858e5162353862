use super::Image;
use super::colour::{Rgb, mix, of_species};
use super::projection::{Projection, View};
use psidpd_core::engine::vectors::{Loop, run_best};
use psidpd_formats::Frame;
use std::ops::Range;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ParticleOptions {
    pub view: View,
    /// The thickness of a slice through the middle of the box, across the line of sight. Only particles in it are shown.
    pub slice: Option<f64>,
    /// The distance of the slice in front of the middle of the box.
    pub offset: f64,
    /// The radius of a particle as a length; the default makes neighbours almost touch.
    pub radius: Option<f64>,
    /// The largest width and height in pixels; 0 means 720 by 640.
    pub size: [usize; 2],
}

impl ParticleOptions {
    /// The radius for a frame is 0.4 of the mean spacing, at most 0.3 lengths of the model. In a box that is mostly
    /// empty the mean spacing is larger than the distance of neighbours.
    fn radius(&self, frame: &Frame) -> f64 {
        self.radius.unwrap_or_else(|| {
            let share = frame.domain.volume(frame.dimensions) / frame.len().max(1) as f64;
            (0.4 * share.powf(1.0 / frame.dimensions as f64)).min(0.3)
        })
    }
}

/// Pixels are computed at this many times the resolution, and averaged.
const FINER: usize = 2;
const WHITE: Rgb = [255; 3];
const EDGE: Rgb = [0x70, 0x70, 0x70];

/// Draws particles as shaded balls, nearer ones before farther ones, with the edges of the box. The middle of
/// the foremost ball has exactly the colour of its species; farther balls fade.
pub fn draw_particles(frame: &Frame, options: &ParticleOptions) -> (Image, Projection) {
    let colours: Vec<Rgb> = frame.species.iter().map(|s| of_species(*s as usize)).collect();
    draw_coloured(frame, options, &colours)
}

pub fn draw_coloured(frame: &Frame, options: &ParticleOptions, colours: &[Rgb]) -> (Image, Projection) {
    let view = if frame.dimensions == 2 { View::Z } else { options.view };
    let radius = options.radius(frame).max(1e-9);
    // Along an axis the picture ends with the box. In the oblique view particles at corners extend beyond the box.
    let margin = if view == View::Oblique { radius } else { 0.0 };
    let projection = Projection::fit(frame.domain, frame.dimensions, view, options.size, margin);
    let size = projection.size.map(|s| s * FINER);
    let mut canvas = Canvas {
        image: Image::filled(size[0], size[1], WHITE),
        depth: vec![f32::NEG_INFINITY; size[0] * size[1]],
        foremost: vec![NONE; size[0] * size[1]],
        balls: Vec::with_capacity(frame.len()),
    };
    let fine = FINER as f64;
    // A particle smaller than a pixel would flicker as it moves.
    let pixels = (radius * projection.scale * fine).max(0.75 * fine);
    let reach = pixels / fine / projection.scale;
    let fades = frame.dimensions == 3 && options.slice.is_none();
    for (x, colour) in frame.x.iter().zip(colours) {
        let toward = projection.toward(*x);
        let from_slice = (toward - projection.middle() - options.offset).abs();
        if options.slice.is_some_and(|thickness| from_slice > 0.5 * thickness) {
            continue;
        }
        let ([across, down], near) = projection.place(*x);
        let colour = if fades { mix(*colour, WHITE, 0.45 * (1.0 - near).clamp(0.0, 1.0)) } else { *colour };
        canvas.place(Ball { at: [across * fine, down * fine], radius: pixels, colour }, toward, reach);
    }
    canvas.shade();
    canvas.edges(frame, &projection);
    (canvas.image.reduced(FINER), projection)
}

struct Canvas {
    image: Image,
    /// The position of the surface in each pixel along the line of sight; larger is nearer to the viewer.
    depth: Vec<f32>,
    /// The ball that is seen in each pixel, and [`NONE`] where there is none.
    foremost: Vec<u32>,
    balls: Vec<Ball>,
}

const NONE: u32 = u32::MAX;

/// A ball in pixels.
struct Ball {
    at: [f64; 2],
    radius: f64,
    colour: Rgb,
}

impl Ball {
    /// The pixels along a direction that the ball may cover, of `most`.
    fn range(&self, direction: usize, most: usize) -> Range<usize> {
        let low = (self.at[direction] - self.radius).floor().max(0.0) as usize;
        let high = (self.at[direction] + self.radius).ceil().clamp(0.0, most as f64) as usize;
        low.min(high)..high
    }

    /// The place of the middle of a pixel, in radii.
    fn place(&self, direction: usize, pixel: usize) -> f64 {
        (pixel as f64 + 0.5 - self.at[direction]) / self.radius
    }
}

impl Canvas {
    /// Hides what is behind a ball. Its middle is at depth `toward`; its front is `reach` (a length) nearer.
    fn place(&mut self, ball: Ball, toward: f64, reach: f64) {
        let number = self.balls.len() as u32;
        let columns = ball.range(0, self.image.width);
        for y in ball.range(1, self.image.height) {
            let ny = ball.place(1, y);
            let row = y * self.image.width..(y + 1) * self.image.width;
            run_best(Hide {
                depth: &mut self.depth[row.clone()][columns.clone()],
                foremost: &mut self.foremost[row][columns.clone()],
                number,
                first: ball.place(0, columns.start) as f32,
                step: (1.0 / ball.radius) as f32,
                ny: ny as f32,
                toward: toward as f32,
                reach: reach as f32,
            });
        }
        self.balls.push(ball);
    }

    /// Colours the pixels of all balls: each once, of the foremost.
    fn shade(&mut self) {
        let width = self.image.width;
        for (k, (pixel, foremost)) in self.image.pixels.iter_mut().zip(&self.foremost).enumerate() {
            if let Some(ball) = self.balls.get(*foremost as usize) {
                let (nx, ny) = (ball.place(0, k % width), ball.place(1, k / width));
                *pixel = shade(ball.colour, nx, ny, (1.0 - nx * nx - ny * ny).max(0.0).sqrt());
            }
        }
    }

    /// Draws the edges of the box, hidden behind particles.
    fn edges(&mut self, frame: &Frame, projection: &Projection) {
        let fine = FINER as f64;
        for c in 0..1usize << frame.dimensions {
            for k in (0..frame.dimensions).filter(|k| (c >> k) & 1 == 0) {
                let end = |c: usize| frame.domain.point([0, 1, 2].map(|k| ((c >> k) & 1) as f64));
                let (a, b) = (end(c), end(c | 1 << k));
                let ([ax, ay], [bx, by]) = (projection.place(a).0, projection.place(b).0);
                let steps = (2.0 * fine * (ax - bx).hypot(ay - by)).ceil().max(1.0) as usize;
                for s in 0..=steps {
                    let t = s as f64 / steps as f64;
                    let point: [f64; 3] = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
                    let [x, y] = projection.place(point).0.map(|c| c * fine);
                    let toward = projection.toward(point);
                    // The line is two fine pixels wide, so it is one pixel wide in the reduced image.
                    for (dx, dy) in [(0.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (-1.0, -1.0)] {
                        let x = (x + dx).clamp(0.0, (self.image.width - 1) as f64) as usize;
                        let y = (y + dy).clamp(0.0, (self.image.height - 1) as f64) as usize;
                        if toward as f32 > self.depth[y * self.image.width + x] {
                            self.image.blend(x, y, EDGE, 0.5);
                        }
                    }
                }
            }
        }
    }
}

/// Hides what is behind a ball in a row of pixels.
struct Hide<'a> {
    depth: &'a mut [f32],
    foremost: &'a mut [u32],
    number: u32,
    /// The place of the first pixel in radii, the distance of pixels, and the place of the row.
    first: f32,
    step: f32,
    ny: f32,
    toward: f32,
    reach: f32,
}

impl Loop for Hide<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Hide { depth, foremost, number, first, step, ny, toward, reach } = self;
        for (k, (depth, foremost)) in depth.iter_mut().zip(foremost).enumerate() {
            let nx = first + k as f32 * step;
            let rest = 1.0 - nx * nx - ny * ny;
            let here = toward + reach * rest.max(0.0).sqrt();
            let is_seen = rest > 0.0 && here > *depth;
            *depth = if is_seen { here } else { *depth };
            *foremost = if is_seen { number } else { *foremost };
        }
    }
}

/// Light from the upper left: a highlight there, shade on the other side, the unchanged colour in the middle.
fn shade(colour: Rgb, nx: f64, ny: f64, nz: f64) -> Rgb {
    let light = -0.5 * nx - 0.62 * ny;
    let rim = 0.45 * (1.0 - nz).powi(2);
    let lit = mix(colour, WHITE, (0.55 * light).clamp(0.0, 0.45) * nz.sqrt());
    mix(lit, [0; 3], (rim + (-0.35 * light).max(0.0)).clamp(0.0, 0.6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;

    fn frame<'a>(
        domain: &'a PeriodicBox,
        dimensions: usize,
        names: &'a [String],
        x: &'a [[f64; 3]],
        species: &'a [i32],
    ) -> Frame<'a> {
        Frame { step: 0, time: 0.0, dimensions, domain, names, x, v: None, species, tag: &[] }
    }

    fn names() -> [String; 2] {
        ["A".into(), "B".into()]
    }

    fn at(image: &Image, place: [f64; 2]) -> Rgb {
        image.get(place[0] as usize, place[1] as usize).unwrap()
    }

    /// The largest difference of two colours in red, green or blue.
    fn distance(a: Rgb, b: Rgb) -> u8 {
        (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap()
    }

    #[test]
    fn a_particle_has_its_colour_where_it_is() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0, 4.0, 1.0], [true, true, false]).unwrap();
        let names = names();
        let x = [[1.0, 1.0, 0.5], [3.0, 2.5, 0.5]];
        let frame = frame(&domain, 2, &names, &x, &[0, 1]);
        let (image, projection) = draw_particles(&frame, &ParticleOptions::default());
        for (x, species) in x.iter().zip([0, 1]) {
            let found = at(&image, projection.place(*x).0);
            assert!(distance(found, of_species(species)) < 12, "{found:?}");
        }
        // One radius from the middle is background; half a radius from the middle is not.
        let [across, down] = projection.place(x[0]).0;
        let radius = 0.3 * projection.scale;
        assert_eq!(at(&image, [across + 1.1 * radius, down]), WHITE);
        assert_ne!(at(&image, [across + 0.5 * radius, down]), WHITE);
        assert_eq!((image.width, image.height), (640, 640));
        assert!(distance(image.get(320, 0).unwrap(), EDGE) < 100, "{:?}", image.get(320, 0));
    }

    #[test]
    fn nearer_particles_hide_farther_ones_whatever_their_order() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let names = names();
        // In the view along y from its lower end, the first particle is before the second.
        let near = [2.0, 0.0, 2.0];
        let far = [2.1, 3.0, 2.0];
        for (x, species) in [([near, far], [1, 0]), ([far, near], [0, 1])] {
            let options = ParticleOptions { view: View::Y, ..Default::default() };
            let frame = frame(&domain, 3, &names, &x, &species);
            let (image, projection) = draw_particles(&frame, &options);
            let found = at(&image, projection.place(near).0);
            assert!(distance(found, of_species(1)) < 12, "{found:?}");
        }
    }

    #[test]
    fn a_slice_shows_the_middle_only() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let names = names();
        let x = [[1.0, 2.1, 1.0], [3.0, 0.5, 3.0]];
        let options = ParticleOptions { view: View::Y, slice: Some(1.0), ..Default::default() };
        let (image, projection) = draw_particles(&frame(&domain, 3, &names, &x, &[0, 1]), &options);
        assert!(distance(at(&image, projection.place(x[0]).0), of_species(0)) < 12);
        assert_eq!(at(&image, projection.place(x[1]).0), WHITE);
        // The second particle is 1.5 below the middle in y, and so in front of it.
        let other = ParticleOptions { offset: 1.5, ..options };
        let (image, projection) = draw_particles(&frame(&domain, 3, &names, &x, &[0, 1]), &other);
        assert!(distance(at(&image, projection.place(x[1]).0), of_species(1)) < 12);
        assert_eq!(at(&image, projection.place(x[0]).0), WHITE);
    }

    #[test]
    fn no_particle_may_be_too_small_or_outside() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4000.0, 4.0, 4.0], [true; 3]).unwrap();
        let names = names();
        let x = [[2000.0, 2.0, 2.0], [9e9, -9e9, 0.0], [-1.0, 2.0, 2.0]];
        for view in [View::Oblique, View::X, View::Y, View::Z] {
            let options = ParticleOptions { view, radius: Some(1e-6), ..Default::default() };
            let (image, projection) = draw_particles(&frame(&domain, 3, &names, &x, &[0, 1, 9]), &options);
            assert_ne!(at(&image, projection.place(x[0]).0), WHITE, "{view:?}");
        }
    }
}
