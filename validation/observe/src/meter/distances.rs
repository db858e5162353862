//! Histograms of the distances of particles.
//!
//! Particles are sorted into rows. Each few neighbours in a row share a list of all particles that may be in their range, whose
//! distances are computed in single precision, eight at a time, and those that are so near to the edge of a shell that rounding may
//! matter once more in double precision, so that counts are those of double precision.

use super::PeriodicBox;
use psidpd_core::engine::Pool;
use psidpd_core::engine::vectors::{self, Loop};
use std::ops::{Add, Mul, Range, Sub};

/// Rows of particles per range. Narrower rows give fewer pairs beyond the range.
const ROWS_PER_RANGE: f64 = 3.0;

/// The number of distances in a vector.
const LANES: usize = 8;

/// The number of particles that share a list.
const GROUP: usize = 8;

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
    near.single.doubt = (f64::from(near.single.doubt) * farthest).min(1.0) as f32;
    let of_none = Counts { numbers: vec![0; kinds * kinds * near.width], kinds };
    let mut shares: Vec<(usize, Counts)> = (0..pool.threads()).map(|t| (t, of_none.clone())).collect();
    pool.each(&mut shares, |(t, counts)| {
        vectors::run_best(AddRows { near: &near, sorted: &sorted, first: *t, step: pool.threads(), counts });
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
    single: Single,
}

/// What distances are measured by, in single precision.
struct Single {
    edges: [[f32; 3]; 3],
    period: [f32; 3],
    per_length: f32,
    /// The last counter, and the first that is not read.
    last: f32,
    beyond: f32,
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
    across: [Interval; 2],
}

/// The plane and the row in it, the fractions, and the species of a particle.
type Particle = ([usize; 2], [f64; 3], usize);

/// Neighbouring rows, with nearly equal fractions along the second edge.
struct Plane {
    rows: Range<usize>,
    across: Interval,
}

/// Particles sorted into rows, and by the first fraction within a row. A vector of places without particles follows the last one.
struct Sorted {
    /// Fractions of the box in double and in single precision; NaN in places without particles.
    s: [Vec<f64>; 3],
    short: [Vec<f32>; 3],
    species: Vec<usize>,
    /// For each particle, the offset of its species in the counts of another species.
    offset: Vec<u32>,
    rows: Vec<Row>,
    planes: Vec<Plane>,
}

/// The particles that may be in range of a group, in whole vectors.
#[derive(Default)]
struct Candidates {
    short: [Vec<f32>; 3],
    offset: Vec<u32>,
    index: Vec<u32>,
}

impl Candidates {
    #[inline(always)]
    fn clear(&mut self) {
        for c in 0..3 {
            self.short[c].clear();
        }
        self.offset.clear();
        self.index.clear();
    }

    #[inline(always)]
    fn extend(&mut self, sorted: &Sorted, span: Range<usize>) {
        for c in 0..3 {
            self.short[c].extend_from_slice(&sorted.short[c][span.clone()]);
        }
        self.offset.extend_from_slice(&sorted.offset[span.clone()]);
        self.index.extend(span.start as u32..span.end as u32);
    }
}

/// Counted pairs: [`Near::width`] numbers for each species of the first and of the second particle.
#[derive(Clone)]
struct Counts {
    numbers: Vec<u64>,
    kinds: usize,
}

/// Counts the pairs of every `step`-th row with itself and with later rows.
struct AddRows<'a> {
    near: &'a Near<'a>,
    sorted: &'a Sorted,
    first: usize,
    step: usize,
    counts: &'a mut Counts,
}

impl Loop for AddRows<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let AddRows { near, sorted, first, step, counts } = self;
        let (mut beside, mut candidates) = (Vec::new(), Candidates::default());
        for row in (first..sorted.rows.len()).step_by(step) {
            near.find_rows(sorted, row, &mut beside);
            match near.is_orthogonal {
                true => counts.add::<true>(near, sorted, row, &beside, &mut candidates),
                false => counts.add::<false>(near, sorted, row, &beside, &mut candidates),
            }
        }
    }
}

impl Counts {
    /// Counts the pairs of a row with itself and with the rows `beside`.
    #[inline(always)]
    fn add<const ORTHOGONAL: bool>(
        &mut self,
        near: &Near,
        sorted: &Sorted,
        row: usize,
        beside: &[(usize, f64)],
        candidates: &mut Candidates,
    ) {
        let Range { start, end } = sorted.rows[row].particles;
        let of_species = self.kinds * near.width;
        for first in (start..end).step_by(GROUP) {
            let group = first..end.min(first + GROUP);
            let ends = [sorted.s[0][first], sorted.s[0][group.end - 1]];
            candidates.clear();
            for (other, chord) in beside {
                let of_row = sorted.rows[*other].particles.clone();
                for span in near.spans(&sorted.s[0], of_row, *chord, ends) {
                    candidates.extend(sorted, span);
                }
            }
            // In their own row particles are paired only with later ones, so that each pair is counted once.
            for span in near.spans(&sorted.s[0], group.end..end, near.range, ends) {
                candidates.extend(sorted, span);
            }
            let nobody = sorted.species.len() - LANES;
            let vectors = candidates.index.len().div_ceil(LANES);
            candidates.extend(sorted, nobody..nobody + vectors * LANES - candidates.index.len());
            for i in group.clone() {
                let numbers = &mut self.numbers[of_species * sorted.species[i]..][..of_species];
                for at in 0..vectors {
                    for bin in bins::<ORTHOGONAL>(near, sorted, i, candidates, at * LANES) {
                        numbers[bin as usize] += 1;
                    }
                }
                for j in i + 1..group.end {
                    let index = [j as u32; LANES];
                    numbers[exact_bins::<ORTHOGONAL>(near, sorted, i, &index)[0] as usize] += 1;
                }
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
        let edges = [0, 1, 2].map(|k| if k < dimensions { domain.edge(k) } else { [0.0; 3] });
        let period = [0, 1, 2].map(|k| f64::from(u8::from(periodic[k] && k < dimensions)));
        let (per_length, width) = (shells.bins as f64 / shells.range, (1 + BEYOND) * shells.bins);
        Near {
            domain,
            dimensions,
            edges,
            period,
            range: shells.range,
            heights: [0, 1, 2].map(|k| if k < dimensions { domain.height(k) } else { f64::INFINITY }),
            is_orthogonal: (0..3).all(|k| (0..3).all(|c| c == k || domain.edge(k)[c] == 0.0)),
            per_length,
            width,
            single: Single {
                edges: edges.map(|edge| edge.map(|c| c as f32)),
                period: period.map(|period| period as f32),
                per_length: per_length as f32,
                last: (width - 1) as f32,
                beyond: (shells.bins + 1) as f32,
                doubt: (ROUNDINGS * longest * per_length / 16_777_216.0).min(1.0) as f32,
            },
        }
    }

    /// Finds the rows after one that are in its range, with their extents of the range along the first edge.
    fn find_rows(&self, sorted: &Sorted, row: usize, found: &mut Vec<(usize, f64)>) {
        let own = &sorted.rows[row].across;
        found.clear();
        let later = sorted.planes.iter().filter(|plane| plane.rows.end > row + 1);
        // Large boxes have many rows, and few planes.
        for plane in later.filter(|plane| self.apart(1, &own[0], &plane.across) < self.range) {
            for k in plane.rows.start.max(row + 1)..plane.rows.end {
                let across = &sorted.rows[k].across;
                let [second, third] = [0, 1].map(|c| self.apart(c + 1, &own[c], &across[c]));
                found.extend(self.chord(second, third).map(|chord| (k, chord)));
            }
        }
    }

    /// Disjoint spans of a row in which all particles lie that are closer than `chord` to one between two `ends` along the first edge.
    #[inline(always)]
    fn spans(&self, s: &[f64], row: Range<usize>, chord: f64, ends: [f64; 2]) -> [Range<usize>; 3] {
        let reach = chord / self.heights[0];
        let is_periodic = self.period[0] > 0.0;
        let (low, high) = (ends[0] - reach, ends[1] + reach);
        if is_periodic && high - low >= 1.0 {
            return [row, 0..0, 0..0];
        }
        let (first, end) = (lower_bound(s, &row, low), lower_bound(s, &row, high));
        match is_periodic {
            true => {
                let (below, above) = (lower_bound(s, &row, high - 1.0), lower_bound(s, &row, low + 1.0));
                [row.start..below, first..end, above..row.end]
            }
            false => [first..end, 0..0, 0..0],
        }
    }

    /// The least distance of particles in two intervals of fraction `k`.
    #[inline(always)]
    fn apart(&self, k: usize, a: &Interval, b: &Interval) -> f64 {
        let between = (b.low - a.high).max(a.low - b.high);
        let around = 1.0 + a.low.min(b.low) - a.high.max(b.high);
        let least = if self.period[k] > 0.0 { between.min(around) } else { between };
        if k < self.dimensions { least.max(0.0) * self.heights[k] } else { 0.0 }
    }

    /// The extent of the range along the first edge, for given distances along the other edges.
    #[inline(always)]
    fn chord(&self, second: f64, third: f64) -> Option<f64> {
        match self.is_orthogonal {
            true => Some(self.range * self.range - second * second - third * third)
                .filter(|c| *c > 0.0)
                .map(f64::sqrt),
            false => (second.max(third) < self.range).then_some(self.range),
        }
    }
}

/// The counters of the pairs of `i` with the candidates of a vector. (Closures would not be compiled for the instruction set.)
#[inline(always)]
fn bins<const ORTHOGONAL: bool>(
    near: &Near,
    sorted: &Sorted,
    i: usize,
    candidates: &Candidates,
    first: usize,
) -> [u32; LANES] {
    let Single { edges, period, per_length, last, beyond, doubt } = &near.single;
    let [x, y, z] = &sorted.short;
    let [of_x, of_y, of_z] = &candidates.short;
    let s = nearest(lanes(of_x, first), x[i], period[0], 0.5);
    let t = nearest(lanes(of_y, first), y[i], period[1], 0.5);
    let u = nearest(lanes(of_z, first), z[i], period[2], 0.5);
    let offset = lanes(&candidates.offset, first);
    let (mut bins, mut unsure) = ([0; LANES], false);
    for k in 0..LANES {
        let place = distance_squared::<f32, ORTHOGONAL>([s[k], t[k], u[k]], edges).sqrt() * per_length;
        let place = if place < *last { place } else { *last };
        // SAFETY: NaN compares as false and becomes `last`, so the value is from 0 to `last`, and `last` fits into `i32`.
        let bin: i32 = unsafe { place.to_int_unchecked() };
        let part = place - bin as f32;
        unsure |= (part < *doubt || part > 1.0 - doubt) & (place < *beyond);
        bins[k] = offset[k] + bin as u32;
    }
    match unsure || *doubt > 0.5 {
        true => exact_bins::<ORTHOGONAL>(near, sorted, i, lanes(&candidates.index, first)),
        false => bins,
    }
}

/// [`bins`] in double precision.
#[inline(always)]
fn exact_bins<const ORTHOGONAL: bool>(
    near: &Near,
    sorted: &Sorted,
    i: usize,
    index: &[u32; LANES],
) -> [u32; LANES] {
    let last = (near.width - 1) as f64;
    let mut s = [[0.0; LANES]; 3];
    for c in 0..3 {
        for k in 0..LANES {
            s[c][k] = sorted.s[c][index[k] as usize];
        }
        s[c] = nearest(&s[c], sorted.s[c][i], near.period[c], 0.5);
    }
    let mut bins = [0; LANES];
    for k in 0..LANES {
        let square = distance_squared::<f64, ORTHOGONAL>([s[0][k], s[1][k], s[2][k]], &near.edges);
        let bin = square.sqrt() * near.per_length;
        // SAFETY: NaN compares as false and becomes `last`, so the value is from 0 to `last`, and `last` fits into `i32`.
        let bin: i32 = unsafe { (if bin < last { bin } else { last }).to_int_unchecked() };
        bins[k] = sorted.offset[index[k] as usize] + bin as u32;
    }
    bins
}

/// The square of the length of the vector with fractions `s` of the edges, in either precision.
#[inline(always)]
fn distance_squared<T, const ORTHOGONAL: bool>(s: [T; 3], edges: &[[T; 3]; 3]) -> T
where
    T: Copy + Add<Output = T> + Mul<Output = T>,
{
    let [a, b, c] = edges;
    let d = match ORTHOGONAL {
        true => [s[0] * a[0], s[1] * b[1], s[2] * c[2]],
        false => [
            s[0] * a[0] + s[1] * b[0] + s[2] * c[0],
            s[0] * a[1] + s[1] * b[1] + s[2] * c[1],
            s[0] * a[2] + s[1] * b[2] + s[2] * c[2],
        ],
    };
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
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

/// The first particle of a row that is not below a limit.
#[inline(always)]
fn lower_bound(s: &[f64], row: &Range<usize>, limit: f64) -> usize {
    let (mut low, mut high) = (row.start, row.end);
    while low < high {
        let middle = low + (high - low) / 2;
        (low, high) = if s[middle] < limit { (middle + 1, high) } else { (low, middle) };
    }
    low
}

impl Sorted {
    fn new(x: &[[f64; 3]], species: &[i32], near: &Near) -> Sorted {
        let rows = [1, 2].map(|k| {
            let rows = ROWS_PER_RANGE * near.heights[k] / near.range;
            if k < near.dimensions { rows.clamp(1.0, x.len() as f64 + 1.0) as usize } else { 1 }
        });
        let finite = (0..x.len()).filter(|k| x[*k].iter().all(|c| c.is_finite()));
        let mut particles: Vec<Particle> = finite
            .map(|k| {
                let s = near.domain.fraction(x[k]);
                let s = [0, 1, 2].map(|c| if c < near.dimensions { s[c] } else { 0.0 });
                let row = [0, 1].map(|c| ((s[c + 1] * rows[c] as f64) as usize).min(rows[c] - 1));
                (row, s, species[k] as usize)
            })
            .collect();
        particles.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1[0].total_cmp(&b.1[0])));
        let mut sorted = Sorted {
            s: Default::default(),
            short: Default::default(),
            species: Vec::new(),
            offset: Vec::new(),
            rows: Vec::new(),
            planes: Vec::new(),
        };
        let interval = |part: &[Particle], c: usize| Interval::of(part.iter().map(|particle| particle.1[c]));
        for plane in particles.chunk_by(|a, b| a.0[0] == b.0[0]) {
            let first_row = sorted.rows.len();
            for row in plane.chunk_by(|a, b| a.0 == b.0) {
                let first = sorted.species.len();
                row.iter().for_each(|(_, s, species)| sorted.push(*s, *species, near.width));
                let across = [1, 2].map(|c| interval(row, c));
                sorted.rows.push(Row { particles: first..first + row.len(), across });
            }
            sorted.planes.push(Plane { rows: first_row..sorted.rows.len(), across: interval(plane, 1) });
        }
        (0..LANES).for_each(|_| sorted.push([f64::NAN; 3], 0, 0));
        sorted
    }

    fn push(&mut self, s: [f64; 3], species: usize, width: usize) {
        for c in 0..3 {
            self.s[c].push(s[c]);
            self.short[c].push(s[c] as f32);
        }
        self.species.push(species);
        self.offset.push((species * width) as u32);
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

    /// Pairs a billionth of a shell below and above the edge of each shell, in every direction, each alone in its part of the box: their
    /// shells are known, and single precision does not tell them.
    #[test]
    fn pairs_at_edges_are_in_their_shell() {
        let mut random = StdRng::seed_from_u64(8);
        let (bins, range) = (16, 1.0);
        let domain = PeriodicBox::orthogonal([0.3, -7.0, 1.1], [30.0, 31.0, 29.0], [true; 3]).unwrap();
        let (mut x, mut expected) = (Vec::new(), vec![0; bins]);
        for place in 0..1000 {
            let (shell, is_above) = (1 + place / 2 % 15, place % 2 == 1);
            expected[shell - usize::from(!is_above)] += 1;
            let r = (shell as f64 + if is_above { 1e-9 } else { -1e-9 }) / bins as f64 * range;
            let [u, turn]: [f64; 2] =
                [random.random::<f64>() * 2.0 - 1.0, std::f64::consts::TAU * random.random::<f64>()];
            let flat = (1.0 - u * u).sqrt();
            let at = [place % 10, place / 10 % 10, place / 100]
                .map(|k| 2.9 * k as f64 + random.random::<f64>() * 0.5);
            x.push(at);
            x.push([at[0] + r * flat * turn.cos(), at[1] + r * flat * turn.sin(), at[2] + r * u]);
        }
        let found = count(
            &Pool::new(NonZeroUsize::MIN),
            &x,
            &vec![0; x.len()],
            1,
            &domain,
            3,
            Shells { range, bins },
        );
        assert_eq!(found, expected);
    }

    #[test]
    fn nothing_makes_no_pairs() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let alone = Pool::new(NonZeroUsize::MIN);
        assert_eq!(count(&alone, &[], &[], 1, &domain, 3, Shells { range: 1.0, bins: 2 }), [0, 0]);
    }
}
