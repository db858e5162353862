//! Computes the vectors of listed pairs in double precision: of all pairs that the search finds if the precision is double,
//! and of all pairs with ghosts that are in single precision.
//!
//! The search uses fractions of the rank's region, in single precision: the vectors of a pair on two
//! ranks differ by 10⁻⁷. From the coordinates of the host they agree to the rounding of double
//! precision, and so do the lists of pairs.

use super::PairThermostat;
use super::weights::weights;
use crate::engine::particles::Particles;
use crate::engine::sweep::{Images, MARGIN, Places, PlanePairs, Pool};
use crate::engine::vectors::{self, Loop};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::plane::list::{ExactPair, Listed, PairList, WeightTables};

/// Number of pairs in a block.
const BLOCK: usize = 64;

/// The weights of pairs, and the least `1 − r/R` of a pair: pairs that are not surely listed on both ranks are left out on both.
struct Laws {
    weights: WeightTables<f64>,
    least: f64,
}

impl PairThermostat {
    /// Computes the listed pairs in double precision where they should be and are not, and removes those beyond their range.
    pub(super) fn measure(
        &mut self,
        pool: &Pool,
        domain: &PeriodicBox,
        particles: &Particles,
        species_of_kind: &[i32],
        is_exact: bool,
    ) {
        let PairThermostat { plan, dimensions, dt, set, lists, planes, .. } = self;
        let laws = Laws { weights: weights(plan, *dt), least: if is_exact { 0.0 } else { MARGIN } };
        let places = Places::new(*dimensions, domain, particles.x, lists.order());
        let set = *set;
        let law = |i: usize, j: usize| match laws.weights.species {
            1 => 0,
            count => {
                let [a, b] =
                    [i, j].map(|k| species_of_kind[particles.kind[places.host(k)] as usize] as usize);
                a * count + b
            }
        };
        pool.each(planes, |PlanePairs { own, next, lists: Listed { own: list, with_ghosts } }| {
            let mut block = Block::new(&laws);
            let weigh = |block: &mut Block| {
                vectors::run(set, Weigh { block, images: places.images, laws: &laws });
            };
            if is_exact && list.exact.is_empty() {
                // Each position is read often.
                let x: Vec<_> = (own.start..own.end + next.len()).map(|k| places.x(k)).collect();
                measure(list, |k| x[k - own.start], &mut block, law, weigh);
            }
            if with_ghosts.exact.is_empty() {
                measure(with_ghosts, |k| places.x(k), &mut block, law, weigh);
            }
        });
    }
}

/// Gathers the pairs in blocks, for which `weigh` computes factors, and keeps pairs with a positive
/// factor; `position` and `law` take sorted particles.
fn measure(
    list: &mut PairList,
    position: impl Fn(usize) -> [f64; 3],
    block: &mut Block,
    law: impl Fn(usize, usize) -> usize,
    weigh: impl Fn(&mut Block),
) {
    let PairList { first, j_from, start, pairs, exact, .. } = list;
    exact.reserve(pairs.len());
    // The row of the next pair, and the number of kept pairs.
    let (mut i, mut kept) = (0, 0);
    for from in (0..pairs.len()).step_by(BLOCK) {
        let to = pairs.len().min(from + BLOCK);
        let mut row = i;
        for (n, pair) in pairs[from..to].iter().enumerate() {
            while from + n >= start[row + 1] as usize {
                row += 1;
            }
            let [i, j] = [*first + row, *j_from + pair.j as usize];
            let (a, b) = (position(i), position(j));
            (0..3).for_each(|c| block.d[c][n] = a[c] - b[c]);
            block.law[n] = law(i, j);
        }
        weigh(block);
        let [x, y, z] = &block.d;
        for k in from..to {
            while k >= start[i + 1] as usize {
                start[i + 1] = kept as u32;
                i += 1;
            }
            let (n, pair) = (k - from, pairs[k]);
            let factor = block.factor[n];
            // The comparison removes pairs whose factor is NaN too.
            let acts = factor > 0.0 && factor < f64::INFINITY;
            if !acts {
                continue;
            }
            pairs[kept] = pair;
            kept += 1;
            exact.push(ExactPair::new([factor * x[n], factor * y[n], factor * z[n]], pair.j));
        }
    }
    if let Some(rest) = start.get_mut(i + 1..) {
        rest.fill(kept as u32);
    }
    pairs.truncate(kept);
}

/// A block of pairs, as parallel arrays.
struct Block {
    d: [[f64; BLOCK]; 3],
    law: [usize; BLOCK],
    amplitude: [f64; BLOCK],
    inverse_range: [f64; BLOCK],
    /// Factor `√(½ Δt γ) w_R/r`; zero or NaN in unused entries.
    factor: [f64; BLOCK],
}

impl Block {
    /// A block in which all pairs have the first law.
    fn new(laws: &Laws) -> Block {
        Block {
            d: [[0.0; BLOCK]; 3],
            law: [0; BLOCK],
            amplitude: [laws.weights.amplitude[0]; BLOCK],
            inverse_range: [laws.weights.inverse_range[0]; BLOCK],
            factor: [0.0; BLOCK],
        }
    }
}

/// Computes the nearest images of a block, and their factors.
struct Weigh<'a> {
    block: &'a mut Block,
    images: Images,
    laws: &'a Laws,
}

impl Loop for Weigh<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Weigh { block: Block { d, law, amplitude, inverse_range, factor }, images, laws } = self;
        images.find_nearest(d);
        let Laws { weights, least } = laws;
        if weights.species > 1 {
            for n in 0..BLOCK {
                (amplitude[n], inverse_range[n]) = (weights.amplitude[law[n]], weights.inverse_range[law[n]]);
            }
        }
        let [x, y, z] = d;
        for n in 0..BLOCK {
            // The array stores the distance until the factor replaces it.
            factor[n] = (x[n] * x[n] + y[n] * y[n] + z[n] * z[n]).sqrt();
        }
        let inside = |ratio: f64| if 1.0 - ratio > *least { 1.0 - ratio } else { 0.0 };
        match &weights.exponent {
            Exponent::One => {
                for n in 0..BLOCK {
                    let t = inside(factor[n] * inverse_range[n]);
                    factor[n] = amplitude[n] * t / factor[n];
                }
            }
            Exponent::Two => {
                for n in 0..BLOCK {
                    let t = inside(factor[n] * inverse_range[n]);
                    factor[n] = amplitude[n] * t * t / factor[n];
                }
            }
            Exponent::Quarters(quarters) => {
                for n in 0..BLOCK {
                    let t = inside(factor[n] * inverse_range[n]);
                    factor[n] = amplitude[n] * of_quarters(t, *quarters) / factor[n];
                }
            }
            Exponent::Any(exponent) => {
                for n in 0..BLOCK {
                    let t = inside(factor[n] * inverse_range[n]);
                    let w = if t > 0.0 { t.powf(exponent[law[n]]) } else { 0.0 };
                    factor[n] = amplitude[n] * w / factor[n];
                }
            }
        }
    }
}

/// The power `t^(n/4)`, from the bits of n.
#[inline(always)]
fn of_quarters(t: f64, n: u8) -> f64 {
    let (root, square) = (t.sqrt(), t * t);
    let mut product = if n & 1 != 0 { root.sqrt() } else { 1.0 };
    product *= if n & 2 != 0 { root } else { 1.0 };
    product *= if n & 4 != 0 { t } else { 1.0 };
    product *= if n & 8 != 0 { square } else { 1.0 };
    product * if n & 16 != 0 { square * square } else { 1.0 }
}
