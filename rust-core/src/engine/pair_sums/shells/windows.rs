//! Counts pairs in boxes of any kind: particles are sorted along the widest direction, and each is compared with those in range along it.

use super::counts::Counts;
use crate::engine::sweep::{Images, Places, Pool};
use crate::engine::vectors::{Loop, run_best};
use psidpd_passes::domain::PeriodicBox;
use std::ops::Range;

/// The number of distances in a vector.
const LANES: usize = 8;

/// Particles sorted along a direction, followed by a vector of places without particles.
struct Sorted {
    /// The fraction of the box along the direction.
    s: Vec<f64>,
    x: [Vec<f64>; 3],
    species: Vec<usize>,
    /// The range, as a fraction of the box along the direction.
    reach: f64,
    is_periodic: bool,
    images: Images,
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
    let s = |k: u32| domain.fraction(x[k as usize])[along];
    let mut order: Vec<u32> =
        (0..x.len() as u32).filter(|k| x[*k as usize].iter().all(|c| c.is_finite())).collect();
    order.sort_unstable_by(|a, b| s(*a).total_cmp(&s(*b)));
    let places = Places::new(dimensions, domain, x, &order);
    let mut sorted = Sorted {
        s: order.iter().map(|k| s(*k)).collect(),
        x: [0, 1, 2].map(|c| (0..order.len()).map(|k| places.x(k)[c]).collect()),
        species: order.iter().map(|k| species[*k as usize] as usize).collect(),
        reach: range / height(&along),
        is_periodic: domain.periodic()[along],
        images: places.images,
    };
    sorted.x.iter_mut().for_each(|x| x.extend([f64::NAN; LANES]));
    sorted.species.extend([0; LANES]);
    let mut shares: Vec<(usize, Vec<u64>)> =
        (0..pool.threads()).map(|t| (t, counts.of_ordered_pairs())).collect();
    let (sorted, shells, step) = (&sorted, &*counts, pool.threads());
    pool.each(&mut shares, |(first, numbers)| {
        run_best(CountWindows { sorted, shells, first: *first, step, numbers })
    });
    shares.iter().for_each(|(_, numbers)| counts.take(numbers));
}

/// Counts the pairs of every `step`-th particle with those after it.
struct CountWindows<'a> {
    sorted: &'a Sorted,
    shells: &'a Counts,
    first: usize,
    step: usize,
    numbers: &'a mut [u64],
}

impl Sorted {
    /// The particles after one that may be in its range along the direction, on both sides.
    #[inline(always)]
    fn windows(&self, i: usize) -> [Range<usize>; 2] {
        let Sorted { s, reach, .. } = self;
        let after = i + 1..s.len();
        let near = after.start..after.start + s[after.clone()].partition_point(|s_j| s_j - s[i] <= *reach);
        let far = near.end + s[near.end..].partition_point(|s_j| s_j - s[i] < 1.0 - reach);
        [near, if self.is_periodic { far..s.len() } else { 0..0 }]
    }
}

impl Loop for CountWindows<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let CountWindows { sorted, shells: Counts { kinds, bins, per_length, .. }, first, step, numbers } =
            self;
        let (width, last) = (bins + 1, *bins as f64);
        for i in (first..sorted.s.len()).step_by(step) {
            let of_i = &mut numbers[sorted.species[i] * kinds * width..][..kinds * width];
            for window in sorted.windows(i) {
                for from in window.clone().step_by(LANES) {
                    let mut d = [[0.0; LANES]; 3];
                    for c in 0..3 {
                        for k in 0..LANES {
                            d[c][k] = sorted.x[c][from + k] - sorted.x[c][i];
                        }
                    }
                    sorted.images.find_nearest(&mut d);
                    let mut shell = [0; LANES];
                    for k in 0..LANES {
                        let square = d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k];
                        let place = square.sqrt() * per_length;
                        // SAFETY: NaN compares as false and becomes `last`, so the value is from 0 to `last`.
                        shell[k] =
                            unsafe { (if place < last { place } else { last }).to_int_unchecked::<i32>() };
                    }
                    for k in 0..LANES.min(window.end - from) {
                        of_i[sorted.species[from + k] * width + shell[k] as usize] += 1;
                    }
                }
            }
        }
    }
}
