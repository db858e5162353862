//! Lines shared out among spherical shells of equal thickness around the origin.
//!
//! The line −d passes the origin at the distance b, at the point p. At the distance u from there, r² = b² + u², the sums up to u of
//! the momentum that it carries along the radius, and in all, are
//!
//! ```text
//! G(u) = F ∫ (ê·r̂)² du − (f·p) ∫ (ê·r̂)/r du = F [u − b arctan(u/b)] − (f·p) ln r          L(u) = F u
//! ```
//!
//! with F = f·d/|d|; f·p is 0 but for forces at displaced positions, which have a component across the line. A shell gets the differences of G and L between the points where a line enters and leaves it. So each crossing of a
//! sphere adds to one shell what it takes from the next, and spheres hold these sums instead of shells. At the distance r from the
//! centre, with q = b/r, u − b arctan(u/b) = u B(q) with B(q) = 1 − q arccos(q)/√(1 − q²).
//!
//! What spheres get is computed in single precision: the error of 10⁻⁷ of a line is as much more for one shell as less for the next.

use crate::flux::{BLOCK, Lines};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::vectors::{Loop, integer, run_best};

/// Number of spheres in a vector.
const LANES: usize = 8;

/// B(q) in powers of 2q − 1, from 19 Chebyshev points on 0 ≤ q ≤ 1; u B(q) is exact to 2·10⁻¹⁵ r, as B has no singularity nearer than
/// q = −1.
const RADIAL: [f64; 19] = [
    0.39540021192192737,
    -0.4727997174374554,
    0.09693347461462647,
    -0.024948022563270816,
    0.006987758973299643,
    -0.002044350283436247,
    0.0006140772446200063,
    -0.0001877318099106242,
    5.8118057606280716e-05,
    -1.8163180943513735e-05,
    5.717702381376172e-06,
    -1.8080738190342905e-06,
    5.752131907975442e-07,
    -1.8734285467795428e-07,
    6.00533537419544e-08,
    -1.599391033294376e-08,
    5.145041951256982e-09,
    -3.3143978507833837e-09,
    1.0739518721790928e-09,
];

/// The same from 9 points: u B(q) is exact to 1.3·10⁻⁷ r.
const SHORT_RADIAL: [f32; 9] = [
    0.395_400_2,
    -0.472_798_9,
    0.096_933_22,
    -0.024_958_698,
    0.006_991_128,
    -0.002_006_694,
    0.000_602_197_24,
    -0.000_235_596_9,
    7.321_15e-5,
];

/// Shells around a centre.
#[derive(Debug, Clone)]
pub struct Spheres {
    bins: usize,
    thickness: f64,
    dimensions: usize,
    /// The radius, its reciprocal and its logarithm of each sphere, beginning with that of no radius, and of a vector more.
    radius: Vec<f32>,
    inverse: Vec<f32>,
    logarithm: Vec<f32>,
}

/// The box and the centre of the shells.
#[derive(Debug, Clone, Copy)]
pub struct Around {
    edges: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
    /// 1 along periods, else 0.
    period: [f64; 3],
    /// The point whose nearest images are taken, and the centre seen from there.
    near: [f64; 3],
    centre: [f64; 3],
}

impl Around {
    pub fn new(domain: &PeriodicBox, near: [f64; 3], centre: [f64; 3]) -> Around {
        Around {
            edges: [0, 1, 2].map(|k| domain.edge(k)),
            inverse: domain.inverse(),
            period: domain.periodic().map(|is| f64::from(u8::from(is))),
            near,
            centre,
        }
    }

    /// The position of the nearest image, seen from the centre.
    #[inline(always)]
    fn place(&self, x: [f64; 3]) -> [f64; 3] {
        let Around { edges, inverse, period, near, centre } = self;
        let d = [x[0] - near[0], x[1] - near[1], x[2] - near[2]];
        let mut s = [0.0; 3];
        for k in 0..3 {
            let fraction = inverse[k][0] * d[0] + inverse[k][1] * d[1] + inverse[k][2] * d[2];
            s[k] = fraction - period[k] * (fraction + 0.5).floor();
        }
        let at = |c: usize| s[0] * edges[0][c] + s[1] * edges[1][c] + s[2] * edges[2][c] - centre[c];
        [at(0), at(1), at(2)]
    }
}

impl Spheres {
    pub fn new(bins: usize, thickness: f64, dimensions: usize) -> Spheres {
        let radius: Vec<f64> = (0..bins + 1 + LANES).map(|k| k as f64 * thickness).collect();
        // No line crosses the sphere of no radius.
        let of_radii = |f: fn(f64) -> f64| -> Vec<f32> {
            std::iter::once(0.0).chain(radius[1..].iter().map(|r| f(*r) as f32)).collect()
        };
        Spheres {
            bins,
            thickness,
            dimensions,
            inverse: of_radii(|r| 1.0 / r),
            logarithm: of_radii(f64::ln),
            radius: radius.iter().map(|r| *r as f32).collect(),
        }
    }

    /// The number of entries of one sum: shells and what lies beyond, or spheres with room for a vector.
    fn entries(&self) -> usize {
        self.bins + 1 + LANES
    }

    /// The number of sums over lines.
    pub fn width(&self) -> usize {
        4 * self.entries()
    }

    /// Adds lines to `sums`.
    pub fn add(&self, around: &Around, lines: &Lines, seen: &mut Seen, sums: &mut [f64]) {
        match lines.parallel {
            true => run_best(Share::<true> { spheres: self, around, lines, seen, sums }),
            false => run_best(Share::<false> { spheres: self, around, lines, seen, sums }),
        }
    }

    /// The normal part and the whole of the lines in each shell.
    pub fn shells(&self, sums: &[f64]) -> impl Iterator<Item = [f64; 2]> {
        let part = |k: usize| &sums[k * self.entries()..][..self.entries()];
        let [normal, whole, of_normal, of_whole] = [0, 1, 2, 3].map(part);
        (0..self.bins).map(move |k| {
            [normal[k] + of_normal[k + 1] - of_normal[k], whole[k] + of_whole[k + 1] - of_whole[k]]
        })
    }
}

/// Adds a block of lines to the sums of shells and spheres. Forces along their lines have no `f·p`.
struct Share<'a, const PARALLEL: bool> {
    spheres: &'a Spheres,
    around: &'a Around,
    lines: &'a Lines,
    seen: &'a mut Seen,
    sums: &'a mut [f64],
}

/// A block of lines as seen from the centre.
#[derive(Debug)]
pub struct Seen {
    /// The distance of the line from the centre.
    b: [f32; BLOCK],
    /// F and `f·p`.
    force: [f32; BLOCK],
    across: [f32; BLOCK],
    /// The shells of both ends, and what they get: G and L.
    shell: [[u32; BLOCK]; 2],
    normal: [[f64; BLOCK]; 2],
    whole: [[f64; BLOCK]; 2],
    /// The spheres `first < k ≤ last` that the line crosses inwards, and those that it crosses outwards.
    inwards: [[f32; BLOCK]; 2],
    outwards: [[f32; BLOCK]; 2],
    /// The first of whole vectors of spheres that hold all of these, and the one past the last of them.
    crossed: [[u32; BLOCK]; 2],
}

impl Default for Seen {
    fn default() -> Seen {
        let (numbers, none) = ([0.0; BLOCK], [[0.0; BLOCK]; 2]);
        Seen {
            b: numbers,
            force: numbers,
            across: numbers,
            shell: [[0; BLOCK]; 2],
            normal: [[0.0; BLOCK]; 2],
            whole: [[0.0; BLOCK]; 2],
            inwards: none,
            outwards: none,
            crossed: [[0; BLOCK]; 2],
        }
    }
}

impl<const PARALLEL: bool> Loop for Share<'_, PARALLEL> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Share { spheres, around, lines, seen, sums } = self;
        see::<PARALLEL>(spheres, around, lines, seen);
        let entries = spheres.entries();
        let (of_shells, of_spheres) = sums.split_at_mut(2 * entries);
        let (normal, whole) = of_shells.split_at_mut(entries);
        let (of_normal, of_whole) = of_spheres.split_at_mut(entries);
        for k in 0..lines.count {
            for end in 0..2 {
                let shell = seen.shell[end][k] as usize;
                normal[shell] += seen.normal[end][k];
                whole[shell] += seen.whole[end][k];
            }
            let [in_first, in_last] = [seen.inwards[0][k], seen.inwards[1][k]];
            let [out_first, out_last] = [seen.outwards[0][k], seen.outwards[1][k]];
            let (b, force, across) = (seen.b[k], seen.force[k], seen.across[k]);
            let [first, end] = [seen.crossed[0][k], seen.crossed[1][k]].map(|k| k as usize);
            for at in (first..end).step_by(LANES) {
                let radius = lanes(&spheres.radius, at);
                let inverse = lanes(&spheres.inverse, at);
                let logarithm = lanes(&spheres.logarithm, at);
                let mut gains = [[0.0; LANES]; 2];
                for lane in 0..LANES {
                    let sphere = at as f32 + lane as f32;
                    let inwards = if sphere > in_first && sphere <= in_last { 1.0 } else { 0.0 };
                    let outwards = if sphere > out_first && sphere <= out_last { 1.0 } else { 0.0 };
                    let chord = ((radius[lane] - b) * (radius[lane] + b)).max(0.0).sqrt();
                    let whole = force * (inwards + outwards) * chord;
                    gains[0][lane] = whole * short_radial(b * inverse[lane]);
                    if !PARALLEL {
                        gains[0][lane] += across * (inwards - outwards) * logarithm[lane];
                    }
                    gains[1][lane] = whole;
                }
                for (sums, gains) in [&mut *of_normal, &mut *of_whole].into_iter().zip(&gains) {
                    let sums: &mut [f64; LANES] =
                        sums[at..].first_chunk_mut().expect("room for a vector behind the last sphere");
                    for lane in 0..LANES {
                        sums[lane] += f64::from(gains[lane]);
                    }
                }
            }
        }
    }
}

/// The [`LANES`] numbers that begin at `first`.
#[inline(always)]
fn lanes(values: &[f32], first: usize) -> &[f32; LANES] {
    values[first..].first_chunk().expect("room for a vector behind the last sphere")
}

/// Finds the ends of the lines in the shells, and the spheres between them.
#[inline(always)]
fn see<const PARALLEL: bool>(spheres: &Spheres, around: &Around, lines: &Lines, seen: &mut Seen) {
    let Lines { from, d, f, .. } = lines;
    let (per_length, most) = (1.0 / spheres.thickness, spheres.bins as f64);
    let depth = if spheres.dimensions == 2 { 0.0 } else { 1.0 };
    for k in 0..BLOCK {
        let [x, y, z] = around.place([from[0][k], from[1][k], from[2][k]]);
        let p = [x, y, depth * z];
        let (d, f) = ([d[0][k], d[1][k], d[2][k]], [f[0][k], f[1][k], f[2][k]]);
        let length = dot(d, d).sqrt();
        // A line of no length has no direction, and no force counts.
        let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
        let start = -dot(p, d) * inverse;
        let end = start + length;
        let area = cross(p, d);
        let b = dot(area, area).sqrt() * inverse;
        let b2 = b * b;
        let force = dot(d, f) * inverse;
        let across = if PARALLEL { 0.0 } else { dot(p, f) + force * start };
        (seen.b[k], seen.force[k], seen.across[k]) = (b as f32, force as f32, across as f32);
        let mut shells = [0.0; 2];
        for (side, (u, sign)) in [(start, -1.0), (end, 1.0)].into_iter().enumerate() {
            let square = (b2 + u * u).max(f64::MIN_POSITIVE);
            let r = square.sqrt();
            let normal = u * radial(b / r);
            let beside = if PARALLEL { 0.0 } else { 0.5 * across * ln(square) };
            seen.normal[side][k] = sign * (force * normal - beside);
            seen.whole[side][k] = sign * force * u;
            let shell = (r * per_length).floor().min(most);
            shells[side] = shell as f32;
            seen.shell[side][k] = integer(shells[side]);
        }
        let nearest = (b * per_length).floor().min(most) as f32;
        let [of_start, of_end] = shells;
        let comes = start < 0.0;
        let goes = end > 0.0;
        let inwards = [if goes { nearest } else { of_end }, if comes { of_start } else { 0.0 }];
        let outwards = [if comes { nearest } else { of_start }, if goes { of_end } else { 0.0 }];
        for side in 0..2 {
            (seen.inwards[side][k], seen.outwards[side][k]) = (inwards[side], outwards[side]);
        }
        let [of_inwards, of_outwards] =
            [inwards, outwards].map(|[first, last]| if first < last { first } else { most as f32 });
        let first = integer(of_inwards.min(of_outwards) + 1.0);
        seen.crossed[0][k] = first - first % LANES as u32;
        seen.crossed[1][k] = integer(inwards[1].max(outwards[1]) + 1.0);
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// B(q).
#[inline(always)]
fn radial(q: f64) -> f64 {
    let x = 2.0 * q - 1.0;
    let mut series = RADIAL[18];
    for k in (0..18).rev() {
        series = series * x + RADIAL[k];
    }
    series
}

#[inline(always)]
fn short_radial(q: f32) -> f32 {
    let x = 2.0 * q - 1.0;
    let mut series = SHORT_RADIAL[8];
    for k in (0..8).rev() {
        series = series * x + SHORT_RADIAL[k];
    }
    series
}

/// The natural logarithm of a positive normal number, without a branch: with x = m 2^k and √½ ≤ m < √2 it is k ln 2 + 2 artanh
/// (m − 1)/(m + 1), whose terms decrease by a factor of 34 or more.
#[inline(always)]
fn ln(x: f64) -> f64 {
    const TERMS: usize = 11;
    let bits = x.to_bits();
    let mantissa = f64::from_bits(bits & 0x000f_ffff_ffff_ffff | 0x3ff0_0000_0000_0000);
    // Numbers of 2⁵² and more hold an integer in their lowest bits.
    let exponent = f64::from_bits(bits >> 52 | 0x4330_0000_0000_0000) - 4_503_599_627_370_496.0 - 1023.0;
    let is_large = mantissa > std::f64::consts::SQRT_2;
    let m = if is_large { 0.5 * mantissa } else { mantissa };
    let k = if is_large { exponent + 1.0 } else { exponent };
    let t = (m - 1.0) / (m + 1.0);
    let square = t * t;
    let mut series = 1.0 / (2 * TERMS - 1) as f64;
    for n in (1..TERMS).rev() {
        series = series * square + 1.0 / (2 * n - 1) as f64;
    }
    k * std::f64::consts::LN_2 + 2.0 * t * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flux::Line;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    #[test]
    fn functions_are_those_of_the_library() {
        for k in 0..2000 {
            let q = f64::from(k) / 2000.0;
            let chord = (1.0 - q * q).sqrt();
            let expected = chord - q * q.acos();
            assert!((chord * radial(q) - expected).abs() < 1e-14, "{q}");
            assert!((chord * f64::from(short_radial(q as f32)) - expected).abs() < 5e-7, "{q}");
            let x = (0.3 * f64::from(k - 1000)).exp();
            assert!((ln(x) - x.ln()).abs() <= 1e-15 * x.ln().abs().max(1.0), "{x}");
        }
        assert!((ln(f64::MIN_POSITIVE) - f64::MIN_POSITIVE.ln()).abs() < 1e-12);
    }

    /// The shares of a line by functions of each shell, as they are defined: normal part and length.
    fn plain(line: &Line, thickness: f64, bins: usize) -> Vec<[f64; 2]> {
        let mut shells = vec![[0.0; 2]; bins];
        let r = dot(line.d, line.d).sqrt();
        if r == 0.0 {
            return shells;
        }
        let start = -dot(line.from, line.d) / r;
        let end = start + r;
        let area = cross(line.from, line.d);
        let b = dot(area, area).sqrt() / r;
        let force = dot(line.d, line.f) / r;
        let foot = dot(line.from, line.f) + force * start;
        let normal = |u: f64| if b > 0.0 { u - b * (u / b).atan() } else { u };
        let half_chord = |r: f64| (r * r - b * b).max(0.0).sqrt();
        for (k, shell) in shells.iter_mut().enumerate() {
            let (inner, outer) = (half_chord(k as f64 * thickness), half_chord((k + 1) as f64 * thickness));
            for (low, high) in [(-outer, -inner), (inner, outer)] {
                let (low, high) = (low.max(start), high.min(end));
                if high > low {
                    let square = |u: f64| (b * b + u * u).max(f64::MIN_POSITIVE);
                    let across = 0.5 * (square(high) / square(low)).ln();
                    shell[0] += force * (normal(high) - normal(low)) - foot * across;
                    shell[1] += force * (high - low);
                }
            }
        }
        shells
    }

    /// Shells get what they get by the definition: from lines in one shell, through many, through the centre, out of the range,
    /// across a face of a tilted box, and of no length, with forces along them and across.
    #[test]
    fn shells_get_their_shares() {
        let edges = nalgebra::Matrix3::new(9.0, 1.0, -0.7, 0.0, 8.0, 0.9, 0.0, 0.0, 8.5);
        let tilted = PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true; 3]).unwrap();
        let open = PeriodicBox::orthogonal([0.0; 3], [9.0; 3], [true, false, true]).unwrap();
        let mut random = StdRng::seed_from_u64(6);
        let mut vector = |scale: f64| -> [f64; 3] {
            std::array::from_fn(|_| scale * (2.0 * random.random::<f64>() - 1.0))
        };
        for (domain, dimensions) in [(tilted, 3), (open.clone(), 3), (open, 2)] {
            let (bins, thickness) = (20, 0.15);
            let spheres = Spheres::new(bins, thickness, dimensions);
            let flat = |x: [f64; 3]| if dimensions == 2 { [x[0], x[1], 0.0] } else { x };
            let (near, centre) = (domain.point([0.9, 0.8, 0.1]), flat(vector(0.2)));
            let lines: Vec<Line> = (0..2000)
                .map(|k| {
                    let (place, d) = (flat(vector(3.0)), flat(vector([0.03, 0.6, 4.0, 0.0][k % 4])));
                    let across = if k % 3 == 0 { 0.1 } else { 0.0 };
                    let off = flat(vector(across));
                    let f = std::array::from_fn(|c| 2.0 * d[c] + off[c]);
                    // Through the centre.
                    let place = if k % 50 == 0 { d.map(|c| 0.5 * c) } else { place };
                    Line { from: place, d, f }
                })
                .collect();
            let mut expected = vec![[0.0; 2]; bins];
            for line in &lines {
                let shares = plain(line, thickness, bins);
                expected.iter_mut().zip(shares).for_each(|(e, s)| (0..2).for_each(|c| e[c] += s[c]));
            }
            let around = Around::new(&domain, near, centre);
            let mut sums = vec![0.0; spheres.width()];
            let boxes = domain.edge(0);
            let moved = lines.iter().enumerate().map(|(k, line)| {
                let at = |c: usize| near[c] + centre[c] + line.from[c] + (k % 3) as f64 * boxes[c];
                Line { from: [0, 1, 2].map(at), ..*line }
            });
            let (along, across): (Vec<Line>, Vec<Line>) = moved.partition(|line| {
                let area = cross(line.d, line.f);
                dot(area, area).sqrt() < 1e-12
            });
            for (parallel, lines) in [(true, along), (false, across)] {
                Lines::default().in_blocks(parallel, lines.into_iter(), |lines| {
                    spheres.add(&around, lines, &mut Seen::default(), &mut sums);
                });
            }
            let scale = expected.iter().flatten().fold(1.0f64, |most, x| most.max(x.abs()));
            for (k, (found, expected)) in spheres.shells(&sums).zip(&expected).enumerate() {
                for c in 0..2 {
                    let off = (found[c] - expected[c]).abs();
                    assert!(off < 1e-6 * scale, "{dimensions} {k}: {found:?} {expected:?}");
                }
            }
        }
    }
}
