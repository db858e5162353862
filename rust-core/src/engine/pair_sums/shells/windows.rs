//! Counts pairs in boxes of any kind: particles are sorted along the widest direction, and each is compared with those in range along it.
//!
//! Positions are fractions of the box in units of 2⁻³², whose differences wrap to the nearest image, and distances those of single
//! precision, a vector at a time; those near the edge of a shell are measured once more in double precision.

use super::counts::Counts;
use crate::engine::sweep::{Places, Pool};
use crate::engine::vectors::{Loop, run_best};
use psidpd_passes::domain::PeriodicBox;
use std::ops::Range;

/// The number of distances in a vector.
const LANES: usize = 16;

const TWO_TO_32: f64 = 4_294_967_296.0;

/// Particles sorted along a direction, followed by a vector of places without particles.
struct Sorted<'a> {
    /// The fraction of the box along the direction.
    s: Vec<f64>,
    /// Fractions of `units`.
    u: [Vec<u32>; 3],
    /// What a unit of each fraction is along each axis.
    units: [[f32; 3]; 3],
    species: Vec<usize>,
    /// The range, as a fraction of the box along the direction.
    reach: f64,
    is_periodic: bool,
    /// Half a shell less the part of a shell that a distance may be off by.
    sure: f32,
    places: Places<'a>,
}

pub fn count(
    counts: &mut Counts,
    pool: &Pool,
    x: &[[f64; 3]],
    species: &[i32],
    (domain, dimensions): (&PeriodicBox, usize),
    range: f64,
) {
    let height = |k: &usize| domain.height(*k);
    let along =
        (0..dimensions).max_by(|a, b| height(a).total_cmp(&height(b))).expect("two or three directions");
    let fractions: Vec<[f64; 3]> = x.iter().map(|x| domain.fraction(*x)).collect();
    let s = |k: u32| fractions[k as usize];
    let mut order: Vec<u32> =
        (0..x.len() as u32).filter(|k| x[*k as usize].iter().all(|c| c.is_finite())).collect();
    order.sort_unstable_by(|a, b| s(*a)[along].total_cmp(&s(*b)[along]));
    let mut sorted = Sorted {
        s: order.iter().map(|k| s(*k)[along]).collect(),
        u: Default::default(),
        units: Default::default(),
        species: order.iter().map(|k| species[*k as usize] as usize).collect(),
        reach: range / height(&along),
        is_periodic: domain.periodic()[along],
        sure: 0.0,
        places: Places::new(dimensions, domain, x, &order),
    };
    let mut error = 0.0;
    for c in 0..dimensions {
        let all = || order.iter().map(|k| s(*k)[c]);
        let (low, high) =
            all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (low.min(s), high.max(s)));
        // Along open directions nothing may wrap.
        let (from, span) =
            if domain.periodic()[c] { (0.0, 1.0) } else { (low, (2.1 * (high - low)).max(1e-3)) };
        sorted.u[c] =
            all().map(|s| (((s - from) / span).rem_euclid(1.0) * TWO_TO_32) as u64 as u32).collect();
        let edge = domain.edge(c).map(|edge| edge * span);
        sorted.units[c] = edge.map(|edge| (edge / TWO_TO_32) as f32);
        let length = edge.iter().map(|c| c * c).sum::<f64>().sqrt();
        // Two units, and the roundings of the part along this edge of a distance in range.
        error += 2.0 * length / TWO_TO_32 + 1e-6 * range * length / (span * height(&c));
    }
    sorted.sure = (0.5 - counts.per_length * error) as f32;
    (0..3).for_each(|c| sorted.u[c].resize(order.len() + LANES, 0));
    sorted.species.extend([0; LANES]);
    let mut shares: Vec<(usize, Vec<u64>)> =
        (0..pool.threads()).map(|t| (t, counts.of_ordered_pairs())).collect();
    let (sorted, shells, step) = (&sorted, &*counts, pool.threads());
    pool.each(&mut shares, |(first, numbers)| {
        run_best(CountWindows { sorted, shells, first: *first, step, numbers });
    });
    shares.iter().for_each(|(_, numbers)| counts.take(numbers));
}

/// Counts the pairs of every `step`-th particle with those after it.
struct CountWindows<'a> {
    sorted: &'a Sorted<'a>,
    shells: &'a Counts,
    first: usize,
    step: usize,
    numbers: &'a mut [u64],
}

impl Sorted<'_> {
    /// The particles after one that may be in its range along the direction, on both sides.
    #[inline(always)]
    fn windows(&self, i: usize) -> [Range<usize>; 2] {
        let Sorted { s, reach, .. } = self;
        let after = i + 1..s.len();
        let near = after.start..after.start + s[after.clone()].partition_point(|s_j| s_j - s[i] <= *reach);
        let far = near.end + s[near.end..].partition_point(|s_j| s_j - s[i] < 1.0 - reach);
        [near, if self.is_periodic { far..s.len() } else { 0..0 }]
    }

    /// Distances of a vector of particles, in shells, and at most `last`.
    #[inline(always)]
    fn distances(&self, i: usize, from: usize, per_length: f32, last: f32) -> [f32; LANES] {
        let ([u, v, w], [a, b, c]) = (&self.u, &self.units);
        let (of_u, of_v, of_w) = (&u[from..from + LANES], &v[from..from + LANES], &w[from..from + LANES]);
        let mut distances = [0.0; LANES];
        for k in 0..LANES {
            let p = of_u[k].wrapping_sub(u[i]) as i32 as f32;
            let q = of_v[k].wrapping_sub(v[i]) as i32 as f32;
            let r = of_w[k].wrapping_sub(w[i]) as i32 as f32;
            let x = p * a[0] + q * b[0] + r * c[0];
            let y = p * a[1] + q * b[1] + r * c[1];
            let z = p * a[2] + q * b[2] + r * c[2];
            let distance = (x * x + y * y + z * z).sqrt() * per_length;
            distances[k] = if distance < last { distance } else { last };
        }
        distances
    }
}

impl Loop for CountWindows<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let CountWindows { sorted, shells, first, step, numbers } = self;
        let Counts { kinds, bins, per_length, .. } = shells;
        let (width, last, sure) = (bins + 1, *bins as f32 + 1.0, sorted.sure);
        // Single precision may be off by more than a shell where particles are far apart.
        let all_unsure = sure < 0.0;
        for i in (first..sorted.s.len()).step_by(step) {
            let of_i = &mut numbers[sorted.species[i] * kinds * width..][..kinds * width];
            for window in sorted.windows(i) {
                for from in window.clone().step_by(LANES) {
                    let distances = sorted.distances(i, from, *per_length as f32, last);
                    let (mut shell, mut unsure) = ([0; LANES], all_unsure);
                    for k in 0..LANES {
                        // SAFETY: distances are from 0 to `last`, and not NaN.
                        let number: i32 = unsafe { distances[k].to_int_unchecked() };
                        unsure |= ((distances[k] - number as f32 - 0.5).abs() > sure) & (distances[k] < last);
                        shell[k] = number;
                    }
                    for k in 0..LANES.min(window.end - from) {
                        let mut number = shell[k] as usize;
                        if unsure && (distances[k] - number as f32 - 0.5).abs() > sure {
                            number = (sorted.places.distance(i, from + k) * per_length) as usize;
                        }
                        of_i[sorted.species[from + k] * width + number.min(*bins)] += 1;
                    }
                }
            }
        }
    }
}
