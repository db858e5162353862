//! Balls of one radius, nearer ones before farther ones.
//!
//! First the nearest ball of every pixel is found, then each pixel is shaded once.

use super::Image;
use super::colour::Rgb;

const WHITE: Rgb = [255; 3];
/// No ball.
const NONE: u32 = u32::MAX;

pub struct Balls {
    size: [usize; 2],
    /// Pixels.
    radius: f32,
    /// How much nearer than its middle the front of a ball is.
    reach: f32,
    /// The place of each ball in pixels, and its colour.
    balls: Vec<([f32; 2], Rgb)>,
    /// The position of the nearest surface in each pixel along the line of sight; larger is nearer to the viewer.
    pub depth: Vec<f32>,
    /// The number of the ball that has it.
    nearest: Vec<u32>,
}

impl Balls {
    /// For a picture of width and height `size`, and balls of so many pixels, whose front is the length `reach` before their middle.
    pub fn new(size: [usize; 2], radius: f64, reach: f64) -> Balls {
        let count = size[0] * size[1];
        Balls {
            size,
            radius: radius as f32,
            reach: reach as f32,
            balls: Vec::new(),
            depth: vec![f32::NEG_INFINITY; count],
            nearest: vec![NONE; count],
        }
    }

    /// A ball at a place in pixels, with its middle at the depth `toward`.
    pub fn add(&mut self, at: [f64; 2], toward: f64, colour: Rgb) {
        let number = self.balls.len() as u32;
        let [across, down] = at.map(|c| c as f32);
        let (radius, inverse) = (self.radius, self.radius.recip());
        let (reach, toward) = (self.reach, toward as f32);
        self.balls.push(([across, down], colour));
        for y in pixels(down, radius, self.size[1]) {
            let ny = (y as f32 + 0.5 - down) / radius;
            let rest = 1.0 - ny * ny;
            let row = pixels(across, radius * rest.max(0.0).sqrt(), self.size[0]);
            let from = y * self.size[0];
            let (first, row) = (row.start as f32 + 0.5 - across, from + row.start..from + row.end);
            let place = self.depth[row.clone()].iter_mut().zip(&mut self.nearest[row]);
            for (k, (depth, nearest)) in place.enumerate() {
                let nx = (first + k as i32 as f32) * inverse;
                let surface = toward + reach * (rest - nx * nx).max(0.0).sqrt();
                // By masks, so that the compiler makes vectors of the loop.
                let hides = u32::from(surface > *depth).wrapping_neg();
                *depth = depth.max(surface);
                *nearest = number & hides | *nearest & !hides;
            }
        }
    }

    pub fn shaded(&self) -> Image {
        let shades = Shades::new();
        let mut image = Image::filled(self.size[0], self.size[1], WHITE);
        let rows = image.pixels.chunks_mut(self.size[0].max(1)).zip(self.nearest.chunks(self.size[0].max(1)));
        for (y, (row, nearest)) in rows.enumerate() {
            for (x, (pixel, number)) in row.iter_mut().zip(nearest).enumerate() {
                // The number of no ball is behind all others.
                if let Some((at, colour)) = self.balls.get(*number as usize) {
                    let normal = [(x, at[0]), (y, at[1])].map(|(k, at)| (k as f32 + 0.5 - at) / self.radius);
                    *pixel = shades.of(*colour, normal);
                }
            }
        }
        image
    }
}

/// The pixels of `most` whose middles are within `radius` of a place.
fn pixels(at: f32, radius: f32, most: usize) -> std::ops::Range<usize> {
    let low = (at - radius - 0.5).ceil().clamp(0.0, most as f32) as usize;
    let high = (at + radius + 0.5).floor().clamp(0.0, most as f32) as usize;
    low..high.max(low)
}

/// Directions along an edge of the table of shades.
const FINE: usize = 128;

/// By how much of 256 a colour is mixed with white, and then with black, for the directions in which a surface faces.
struct Shades(Vec<[u16; 2]>);

impl Shades {
    fn new() -> Shades {
        let direction = |k: usize| (2 * k + 1) as f32 / FINE as f32 - 1.0;
        let all = (0..FINE * FINE).map(|k| shade(direction(k % FINE), direction(k / FINE)));
        Shades(all.map(|shares| shares.map(|share| (256.0 * share).round() as u16)).collect())
    }

    fn of(&self, colour: Rgb, normal: [f32; 2]) -> Rgb {
        let [x, y] = normal.map(|n| ((n + 1.0) * (0.5 * FINE as f32)).clamp(0.0, (FINE - 1) as f32) as usize);
        let [white, black] = self.0[y * FINE + x].map(u32::from);
        colour.map(|c| {
            let lit = 256 * u32::from(c) + (255 - u32::from(c)) * white;
            ((lit * (256 - black) + (1 << 15)) >> 16) as u8
        })
    }
}

/// Light from the upper left: a highlight there, shade on the other side, the unchanged colour in the middle.
fn shade(nx: f32, ny: f32) -> [f32; 2] {
    let nz = (1.0 - nx * nx - ny * ny).max(0.0).sqrt();
    let light = -0.5 * nx - 0.62 * ny;
    let rim = 0.45 * (1.0 - nz).powi(2);
    let white = (0.55 * light).clamp(0.0, 0.45) * nz.sqrt();
    [white, (rim + (-0.35 * light).max(0.0)).clamp(0.0, 0.6)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two balls by hand: of radius 10, and as large, 6 to the right and 5 nearer. Where both are, the surface of the second is before that of
    /// the first if √(100 − (x−6)²) + 5 > √(100 − x²), beyond x = −2.9.
    #[test]
    fn each_pixel_has_the_nearest_surface() {
        for order in [[0, 1], [1, 0]] {
            let mut balls = Balls::new([50, 40], 10.0, 10.0);
            let all = [([20.5, 20.5], 0.0, [200, 0, 0]), ([26.5, 20.5], 5.0, [0, 200, 0])];
            for (at, toward, colour) in order.map(|k| all[k]) {
                balls.add(at, toward, colour);
            }
            let image = balls.shaded();
            let is = |x: usize, k: usize| {
                image.get(x, 20).unwrap()[k] > 100 && image.get(x, 20).unwrap()[1 - k] < 120
            };
            assert!((12..18).all(|x| is(x, 0)) && (20..36).all(|x| is(x, 1)), "{order:?}");
            assert_eq!((image.get(9, 20), image.get(38, 20)), (Some(WHITE), Some(WHITE)));
            assert!((balls.depth[20 * 50 + 26] - 15.0).abs() < 1e-5);
            assert_eq!(balls.depth[0], f32::NEG_INFINITY);
        }
    }

    /// The middle of a ball has its colour, and shades of the table are within two of 255 of those of the formula.
    #[test]
    fn shades_are_those_of_the_formula() {
        let shades = Shades::new();
        let colour = [10, 120, 250];
        assert!(shades.of(colour, [0.0, 0.0]).iter().zip(colour).all(|(a, b)| a.abs_diff(b) <= 2));
        for k in 0..1000 {
            let (angle, far) = (0.37 * k as f32, 0.95 * (k as f32 / 1000.0).sqrt());
            let normal = [far * angle.cos(), far * angle.sin()];
            let [white, black] = shade(normal[0], normal[1]);
            for (found, c) in shades.of(colour, normal).iter().zip(colour.map(f32::from)) {
                let expected = (c + (255.0 - c) * white) * (1.0 - black);
                assert!((f32::from(*found) - expected).abs() < 5.0, "{normal:?} {found} {expected}");
            }
        }
    }
}
