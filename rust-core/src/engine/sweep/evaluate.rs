//! What a vector's worth of particles and all their pairs do: distances, each term, and the rows that are added to
//! the particles.

use super::arithmetic::{Arithmetic, Pairs};
use super::aside::aside;
use super::block::Block;
use super::forces::{Kind, Sums, add_linear, add_soft, add_spline, forces, sum};
use super::keep::keep;
use super::layer::{Part, Swept};
use super::many_body::NearPairs;
use super::simd::{Isa, Reals, Scalar, Words};
use super::thermostat::{UNIT, draw};
use super::weights::weights;
use super::whole::keep_whole;
use crate::engine::noise::PairNoise;
use crate::engine::tally::Tally;
use crate::model::kernel::Real;

/// Evaluates the pairs of a part, in short loops over vectors of them: in one for all the processor would see but one
/// vector at a time.
///
/// Leaves rows of forces and weights in the block; appends to `near` the pairs that a density reaches.
///
/// # Safety
/// The contract of `simd`; the block has the columns of the part.
#[inline(always)]
pub unsafe fn evaluate<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    kit: &Kit<I, A>,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
    part: Part,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        separate::<I, A, SEVERAL>(swept, kit, block, part);
        let mut sums = Sums::<A::Reals>::zero();
        if TALLY {
            shares(swept, block, part);
        }
        if swept.terms.has_more() {
            more::<I, A, SEVERAL, TALLY>(swept, block, part, &mut sums, tally);
        }
        weights::<I, A>(swept, block, part);
        forces::<I, A, SEVERAL, TALLY>(swept, kit, block, part, &mut sums);
        if SEVERAL && swept.terms.whole {
            keep_whole::<I, A, SEVERAL, TALLY>(swept, block, &mut near.whole, part);
        } else {
            near.reserve::<TALLY>(part.count() + 16);
            keep::<I, A, TALLY>(swept, block, near, part);
        }
        if TALLY {
            tally.pair += sum(sums.pair);
            tally.excess += sum(sums.excess);
            for c in 0..6 {
                tally.virial[c] += sum(sums.virial[c]);
                tally.thermostat_virial[c] += sum(sums.thermostat[c]);
            }
        }
    }
}

/// What is the same for all blocks of a step.
#[derive(Clone, Copy)]
pub struct Kit<I: Isa, A: Arithmetic<I>> {
    metric: A::Metric,
    pub noise: Option<PairNoise>,
    /// Signed words of noise times this are `ξ dt^{−1/2}`.
    pub unit: A::Reals,
    /// 0, 1, 2 …
    lane: A::Reals,
}

impl<I: Isa, A: Arithmetic<I>> Kit<I, A> {
    #[inline(always)]
    pub unsafe fn new(swept: &Swept<A::Scalar, A::Record>) -> Self {
        // SAFETY: the contract of `simd`.
        unsafe {
            let drags = swept.thermostat.filter(|_| swept.terms.drag.is_some());
            let (noise, inverse_root_dt) = drags.unzip();
            let unit = A::Reals::constant(UNIT * inverse_root_dt.unwrap_or_default());
            let mut lane = [A::Scalar::default(); 16];
            for (k, lane) in lane.iter_mut().enumerate() {
                *lane = A::Scalar::of(k as f64);
            }
            Kit { metric: A::metric(swept.frame), noise, unit, lane: A::Reals::load(lane.as_ptr()) }
        }
    }
}

/// Where lanes behind the last pair are: out of reach of everything.
const FAR: f64 = 1e18;

/// Distances, kinds and noise of the pairs.
#[inline(always)]
unsafe fn separate<I: Isa, A: Arithmetic<I>, const SEVERAL: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    kit: &Kit<I, A>,
    block: &mut Block<A::Scalar>,
    part: Part,
) {
    // SAFETY: the contract of `simd`; blocks have room for all pairs and a vector behind.
    unsafe {
        let records = swept.records.as_ptr();
        let own: *const _ = &block.own;
        let p_which = block.which.as_ptr().add(part.pairs[0]);
        let p_j = block.j.as_ptr().add(part.pairs[0]);
        let count = part.count();
        let p_pairs = block.pairs.as_mut_ptr().cast::<Pairs<A::Reals>>();
        let p_tags = [block.tags[0].as_mut_ptr(), block.tags[1].as_mut_ptr()];
        let moving = kit.noise.is_some();
        let metric = kit.metric;
        let species = swept.terms.species;
        let mut pairs = p_pairs;
        let mut k = 0;
        while k < count {
            let which = <A::Reals as Reals>::Words::load_bytes(p_which.add(k));
            let places = p_j.add(k);
            let (apart, names) = if moving || SEVERAL {
                A::separate::<true>(&metric, records, own, which, places, moving)
            } else {
                A::separate::<false>(&metric, records, own, which, places, false)
            };
            (*pairs).apart = apart;
            if moving {
                names.tags[0].store(p_tags[0].add(k));
                names.tags[1].store(p_tags[1].add(k));
            }
            if SEVERAL {
                let species_i = <A::Reals as Reals>::Words::pick((*own).species.as_ptr(), which);
                (*pairs).kind = Kind::new(species_i, names.species_j, species);
            }
            pairs = pairs.add(1);
            k += A::Reals::LANES;
        }
        let left = count % A::Reals::LANES;
        if left > 0 {
            let last = &mut *p_pairs.add(count / A::Reals::LANES);
            let far = A::Reals::constant(FAR).where_below(A::Reals::constant(left as f64 - 0.5), kit.lane);
            last.apart.r = last.apart.r.where_below(kit.lane, A::Reals::constant(left as f64)) + far;
        }
        if let Some(noise) = kit.noise {
            draw::<<I::F32 as Reals>::Words>(noise, p_tags[0], p_tags[1], count);
        }
    }
}

/// The forces of terms beyond the first soft one, which `forces` begins with.
#[inline(always)]
unsafe fn more<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &mut Block<A::Scalar>,
    part: Part,
    sums: &mut Sums<A::Reals>,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let terms = swept.terms;
        let vectors = part.count().div_ceil(A::Reals::LANES);
        block.conservative[..vectors * A::Reals::LANES].fill(A::Scalar::default());
        if !terms.apart.is_empty() {
            aside::<I, A, SEVERAL, TALLY>(swept, block, part, tally);
        }
        for term in terms.other_soft() {
            add_soft::<A::Reals, SEVERAL, TALLY>(term, block, vectors, &mut sums.pair);
        }
        for term in &terms.linear {
            add_linear::<A::Reals, SEVERAL, TALLY>(term, block, vectors, &mut sums.excess);
        }
        for term in &terms.spline {
            add_spline::<A::Reals, SEVERAL, TALLY>(term, block, vectors, &mut sums.pair);
        }
    }
}

/// How much of each pair counts here, nothing beyond the last.
#[inline(never)]
fn shares<T: Scalar>(swept: &Swept<T, impl super::arithmetic::Record>, block: &mut Block<T>, part: Part) {
    let count = part.count();
    for p in 0..count {
        let [i, j] = block.pair(part, p);
        block.share[p] = T::of(swept.share(i, j));
    }
    // No vector has more lanes.
    block.share[count..count + 16].fill(T::default());
}
