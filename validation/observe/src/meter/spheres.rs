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
//! sphere adds to one shell what it takes from the next, and spheres hold these sums instead of shells. On the sphere of radius R, with
//! q = b/R, u = R √(1 − q²), and u − b arctan(u/b) = R Φ(q) with Φ(q) = √(1 − q²) − q arccos q.

use crate::flux::{BLOCK, Lines};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::vectors::{Loop, run_best};

/// Number of spheres in a vector.
const LANES: usize = 8;

/// `Φ(q)/(1 − q)^{3/2}` in powers of 2q − 1, from 14 Chebyshev points on 0 ≤ q ≤ 1: exact to 3·10⁻¹⁵, as the function has no
/// singularity nearer than q = −1.
const PHI: [f64; 15] = [
    0.9685287633970561,
    -0.028167834290562233,
    0.0027982527541668524,
    -0.00041180955857242227,
    7.399821008840123e-05,
    -1.5012798407768814e-05,
    3.3048990020104247e-06,
    -7.714469792e-07,
    1.882184936e-07,
    -4.764533655e-08,
    1.237226711e-08,
    -3.137753319e-09,
    8.469428961e-10,
    -3.313550807e-10,
    9.301431035e-11,
];

/// Shells around a centre.
#[derive(Debug, Clone)]
pub struct Spheres {
    bins: usize,
    thickness: f64,
    dimensions: usize,
    /// The radius, its reciprocal and its logarithm of each sphere, beginning with that of no radius, and of a vector more.
    radius: Vec<f64>,
    inverse: Vec<f64>,
    logarithm: Vec<f64>,
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
        Spheres {
            bins,
            thickness,
            dimensions,
            inverse: radius.iter().map(|r| 1.0 / r).collect(),
            logarithm: radius.iter().map(|r| r.ln()).collect(),
            radius,
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
    pub fn add(&self, around: &Around, lines: &Lines, sums: &mut [f64]) {
        run_best(Share { spheres: self, around, lines, sums });
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

/// Adds a block of lines to the sums of shells and spheres.
struct Share<'a> {
    spheres: &'a Spheres,
    around: &'a Around,
    lines: &'a Lines,
    sums: &'a mut [f64],
}

/// A block of lines as seen from the centre.
struct Seen {
    /// The distance of the line from the centre.
    b: [f64; BLOCK],
    /// F and `f·p`.
    force: [f64; BLOCK],
    across: [f64; BLOCK],
    /// The shells of both ends, and what they get: G and L.
    shell: [[u32; BLOCK]; 2],
    normal: [[f64; BLOCK]; 2],
    whole: [[f64; BLOCK]; 2],
    /// The spheres `first < k ≤ last` that the line crosses inwards, and those that it crosses outwards.
    inwards: [[f64; BLOCK]; 2],
    outwards: [[f64; BLOCK]; 2],
}

impl Loop for Share<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Share { spheres, around, lines, sums } = self;
        let mut seen = Seen {
            b: [0.0; BLOCK],
            force: [0.0; BLOCK],
            across: [0.0; BLOCK],
            shell: [[0; BLOCK]; 2],
            normal: [[0.0; BLOCK]; 2],
            whole: [[0.0; BLOCK]; 2],
            inwards: [[0.0; BLOCK]; 2],
            outwards: [[0.0; BLOCK]; 2],
        };
        see(spheres, around, lines, &mut seen);
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
            let crosses = [(in_first, in_last), (out_first, out_last)].map(|(first, last)| first < last);
            let first = match crosses {
                [true, true] => in_first.min(out_first),
                [true, false] => in_first,
                [false, true] => out_first,
                [false, false] => continue,
            };
            let (first, last) = (first as usize + 1, in_last.max(out_last) as usize);
            let (b, force, across) = (seen.b[k], seen.force[k], seen.across[k]);
            for at in (first..=last).step_by(LANES) {
                let radius: &[f64; LANES] = lanes(&spheres.radius, at);
                let inverse: &[f64; LANES] = lanes(&spheres.inverse, at);
                let logarithm: &[f64; LANES] = lanes(&spheres.logarithm, at);
                let mut gains = [[0.0; LANES]; 2];
                for lane in 0..LANES {
                    let sphere = (at + lane) as f64;
                    let inwards = if sphere > in_first && sphere <= in_last { 1.0 } else { 0.0 };
                    let outwards = if sphere > out_first && sphere <= out_last { 1.0 } else { 0.0 };
                    let (phi, chord) = chord(b * inverse[lane]);
                    let scale = force * (inwards + outwards) * radius[lane];
                    gains[0][lane] = scale * phi + across * (inwards - outwards) * logarithm[lane];
                    gains[1][lane] = scale * chord;
                }
                for lane in 0..LANES {
                    of_normal[at + lane] += gains[0][lane];
                    of_whole[at + lane] += gains[1][lane];
                }
            }
        }
    }
}

/// The [`LANES`] numbers that begin at `first`.
#[inline(always)]
fn lanes(values: &[f64], first: usize) -> &[f64; LANES] {
    values[first..].first_chunk().expect("room for a vector behind the last sphere")
}

/// Finds the ends of the lines in the shells, and the spheres between them.
#[inline(always)]
fn see(spheres: &Spheres, around: &Around, lines: &Lines, seen: &mut Seen) {
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
        let across = dot(p, f) + force * start;
        (seen.b[k], seen.force[k], seen.across[k]) = (b, force, across);
        let mut shells = [0.0; 2];
        for (side, (u, sign)) in [(start, -1.0), (end, 1.0)].into_iter().enumerate() {
            let square = (b2 + u * u).max(f64::MIN_POSITIVE);
            let r = square.sqrt();
            let (phi, _) = chord(b / r);
            let normal = if u < 0.0 { -r * phi } else { r * phi };
            seen.normal[side][k] = sign * (force * normal - 0.5 * across * ln(square));
            seen.whole[side][k] = sign * force * u;
            shells[side] = (r * per_length).floor().min(most);
            seen.shell[side][k] = shells[side] as u32;
        }
        let nearest = (b * per_length).floor().min(most);
        let [of_start, of_end] = shells;
        let comes = start < 0.0;
        let goes = end > 0.0;
        seen.inwards[0][k] = if goes { nearest } else { of_end };
        seen.inwards[1][k] = if comes { of_start } else { 0.0 };
        seen.outwards[0][k] = if comes { nearest } else { of_start };
        seen.outwards[1][k] = if goes { of_end } else { 0.0 };
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

/// Φ(q) and √(1 − q²).
#[inline(always)]
fn chord(q: f64) -> (f64, f64) {
    let rest = (1.0 - q).max(0.0);
    let root = rest.sqrt();
    let x = 2.0 * q - 1.0;
    let mut series = PHI[14];
    for k in (0..14).rev() {
        series = series * x + PHI[k];
    }
    (rest * root * series, root * (1.0 + q).sqrt())
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
    use crate::flux::{Carrier, Line};
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    #[test]
    fn functions_are_those_of_the_library() {
        for k in 0..2000 {
            let q = f64::from(k) / 2000.0;
            let (phi, root) = chord(q);
            let expected = (1.0 - q * q).sqrt() - q * q.acos();
            assert!((phi - expected).abs() < 1e-14 && (root - (1.0 - q * q).sqrt()).abs() < 1e-15, "{q}");
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
            Lines::in_blocks(Carrier::Pair, moved, |lines| spheres.add(&around, lines, &mut sums));
            let scale = expected.iter().flatten().fold(1.0f64, |most, x| most.max(x.abs()));
            for (k, (found, expected)) in spheres.shells(&sums).zip(&expected).enumerate() {
                for c in 0..2 {
                    let off = (found[c] - expected[c]).abs();
                    assert!(off < 1e-10 * scale, "{dimensions} {k}: {found:?} {expected:?}");
                }
            }
        }
    }
}
