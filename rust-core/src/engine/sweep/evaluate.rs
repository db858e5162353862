//! What a block of pairs does, a vector at a time: distances, each term, and the rows that are added to the
//! particles.

use super::arithmetic::{Apart, Arithmetic, Pairs};
use super::aside::aside;
use super::block::{Block, PLACE_BITS};
use super::forces::{Kind, Sums, add_virial, slope, sum, value};
use super::layer::{Part, Swept};
use super::many_body::{NEAR_BITS, NearPairs};
use super::simd::{Isa, Reals, Scalar, Words};
use super::terms::Pass;
use super::thermostat::{UNIT, draw};
use crate::engine::noise::PairNoise;
use crate::engine::tally::Tally;
use crate::model::kernel::Real;

/// Evaluates the pairs of a vector's worth of a group.
///
/// Leaves rows of forces and weights in the block; appends to `near` the pairs that a density reaches.
///
/// # Safety
/// The contract of `simd`; the block has the columns of the members.
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
        let count = part.count();
        let terms = swept.terms;
        let lanes = A::Reals::LANES;
        let passes = terms.passes.len();
        if !terms.apart.is_empty() {
            aside::<I, A, SEVERAL, TALLY>(swept, &kit.metric, block, part, tally);
        }
        near.reserve::<TALLY>(count + 16);
        separate::<I, A, SEVERAL>(swept, kit, block, part);
        let zero = A::Reals::constant(0.0);
        let p_which = block.which.as_ptr();
        let p_j = block.j.as_ptr().add(part.pairs[0]);
        let p_rows = block.rows.as_mut_ptr().cast::<A::Scalar>();
        let p_conservative = block.conservative.as_ptr();
        let p_found = block.found.as_mut_ptr();
        let mut p_pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
        let p_noise = block.tags[0].as_ptr();
        let plain = swept.variables == 1;
        let layer_first = <A::Reals as Reals>::Words::splat(near.first << PLACE_BITS);
        let drag = terms.drag.as_ref().filter(|_| swept.thermostat.is_some());
        let mut sums = Sums::<A::Reals>::zero();
        let mut k = 0;
        while k < count {
            let pairs = &*p_pairs;
            let (r, kind) = (pairs.apart.r, pairs.kind);
            let share = if TALLY { shares::<I, A>(swept, block, part, k) } else { zero };
            let mut force = if terms.apart.is_empty() { zero } else { Reals::load(p_conservative.add(k)) };
            for term in &terms.soft {
                force = term.add::<A::Reals, SEVERAL, TALLY>(r, kind, force, share, &mut sums.pair);
            }
            for term in &terms.linear {
                force = term.add::<A::Reals, SEVERAL, TALLY>(r, kind, force, share, &mut sums.excess);
            }
            for term in &terms.spline {
                force = term.add::<A::Reals, SEVERAL, TALLY>(r, kind, force, share, &mut sums.pair);
            }
            if TALLY {
                add_virial(force, &pairs.apart, share, &mut sums.virial);
            }
            if let Some(drag) = drag {
                let word = <A::Reals as Reals>::Words::load(p_noise.add(k));
                let xi = (A::Reals::of_signed(word) + A::Reals::constant(0.5)) * kit.unit;
                let thermostat = drag.force::<A::Reals, SEVERAL>(pairs, xi);
                if TALLY {
                    add_virial(thermostat, &pairs.apart, share, &mut sums.thermostat);
                }
                force = force + thermostat;
            }
            let mut weight = zero;
            let mut pass = 0;
            while pass < passes {
                let term = terms.passes.get_unchecked(pass);
                let s = r * A::Reals::splat(term.inverse_range);
                let w = A::Reals::splat(term.value) * value(term.kind, s);
                let w = w.where_below(s, A::Reals::constant(1.0));
                if plain {
                    weight = w;
                } else {
                    w.store(block.weight.get_unchecked_mut(pass).as_mut_ptr().add(k));
                }
                pass += 1;
            }
            let f = force * pairs.apart.inverse;
            let [dx, dy, dz] = pairs.apart.d;
            A::Reals::rows([f * dx, f * dy, f * dz, zero - weight], p_rows.add(4 * k));
            p_pairs = p_pairs.add(1);
            k += lanes;
        }
        let mut pass = 0;
        while pass < passes {
            let term = terms.passes.get_unchecked(pass);
            let mut p_pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
            let mut found = 0;
            let mut k = 0;
            while k < count {
                let pairs = &*p_pairs;
                let valid = u32::MAX >> (32 - (count - k).min(lanes));
                let share = if TALLY { shares::<I, A>(swept, block, part, k) } else { zero };
                let which = <A::Reals as Reals>::Words::load_bytes(p_which.add(k));
                let code =
                    <A::Reals as Reals>::Words::load(p_j.add(k)).sub(layer_first).shift_right::<PLACE_BITS>();
                let code = A::Reals::encode(code.add(which.rotate(NEAR_BITS)));
                let mask = pairs.apart.r.mask_below(A::Reals::splat(term.force_range)) & valid;
                keep::<A::Reals, TALLY>(term, &pairs.apart, code, mask, share, near, pass, found);
                found += mask.count_ones() as usize;
                p_pairs = p_pairs.add(1);
                k += lanes;
            }
            *p_found.add(pass) = found;
            pass += 1;
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
    noise: Option<PairNoise>,
    /// Signed words of noise times this are `ξ dt^{−1/2}`.
    unit: A::Reals,
}

impl<I: Isa, A: Arithmetic<I>> Kit<I, A> {
    #[inline(always)]
    pub unsafe fn new(swept: &Swept<A::Scalar, A::Record>) -> Self {
        // SAFETY: the contract of `simd`.
        unsafe {
            let drags = swept.thermostat.filter(|_| swept.terms.drag.is_some());
            let (noise, inverse_root_dt) = drags.unzip();
            let unit = A::Reals::constant(UNIT * inverse_root_dt.unwrap_or_default());
            Kit { metric: A::metric(swept.frame), noise, unit }
        }
    }
}

/// Distances, kinds and noise of the pairs, in loops of their own: one loop for all would be so long that the
/// processor sees but one vector at a time.
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
        let p_which = block.which.as_ptr();
        let p_j = block.j.as_ptr().add(part.pairs[0]);
        let count = part.count();
        let mut p_pairs = block.pairs.as_mut_ptr().cast::<Pairs<A::Reals>>();
        let p_tags = [block.tags[0].as_mut_ptr(), block.tags[1].as_mut_ptr()];
        let moving = kit.noise.is_some();
        let mut k = 0;
        while k < count {
            let which = <A::Reals as Reals>::Words::load_bytes(p_which.add(k));
            let (metric, places) = (&kit.metric, p_j.add(k));
            let (apart, names) = if moving || SEVERAL {
                A::separate::<true>(metric, records, own, which, places, moving)
            } else {
                A::separate::<false>(metric, records, own, which, places, false)
            };
            let pairs = &mut *p_pairs;
            pairs.apart = apart;
            if moving {
                names.tags[0].store(p_tags[0].add(k));
                names.tags[1].store(p_tags[1].add(k));
            }
            if SEVERAL {
                let species_i = <A::Reals as Reals>::Words::pick((*own).species.as_ptr(), which);
                pairs.kind = Kind::new(species_i, names.species_j, swept.terms.species);
            }
            p_pairs = p_pairs.add(1);
            k += A::Reals::LANES;
        }
        if let Some(noise) = kit.noise {
            draw::<<I::F32 as Reals>::Words>(noise, p_tags[0], p_tags[1], count);
        }
    }
}

/// Appends rows `−w′ ê` and a code of both particles, of the pairs of `mask`, behind `found` others.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn keep<R: Reals, const TALLY: bool>(
    term: &Pass<R::Scalar>,
    pairs: &Apart<R>,
    code: R,
    mask: u32,
    share: R,
    near: &mut NearPairs<R::Scalar>,
    pass: usize,
    found: usize,
) {
    // SAFETY: the contract of `simd`; `near` has room for whole vectors.
    unsafe {
        let s = pairs.r * R::splat(term.force_inverse_range);
        let g = R::splat(term.force) * slope(term.force_kind, s) * pairs.inverse;
        let [dx, dy, dz] = pairs.d;
        let columns =
            [(g * dx).compress(mask), (g * dy).compress(mask), (g * dz).compress(mask), code.compress(mask)];
        R::rows(columns, near.rows.get_unchecked_mut(pass).end().add(found).cast());
        if TALLY {
            let columns = [dx.compress(mask), dy.compress(mask), dz.compress(mask), share.compress(mask)];
            R::rows(columns, near.apart.get_unchecked_mut(pass).end().add(found).cast());
        }
    }
}

/// How much of each pair counts here, nothing beyond the last.
#[inline(never)]
unsafe fn shares<I: Isa, A: Arithmetic<I>>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &Block<A::Scalar>,
    part: Part,
    k: usize,
) -> A::Reals {
    let mut shares = [A::Scalar::default(); 16];
    for p in k..part.count().min(k + A::Reals::LANES) {
        let [i, j] = block.pair(part, p);
        shares[p - k] = A::Scalar::of(swept.share(i, j));
    }
    // SAFETY: no vector has more lanes.
    unsafe { A::Reals::load(shares.as_ptr()) }
}
