//! Histograms of the distances of particles.
//!
//! Distances are computed in single precision, eight at a time, and those that are so near to the edge of a shell that rounding may
//! matter once more in double precision, so that counts are those of double precision.

use super::PeriodicBox;
use psidpd_core::engine::Pool;
use psidpd_core::engine::vectors::{self, Loop};
use std::ops::{Add, Range, Sub};

/// Rows of particles per range. Narrower rows give fewer pairs beyond the range.
const ROWS_PER_RANGE: f64 = 3.0;

/// The number of distances in a vector.
const LANES: usize = 8;

/// Shells beyond the range, in ranges. Pairs out of range are counted in these shells, which are never read.
const BEYOND: usize = 3;

/// Shells of equal thickness.
#[derive(Debug, Clone, Copy)]
pub struct Shells {
    /// The largest distance, at most half the height of the box along any period.
    pub range: f64,
    pub bins: usize,
}

/// Pairs in each shell: `bins` numbers for each species `a` and each `b` from `a` on. Particles without a finite
/// position make no pairs.
pub fn count(
    pool: &Pool,
    x: &[[f64; 3]],
    species: &[i32],
    kinds: usize,
    domain: &PeriodicBox,
    dimensions: usize,
    shells: Shells,
) -> Vec<u64> {
    let mut near = Near::new(domain, dimensions, shells);
    let sorted = Sorted::new(x, species, &near);
    // Outside an open box fractions are large.
    let farthest = sorted.s.iter().flatten().fold(1.0f64, |most, s| most.max(s.abs()));
    near.doubt = (f64::from(near.doubt) * farthest).min(1.0) as f32;
    let planes = sorted.planes.len();
    let pairs: Vec<[usize; 2]> = (0..planes).flat_map(|a| (a..planes).map(move |b| [a, b])).collect();
    let of_none = Counts { numbers: vec![0; kinds * kinds * near.width], kinds, found: Vec::new() };
    let mut shares: Vec<(usize, Counts)> = (0..pool.threads()).map(|t| (t, of_none.clone())).collect();
    pool.each(&mut shares, |(t, counts)| {
        let pairs = pairs.iter().skip(*t).step_by(pool.threads());
        pairs.for_each(|pair| counts.add_planes(&near, &sorted, pair.map(|k| &sorted.planes[k])));
    });
    let mut counts = of_none.numbers;
    for (_, share) in &shares {
        counts.iter_mut().zip(&share.numbers).for_each(|(sum, number)| *sum += number);
    }
    let mut sums = Vec::with_capacity(shells.bins * kinds * (kinds + 1) / 2);
    let row = |a: usize, b: usize| &counts[(a * kinds + b) * near.width..][..shells.bins];
    for (a, b) in (0..kinds).flat_map(|a| (a..kinds).map(move |b| (a, b))) {
        let other = (a != b).then(|| row(b, a));
        sums.extend((0..shells.bins).map(|bin| row(a, b)[bin] + other.map_or(0, |other| other[bin])));
    }
    sums
}

/// The box and the shells in the form that the loop over pairs needs.
struct Near<'a> {
    domain: &'a PeriodicBox,
    dimensions: usize,
    /// Component c of edge k is `edges[k][c]`.
    edges: [[f64; 3]; 3],
    /// The period is 1 along periodic directions, else 0.
    period: [f64; 3],
    range: f64,
    /// Distances of the faces; in two dimensions the third is infinite.
    heights: [f64; 3],
    /// True if the edges are parallel to the axes, so that squares of distances add up.
    is_orthogonal: bool,
    /// The number of shells in a unit of length.
    per_length: f64,
    /// The number of counters for each pair of species.
    width: usize,
    /// Distances in shells that are nearer to an edge are not known in single precision.
    doubt: f32,
}

/// Roundings of 2⁻²⁴ of the longest edge that a distance in single precision may be off by.
const ROUNDINGS: f64 = 16.0;

/// The least and the greatest of some fractions.
#[derive(Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn of(fractions: impl Iterator<Item = f64> + Clone) -> Interval {
        let low = fractions.clone().fold(f64::INFINITY, f64::min);
        Interval { low, high: fractions.fold(f64::NEG_INFINITY, f64::max) }
    }
}

/// Particles in a row along the first edge, with nearly equal fractions along the other edges.
struct Row {
    particles: Range<usize>,
    across: Interval,
}

/// Neighbouring rows.
struct Plane {
    rows: Vec<Row>,
    across: Interval,
}

/// Particles sorted into rows, and by the first fraction within a row.
struct Sorted {
    /// Fractions of the box, padded by the length of a vector, in double and in single precision.
    s: [Vec<f64>; 3],
    short: [Vec<f32>; 3],
    species: Vec<usize>,
    /// For each particle, the offset of its species in the counts of another species.
    offset: Vec<u32>,
    planes: Vec<Plane>,
}

/// Counted pairs: [`Near::width`] numbers for each species of the first and of the second particle.
#[derive(Clone)]
struct Counts {
    numbers: Vec<u64>,
    kinds: usize,
    /// The counter of each pair of one particle.
    found: Vec<u32>,
}

impl Counts {
    /// Counts the pairs between two planes, or within one plane.
    fn add_planes(&mut self, near: &Near, sorted: &Sorted, [plane, other_plane]: [&Plane; 2]) {
        let apart = near.apart(1, &plane.across, &other_plane.across);
        let same = std::ptr::eq(plane, other_plane);
        for (at, row) in plane.rows.iter().enumerate() {
            for other in &other_plane.rows[if same { at } else { 0 }..] {
                if let Some(chord) = near.chord(apart, near.apart(2, &row.across, &other.across)) {
                    self.add(near, sorted, [row, other], chord);
                }
            }
        }
    }

    /// Counts the pairs between two rows, or within one row.
    fn add(&mut self, near: &Near, sorted: &Sorted, [row, other]: [&Row; 2], chord: f64) {
        let mut window = Window::new(near, chord, &sorted.s[0], other.particles.clone());
        for i in row.particles.clone() {
            let of_species = self.kinds * near.width;
            let numbers = &mut self.numbers[of_species * sorted.species[i]..][..of_species];
            // In its own row a particle is paired only with later ones, so that each pair is counted once.
            let from = if std::ptr::eq(row, other) { i + 1 } else { 0 };
            for span in window.around(sorted.s[0][i]) {
                let span = from.max(span.start)..span.end;
                vectors::run_best(Bins { near, sorted, i, span, found: &mut self.found });
                self.found.iter().for_each(|bin| numbers[*bin as usize] += 1);
            }
        }
    }
}

impl<'a> Near<'a> {
    fn new(domain: &'a PeriodicBox, dimensions: usize, shells: Shells) -> Near<'a> {
        let periodic = domain.periodic();
        let lengths = (0..dimensions).flat_map(|k| domain.edge(k)).map(f64::abs);
        // Distances of up to all ranges that are counted are rounded too.
        let longest = lengths.fold((1 + BEYOND) as f64 * shells.range, f64::max);
        Near {
            domain,
            dimensions,
            edges: [0, 1, 2].map(|k| if k < dimensions { domain.edge(k) } else { [0.0; 3] }),
            period: [0, 1, 2].map(|k| f64::from(u8::from(periodic[k] && k < dimensions))),
            range: shells.range,
            heights: [0, 1, 2].map(|k| if k < dimensions { domain.height(k) } else { f64::INFINITY }),
            is_orthogonal: (0..3).all(|k| (0..3).all(|c| c == k || domain.edge(k)[c] == 0.0)),
            per_length: shells.bins as f64 / shells.range,
            width: (1 + BEYOND) * shells.bins,
            doubt: (ROUNDINGS * longest * shells.bins as f64 / shells.range / 16_777_216.0).min(1.0) as f32,
        }
    }

    /// The least distance of particles in two intervals of fraction `k`.
    fn apart(&self, k: usize, a: &Interval, b: &Interval) -> f64 {
        let between = (b.low - a.high).max(a.low - b.high);
        let around = 1.0 + a.low.min(b.low) - a.high.max(b.high);
        let least = if self.period[k] > 0.0 { between.min(around) } else { between };
        if k < self.dimensions { least.max(0.0) * self.heights[k] } else { 0.0 }
    }

    /// The extent of the range along the first edge, for given distances along the other edges.
    fn chord(&self, second: f64, third: f64) -> Option<f64> {
        match self.is_orthogonal {
            true => Some(self.range * self.range - second * second - third * third)
                .filter(|c| *c > 0.0)
                .map(f64::sqrt),
            false => (second.max(third) < self.range).then_some(self.range),
        }
    }
}

/// Finds the counters of the pairs of `i` with the particles of a span.
struct Bins<'a> {
    near: &'a Near<'a>,
    sorted: &'a Sorted,
    i: usize,
    span: Range<usize>,
    found: &'a mut Vec<u32>,
}

impl Loop for Bins<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Bins { near, sorted, i, span, found } = self;
        let own = [sorted.short[0][i], sorted.short[1][i], sorted.short[2][i]];
        let [a, b, c] = near.edges.map(|edge| edge.map(|c| c as f32));
        let period = near.period.map(|period| period as f32);
        let per_length = near.per_length as f32;
        let (last, beyond) = ((near.width - 1) as f32, (near.width / (1 + BEYOND) + 1) as f32);
        found.clear();
        for first in span.clone().step_by(LANES) {
            let s = nearest(lanes(&sorted.short[0], first), own[0], period[0], 0.5);
            let t = nearest(lanes(&sorted.short[1], first), own[1], period[1], 0.5);
            let u = nearest(lanes(&sorted.short[2], first), own[2], period[2], 0.5);
            let offset = lanes(&sorted.offset, first);
            let (mut bins, mut doubt) = ([0; LANES], [false; LANES]);
            for k in 0..LANES {
                let x = s[k] * a[0] + t[k] * b[0] + u[k] * c[0];
                let y = s[k] * a[1] + t[k] * b[1] + u[k] * c[1];
                let z = s[k] * a[2] + t[k] * b[2] + u[k] * c[2];
                let place = (x * x + y * y + z * z).sqrt() * per_length;
                let place = if place < last { place } else { last };
                // SAFETY: NaN compares as false and becomes `last`, so the value is from 0 to `last`, and `last` fits into `i32`.
                let bin: i32 = unsafe { place.to_int_unchecked() };
                let part = place - bin as f32;
                doubt[k] = (part < near.doubt || part > 1.0 - near.doubt) & (place < beyond);
                bins[k] = offset[k] + bin as u32;
            }
            if near.doubt > 0.5 || doubt.iter().fold(false, |any, doubt| any | doubt) {
                bins = exact_bins(near, sorted, i, first);
            }
            found.extend_from_slice(&bins);
        }
        found.truncate(span.len());
    }
}

/// The counters of the pairs of `i` with the particles of a vector.
#[inline(always)]
fn exact_bins(near: &Near, sorted: &Sorted, i: usize, first: usize) -> [u32; LANES] {
    let own = [sorted.s[0][i], sorted.s[1][i], sorted.s[2][i]];
    let [a, b, c] = near.edges;
    let last = (near.width - 1) as f64;
    let s = nearest(lanes(&sorted.s[0], first), own[0], near.period[0], 0.5);
    let t = nearest(lanes(&sorted.s[1], first), own[1], near.period[1], 0.5);
    let u = nearest(lanes(&sorted.s[2], first), own[2], near.period[2], 0.5);
    let offset = lanes(&sorted.offset, first);
    let mut bins = [0; LANES];
    for k in 0..LANES {
        let x = s[k] * a[0] + t[k] * b[0] + u[k] * c[0];
        let y = s[k] * a[1] + t[k] * b[1] + u[k] * c[1];
        let z = s[k] * a[2] + t[k] * b[2] + u[k] * c[2];
        let bin = (x * x + y * y + z * z).sqrt() * near.per_length;
        // SAFETY: NaN compares as false and becomes `last`, so the value is from 0 to `last`, and `last` fits into `i32`.
        let bin: i32 = unsafe { (if bin < last { bin } else { last }).to_int_unchecked() };
        bins[k] = offset[k] + bin as u32;
    }
    bins
}

/// The [`LANES`] numbers that begin at `first`.
#[inline(always)]
fn lanes<T>(values: &[T], first: usize) -> &[T; LANES] {
    values[first..].first_chunk().expect("room for a vector behind the last particle")
}

/// Fractions from `own` to the nearest images of others, in either precision. They are correct within `half` a height.
#[inline(always)]
fn nearest<T>(s: &[T; LANES], own: T, period: T, half: T) -> [T; LANES]
where
    T: Copy + Default + PartialOrd + Add<Output = T> + Sub<Output = T>,
{
    let mut apart = [T::default(); LANES];
    for k in 0..LANES {
        let d = s[k] - own;
        let above = if d > half { period } else { T::default() };
        let below = if d + half < T::default() { period } else { T::default() };
        apart[k] = d - above + below;
    }
    apart
}

/// The particles of a row that may be in range of another particle, which moves along the first edge.
struct Window<'a> {
    s: &'a [f64],
    row: Range<usize>,
    reach: f64,
    is_periodic: bool,
    /// The ends of the spans: particles in range, and particles in range through either end of the periodic box.
    at: [usize; 4],
}

impl<'a> Window<'a> {
    fn new(near: &Near, chord: f64, s: &'a [f64], row: Range<usize>) -> Window<'a> {
        let (reach, is_periodic) = (chord / near.heights[0], near.period[0] > 0.0);
        Window { s, at: [row.start; 4], row, reach, is_periodic }
    }

    /// Disjoint spans of a row around `s`, which must not be less than in the call before.
    fn around(&mut self, s: f64) -> [Range<usize>; 3] {
        let Window { reach, is_periodic, .. } = *self;
        if is_periodic && 2.0 * reach >= 1.0 {
            return [self.row.clone(), 0..0, 0..0];
        }
        let limits = [s - reach, s + reach, s + reach - 1.0, s - reach + 1.0];
        for (at, limit) in self.at.iter_mut().zip(limits) {
            while *at < self.row.end && self.s[*at] < limit {
                *at += 1;
            }
        }
        let [first, end, first_end, last] = self.at;
        match is_periodic {
            true => [self.row.start..first_end, first..end, last..self.row.end],
            false => [first..end, 0..0, 0..0],
        }
    }
}

impl Sorted {
    fn new(x: &[[f64; 3]], species: &[i32], near: &Near) -> Sorted {
        let rows = [1, 2].map(|k| {
            let rows = ROWS_PER_RANGE * near.heights[k] / near.range;
            if k < near.dimensions { rows.clamp(1.0, x.len() as f64 + 1.0) as usize } else { 1 }
        });
        let finite = (0..x.len()).filter(|k| x[*k].iter().all(|c| c.is_finite()));
        let mut particles: Vec<([usize; 2], [f64; 3], usize)> = finite
            .map(|k| {
                let s = near.domain.fraction(x[k]);
                let s = [0, 1, 2].map(|c| if c < near.dimensions { s[c] } else { 0.0 });
                let row = [0, 1].map(|c| ((s[c + 1] * rows[c] as f64) as usize).min(rows[c] - 1));
                (row, s, species[k] as usize)
            })
            .collect();
        particles.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1[0].total_cmp(&b.1[0])));
        let mut first = 0;
        let of_plane = |plane: &[([usize; 2], [f64; 3], usize)]| {
            let rows = plane.chunk_by(|a, b| a.0 == b.0).map(|row| {
                first += row.len();
                Row {
                    particles: first - row.len()..first,
                    across: Interval::of(row.iter().map(|particle| particle.1[2])),
                }
            });
            Plane { rows: rows.collect(), across: Interval::of(plane.iter().map(|particle| particle.1[1])) }
        };
        let planes = particles.chunk_by(|a, b| a.0[0] == b.0[0]).map(of_plane).collect();
        // Vectors read beyond the last particle, so the arrays are padded.
        let padding = LANES - 1;
        let fractions = |k: usize| particles.iter().map(move |particle| particle.1[k]);
        let offsets = particles.iter().map(|particle| (particle.2 * near.width) as u32);
        let s =
            [0, 1, 2].map(|k| fractions(k).chain(std::iter::repeat_n(0.0, padding)).collect::<Vec<f64>>());
        Sorted {
            short: s.each_ref().map(|s| s.iter().map(|s| *s as f32).collect()),
            s,
            offset: offsets.chain(std::iter::repeat_n(0, padding)).collect(),
            species: particles.into_iter().map(|particle| particle.2).collect(),
            planes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use psidpd_core::engine::pair_sums::for_each_pair;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use std::num::NonZeroUsize;

    /// The counts agree with a search over all pairs, for any box.
    #[test]
    fn counts_are_those_of_single_pairs() {
        let mut random = StdRng::seed_from_u64(3);
        let skew = Matrix3::new(7.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 4.0);
        let along = |a, b, c| Matrix3::new(a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c);
        let cases = [
            (along(4.0, 4.0, 4.0), [true; 3], 3, 2.0),
            (along(9.0, 5.0, 4.0), [true; 3], 3, 0.9),
            (along(9.0, 5.0, 4.0), [true, false, true], 3, 1.7),
            (along(3.0, 4.0, 8.0), [false; 3], 3, 5.0),
            (skew, [true; 3], 3, 1.5),
            (along(12.0, 7.0, 1.0), [true, true, false], 2, 3.5),
            (along(6.0, 12.0, 1.0), [false, true, false], 2, 0.7),
            (along(9e4, 4.0, 4.0), [true; 3], 3, 2.0),
        ];
        for (edges, periodic, dimensions, range) in cases {
            let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, periodic).unwrap();
            let mut place =
                || domain.point([0, 1, 2].map(|k| if k < dimensions { random.random() } else { 0.0 }));
            let mut x: Vec<[f64; 3]> = (0..400).map(|_| place()).collect();
            x[17] = [f64::NAN; 3];
            let species: Vec<i32> = (0..400).map(|k| k % 5 / 2).collect();
            let shells = Shells { range, bins: 11 };
            let mut expected = vec![0; 6 * 11];
            for_each_pair(&x, &domain, dimensions, range, |p| {
                let (a, b) = (species[p.i].min(species[p.j]), species[p.i].max(species[p.j]));
                let kind = (a * 3 - a * (a + 1) / 2 + b) as usize;
                expected[11 * kind + ((p.r / range * 11.0) as usize).min(10)] += 1;
            });
            assert!(domain.height(0) > 1e3 || expected.iter().sum::<u64>() > 400, "pairs to count");
            for threads in [1, 3] {
                let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
                let found = count(&pool, &x, &species, 3, &domain, dimensions, shells);
                assert_eq!(found, expected, "{edges} {periodic:?}");
            }
        }
    }

    #[test]
    fn nothing_makes_no_pairs() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let alone = Pool::new(NonZeroUsize::MIN);
        assert_eq!(count(&alone, &[], &[], 1, &domain, 3, Shells { range: 1.0, bins: 2 }), [0, 0]);
    }
}
