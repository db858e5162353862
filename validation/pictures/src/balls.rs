//! Balls of one radius, and points, nearer ones before farther ones.
//!
//! A picture is drawn in bands, and bands in squares of pixels. First the nearest ball of every pixel is found, then each pixel is shaded
//! once. Balls are drawn from front to back, and not at all in squares where everything is nearer.

use super::Image;
use super::colour::{Rgb, mix};
use std::ops::Range;

const WHITE: Rgb = [255; 3];
/// The colour of points.
pub const GREY: Rgb = [0x70; 3];
/// No ball.
const NONE: u32 = u32::MAX;
/// Pixels are computed at this many times the resolution, and averaged.
pub const FINER: usize = 2;
/// Fine pixels along an edge of a square, and across a band.
const SIDE: usize = 8;
/// Pixels of the picture along an edge of a square.
const COARSE: usize = SIDE / FINER;

/// Places and lengths are in fine pixels.
pub struct Ball {
    pub at: [f32; 2],
    /// The position of the middle along the line of sight; larger is nearer to the viewer.
    pub toward: f32,
    pub colour: Rgb,
}

/// Mixes half of grey into a pixel, if no ball is before it.
pub struct Point {
    pub at: [usize; 2],
    pub toward: f32,
}

/// Draws a picture of width and height `size`, in pixels, with balls of one radius, whose front is the length `reach` before their middle.
pub fn draw(size: [usize; 2], radius: f32, reach: f32, mut balls: Vec<Ball>, points: &[Point]) -> Image {
    balls.sort_by(|a, b| b.toward.total_cmp(&a.toward));
    let [columns, rows] = size.map(|n| n.div_ceil(COARSE));
    let (mut balls_of, mut points_of) = (vec![Vec::new(); rows], vec![Vec::new(); rows]);
    for (number, ball) in balls.iter().enumerate() {
        for row in squares(ball.at[1], radius, rows) {
            balls_of[row].push(number as u32);
        }
    }
    for point in points {
        points_of[point.at[1] / SIDE].push(point);
    }
    let shades = Shades::new(radius);
    let mut image = Image::filled(size[0], size[1], WHITE);
    let mut band = Band { top: 0.0, radius, reach, squares: vec![Square::EMPTY; columns] };
    let pixels = image.pixels.chunks_mut((size[0] * COARSE).max(1));
    for (row, ((pixels, numbers), points)) in pixels.zip(balls_of).zip(points_of).enumerate() {
        band.top = (row * SIDE) as f32;
        band.squares.fill(Square::EMPTY);
        for number in numbers {
            band.draw(number, &balls[number as usize]);
        }
        for (column, square) in band.squares.iter_mut().enumerate() {
            square.shade([column * SIDE, row * SIDE], &balls, &shades);
        }
        for point in points {
            let [x, y] = point.at;
            band.squares[x / SIDE].blend([x % SIDE, y % SIDE], point.toward);
        }
        for (y, pixels) in pixels.chunks_mut(size[0]).enumerate() {
            for (pixels, square) in pixels.chunks_mut(COARSE).zip(&band.squares) {
                square.average(y, pixels);
            }
        }
    }
    image
}

struct Band {
    /// The upper end.
    top: f32,
    radius: f32,
    reach: f32,
    squares: Vec<Square>,
}

impl Band {
    fn draw(&mut self, number: u32, ball: &Ball) {
        let [across, down] = ball.at;
        // The part of the ball in the band is as wide as at the place next to its middle.
        let off = (down - down.clamp(self.top, self.top + SIDE as f32)) / self.radius;
        let wide = self.radius * (1.0 - off * off).max(0.0).sqrt();
        for x in squares(across, wide, self.squares.len()) {
            let square = &mut self.squares[x];
            if ball.toward + self.reach > square.back {
                let corner = [(x * SIDE) as f32 - across, self.top - down];
                square.draw(number, corner, ball.toward, self.radius.recip(), self.reach);
            }
        }
    }
}

#[derive(Clone)]
struct Square {
    /// The position of the nearest surface in each pixel along the line of sight.
    depth: [[f32; SIDE]; SIDE],
    /// The number of the ball that has it.
    nearest: [[u32; SIDE]; SIDE],
    /// The smallest depth.
    back: f32,
    pixels: [[Rgb; SIDE]; SIDE],
}

impl Square {
    const EMPTY: Square = Square {
        depth: [[f32::NEG_INFINITY; SIDE]; SIDE],
        nearest: [[NONE; SIDE]; SIDE],
        back: f32::NEG_INFINITY,
        pixels: [[WHITE; SIDE]; SIDE],
    };

    /// Draws the part of a ball that is in the square, whose upper left corner is at `corner` from the middle of the ball.
    fn draw(&mut self, number: u32, [left, top]: [f32; 2], toward: f32, inverse: f32, reach: f32) {
        let mut back = [f32::INFINITY; SIDE];
        for (y, (depth, nearest)) in self.depth.iter_mut().zip(&mut self.nearest).enumerate() {
            let ny = (top + y as f32 + 0.5) * inverse;
            // Loops over arrays without branches become vectors.
            let surface: [f32; SIDE] = std::array::from_fn(|x| {
                let nx = (left + x as f32 + 0.5) * inverse;
                // Not a number beyond the rim, where nothing is hidden.
                toward + reach * (1.0 - ny * ny - nx * nx).sqrt()
            });
            for x in 0..SIDE {
                nearest[x] = if surface[x] > depth[x] { number } else { nearest[x] };
            }
            for x in 0..SIDE {
                depth[x] = if surface[x] > depth[x] { surface[x] } else { depth[x] };
                back[x] = if back[x] < depth[x] { back[x] } else { depth[x] };
            }
        }
        self.back = back.into_iter().fold(f32::INFINITY, f32::min);
    }

    fn shade(&mut self, corner: [usize; 2], balls: &[Ball], shades: &Shades) {
        for (y, (pixels, nearest)) in self.pixels.iter_mut().zip(&self.nearest).enumerate() {
            for (x, (pixel, number)) in pixels.iter_mut().zip(nearest).enumerate() {
                // The number of no ball is behind all others.
                if let Some(ball) = balls.get(*number as usize) {
                    let from = |k: usize, at: usize| (corner[k] + at) as i32 as f32 + 0.5 - ball.at[k];
                    *pixel = shades.of(ball.colour, [from(0, x), from(1, y)]);
                }
            }
        }
    }

    fn blend(&mut self, [x, y]: [usize; 2], toward: f32) {
        if toward > self.depth[y][x] {
            self.pixels[y][x] = mix(self.pixels[y][x], GREY, 0.5);
        }
    }

    /// Averages pixels into those of a row of the picture.
    fn average(&self, row: usize, pixels: &mut [Rgb]) {
        const COUNT: usize = FINER * FINER;
        for (k, pixel) in pixels.iter_mut().enumerate() {
            let fine = |j: usize| self.pixels[row * FINER + j / FINER][k * FINER + j % FINER];
            let sum = |c: usize| (0..COUNT).map(|j| usize::from(fine(j)[c])).sum::<usize>();
            *pixel = std::array::from_fn(|c| ((sum(c) + COUNT / 2) / COUNT) as u8);
        }
    }
}

/// The squares, of `most`, that are within a distance of a place.
fn squares(at: f32, distance: f32, most: usize) -> Range<usize> {
    let [low, high] = [at - distance, at + distance].map(|c| c / SIDE as f32);
    let low = low.clamp(0.0, most as f32) as usize;
    low..((high + 1.0).clamp(0.0, most as f32) as usize).max(low)
}

/// Directions along an edge of the table of shades.
const FINE: usize = 128;

/// The share of its colour and the white that a surface shows, for the directions in which it faces.
struct Shades {
    radius: f32,
    /// Steps of the table in a fine pixel.
    scale: f32,
    /// The share of the colour in parts of 65536, and the white in parts of 256.
    table: Vec<[u16; 2]>,
}

impl Shades {
    fn new(radius: f32) -> Shades {
        let direction = |k: usize| (2 * k + 1) as f32 / FINE as f32 - 1.0;
        let all = (0..FINE * FINE).map(|k| shade(direction(k % FINE), direction(k / FINE)));
        let parts = |[white, black]: [f32; 2]| {
            let [share, white] =
                [65536.0 * (1.0 - white), 255.0 * 256.0 * white].map(|part| part * (1.0 - black));
            [share.min(65535.0) as u16, white as u16]
        };
        Shades { radius, scale: 0.5 * FINE as f32 / radius, table: all.map(parts).collect() }
    }

    /// The colour at a place from the middle of a ball.
    fn of(&self, colour: Rgb, place: [f32; 2]) -> Rgb {
        let [x, y] =
            place.map(|p| (((p + self.radius) * self.scale) as i32).clamp(0, FINE as i32 - 1) as usize);
        let [share, white] = self.table[y * FINE + x].map(u32::from);
        colour.map(|c| ((u32::from(c) * share + (white << 8) + (1 << 15)) >> 16) as u8)
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
    /// the first if √(100 − (x−6)²) + 5 > √(100 − x²), beyond x = −2.9. A point is before the middle of the second beyond 15.
    #[test]
    fn each_pixel_has_the_nearest_surface() {
        let all = [([20.5, 20.5], 0.0, [200, 0, 0]), ([26.5, 20.5], 5.0, [0, 200, 0])];
        let picture = |order: [usize; 2], toward| {
            let balls = order.map(|k| all[k]).map(|(at, toward, colour)| Ball { at, toward, colour });
            draw([25, 20], 10.0, 10.0, balls.into(), &[Point { at: [26, 20], toward }])
        };
        let hidden = picture([0, 1], 14.99);
        assert_eq!(hidden, picture([1, 0], 14.99));
        let is = |x: usize, k: usize| {
            hidden.get(x, 10).unwrap()[k] > 100 && hidden.get(x, 10).unwrap()[1 - k] < 120
        };
        assert!((6..9).all(|x| is(x, 0)) && (10..18).all(|x| is(x, 1)));
        assert_eq!((hidden.get(4, 10), hidden.get(19, 10)), (Some(WHITE), Some(WHITE)));
        let before = picture([0, 1], 15.01);
        assert!(before.get(13, 10).unwrap()[0] > hidden.get(13, 10).unwrap()[0] + 10);
        assert_eq!(before.get(14, 10), hidden.get(14, 10));
    }

    /// The middle of a ball has its colour, and shades of the table are within two of 255 of those of the formula.
    #[test]
    fn shades_are_those_of_the_formula() {
        let shades = Shades::new(1.0);
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
