use super::Image;
use super::balls::{Ball, FINER, Point, draw};
use super::colour::{Rgb, mix, of_species};
use super::projection::{Projection, View};
use psidpd_formats::Frame;

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

const WHITE: Rgb = [255; 3];

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
    let fine = FINER as f64;
    // A particle smaller than a pixel would flicker as it moves.
    let pixels = (radius * projection.scale * fine).max(0.75 * fine);
    let mut shown = Vec::with_capacity(frame.len());
    let fades = frame.dimensions == 3 && options.slice.is_none();
    for (x, colour) in frame.x.iter().zip(colours) {
        let toward = projection.toward(*x) - projection.middle();
        let from_slice = (toward - options.offset).abs();
        if options.slice.is_some_and(|thickness| from_slice > 0.5 * thickness) {
            continue;
        }
        let ([across, down], near) = projection.place(*x);
        let colour = if fades { mix(*colour, WHITE, 0.45 * (1.0 - near).clamp(0.0, 1.0)) } else { *colour };
        let at = [across, down].map(|c| (c * fine) as f32);
        shown.push(Ball { at, toward: toward as f32, colour });
    }
    let reach = pixels / fine / projection.scale;
    let image = draw(projection.size, pixels as f32, reach as f32, shown, &edges(frame, &projection));
    (image, projection)
}

/// The edges of the box.
fn edges(frame: &Frame, projection: &Projection) -> Vec<Point> {
    let fine = FINER as f64;
    let mut points = Vec::new();
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
                let toward = (projection.toward(point) - projection.middle()) as f32;
                // The line is two fine pixels wide, so it is one pixel wide in the picture.
                for (dx, dy) in [(0.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (-1.0, -1.0)] {
                    let most = projection.size.map(|n| (n * FINER - 1) as f64);
                    let at = [(x + dx).clamp(0.0, most[0]) as usize, (y + dy).clamp(0.0, most[1]) as usize];
                    points.push(Point { at, toward });
                }
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balls::GREY;
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
        assert!(distance(image.get(320, 0).unwrap(), GREY) < 100, "{:?}", image.get(320, 0));
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
