//! What a block of pairs does: each term adds to the forces along `ê` in a loop of its own.

use super::block::Block;
use super::simd::{Isa, Quad, Reals, Scalar, Words};
use super::terms::{Drag, Exponent, Linear, Pass, Soft, Spline, Terms};
use crate::engine::noise::PairNoise;
use crate::engine::tally::Tally;
use crate::model::kernel::{CubicSpline, Shape, ShapeVisitor};
use crate::model::pair::PairForm;

/// An entry of a table for each pair of a vector; `SEVERAL` species, or one for all.
#[inline(always)]
unsafe fn entry<R: Reals, const SEVERAL: bool>(table: &[R::Scalar], kind: *const u32) -> R {
    // SAFETY: the contract of `simd`; kinds are below the length of every table, which is not empty.
    unsafe { if SEVERAL { R::lookup(table.as_ptr(), kind) } else { R::splat(*table.get_unchecked(0)) } }
}

/// What the terms of a block are computed with.
pub struct Evaluation<'a, T> {
    pub terms: &'a Terms<T>,
    /// Noise and `dt^{-1/2}`; `None` leaves drag and noise out.
    pub thermostat: Option<(PairNoise, f64)>,
}

/// Conservative forces of all terms that need no density, weights of those that do, drag and noise.
///
/// # Safety
/// The contract of `simd`; `separate` has filled the block.
#[inline(always)]
pub unsafe fn evaluate<I: Isa, R: Reals, const SEVERAL: bool, const TALLY: bool>(
    with: &Evaluation<R::Scalar>,
    block: &mut Block<R::Scalar>,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let terms = with.terms;
        let count = block.count;
        let mut first = true;
        let mut s = 0;
        while s < terms.soft.len() {
            soft::<R, SEVERAL, TALLY>(&terms.soft[s], block, first, tally);
            first = false;
            s += 1;
        }
        if first {
            let mut k = 0;
            while k < count {
                R::constant(0.0).store(block.conservative.as_mut_ptr().add(k));
                k += R::LANES;
            }
        }
        let mut s = 0;
        while s < terms.linear.len() {
            let term = &terms.linear[s];
            term.force_kind.visit(LinearForce::<R, SEVERAL> { term, block });
            if TALLY {
                term.kind.visit(LinearEnergy::<R, SEVERAL> { term, block, tally });
            }
            s += 1;
        }
        let mut s = 0;
        while s < terms.spline.len() {
            spline::<R, SEVERAL, TALLY>(&terms.spline[s], block, tally);
            s += 1;
        }
        if !terms.apart.is_empty() {
            apart::<R::Scalar, SEVERAL, TALLY>(terms, block, tally);
        }
        let mut s = 0;
        while s < terms.passes.len() {
            terms.passes[s].kind.visit(Weights::<R> { pass: &terms.passes[s], number: s, block });
            s += 1;
        }
        if let (Some((noise, inverse_root_dt)), Some(drag)) = (&with.thermostat, &terms.drag) {
            draw::<I>(*noise, block);
            match &drag.exponent {
                Exponent::One => thermostat::<R, SEVERAL, 1>(drag, *inverse_root_dt, block),
                Exponent::Two => thermostat::<R, SEVERAL, 2>(drag, *inverse_root_dt, block),
                Exponent::Any(exponent) => {
                    thermostat_of_any_exponent::<R::Scalar, SEVERAL>(drag, exponent, *inverse_root_dt, block);
                }
            }
        }
    }
}

#[inline(always)]
unsafe fn soft<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: &Soft<R::Scalar>,
    block: &mut Block<R::Scalar>,
    first: bool,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let (one, zero) = (R::constant(1.0), R::constant(0.0));
        let mut energy = zero;
        let p_kind = block.kind.as_ptr();
        let p_r = block.r.as_ptr();
        let p_conservative = block.conservative.as_mut_ptr();
        let p_share = block.share.as_ptr();
        let count = block.count;
        let mut k = 0;
        while k < count {
            let kind = p_kind.add(k);
            let r = R::load(p_r.add(k));
            let t = (one - r * entry::<R, SEVERAL>(&term.inverse_range, kind)).larger(zero);
            let out = p_conservative.add(k);
            let before = if first { zero } else { R::load(out) };
            t.mul_add(entry::<R, SEVERAL>(&term.strength, kind), before).store(out);
            if TALLY {
                let share = R::load(p_share.add(k));
                energy = (t * t).mul_add(share * entry::<R, SEVERAL>(&term.energy, kind), energy);
            }
            k += R::LANES;
        }
        if TALLY {
            tally.pair += sum(energy);
        }
    }
}

/// The sum of the lanes.
#[inline(always)]
unsafe fn sum<R: Reals>(x: R) -> f64 {
    let mut lanes = [R::Scalar::default(); 16];
    // SAFETY: no vector has more lanes.
    unsafe { x.store(lanes.as_mut_ptr()) };
    let mut sum = 0.0;
    for lane in &lanes[..R::LANES] {
        sum += lane.wide();
    }
    sum
}

struct LinearForce<'a, R: Reals, const SEVERAL: bool> {
    term: &'a Linear<R::Scalar>,
    block: &'a mut Block<R::Scalar>,
}

impl<R: Reals, const SEVERAL: bool> ShapeVisitor for LinearForce<'_, R, SEVERAL> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: called within `evaluate`.
        unsafe {
            let Self { term, block } = self;
            let inverse_range = R::splat(term.force_inverse_range);
            let p_r = block.r.as_ptr();
            let p_kind = block.kind.as_ptr();
            let p_conservative = block.conservative.as_mut_ptr();
            let count = block.count;
            let mut k = 0;
            while k < count {
                let s = R::load(p_r.add(k)) * inverse_range;
                let factor = entry::<R, SEVERAL>(&term.force, p_kind.add(k));
                let out = p_conservative.add(k);
                let force = (factor * S::slope(s)).where_below(s, R::constant(1.0));
                (R::load(out) + force).store(out);
                k += R::LANES;
            }
        }
    }
}

struct LinearEnergy<'a, R: Reals, const SEVERAL: bool> {
    term: &'a Linear<R::Scalar>,
    block: &'a mut Block<R::Scalar>,
    tally: &'a mut Tally,
}

impl<R: Reals, const SEVERAL: bool> ShapeVisitor for LinearEnergy<'_, R, SEVERAL> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: called within `evaluate`.
        unsafe {
            let Self { term, block, tally } = self;
            let inverse_range = R::splat(term.inverse_range);
            let mut energy = R::constant(0.0);
            let mut k = 0;
            while k < block.count {
                let s = R::load(block.r.as_ptr().add(k)) * inverse_range;
                let factor = entry::<R, SEVERAL>(&term.energy, block.kind.as_ptr().add(k));
                let w = (factor * S::value(s)).where_below(s, R::constant(1.0));
                energy = w.mul_add(R::load(block.share.as_ptr().add(k)), energy);
                k += R::LANES;
            }
            tally.excess += sum(energy);
        }
    }
}

#[inline(always)]
unsafe fn spline<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: &Spline<R::Scalar>,
    block: &mut Block<R::Scalar>,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let (one, zero) = (R::constant(1.0), R::constant(0.0));
        let mut energy = zero;
        let p_kind = block.kind.as_ptr();
        let p_r = block.r.as_ptr();
        let p_conservative = block.conservative.as_mut_ptr();
        let p_share = block.share.as_ptr();
        let count = block.count;
        let mut k = 0;
        while k < count {
            let kind = p_kind.add(k);
            let r = R::load(p_r.add(k));
            let inverse_a = entry::<R, SEVERAL>(&term.repulsion_inverse_range, kind);
            let inverse_b = entry::<R, SEVERAL>(&term.attraction_inverse_range, kind);
            // At s = 1 the shape and its slope vanish; beyond, it stays there.
            let a = one - (one - r * inverse_a).larger(zero);
            let b = one - (one - r * inverse_b).larger(zero);
            let repulsion = entry::<R, SEVERAL>(&term.repulsion, kind);
            let attraction = entry::<R, SEVERAL>(&term.attraction, kind);
            let slope = repulsion * inverse_a * CubicSpline::slope(a)
                - attraction * inverse_b * CubicSpline::slope(b);
            let out = p_conservative.add(k);
            (R::load(out) - slope).store(out);
            if TALLY {
                let phi = repulsion * CubicSpline::value(a) - attraction * CubicSpline::value(b);
                energy = phi.mul_add(R::load(p_share.add(k)), energy);
            }
            k += R::LANES;
        }
        if TALLY {
            tally.pair += sum(energy);
        }
    }
}

/// Potentials of any form, in double precision, for the pairs they act on.
#[inline(never)]
fn apart<T: Scalar, const SEVERAL: bool, const TALLY: bool>(
    terms: &Terms<T>,
    block: &mut Block<T>,
    tally: &mut Tally,
) {
    for term in &terms.apart {
        let [a, b] = term.between;
        let (ab, ba) = ((a * terms.species + b) as u32, (b * terms.species + a) as u32);
        let range = term.potential.range();
        let mut found = 0;
        for k in 0..block.count {
            let r = block.r[k].wide();
            let acts = !SEVERAL || block.kind[k] == ab || block.kind[k] == ba;
            block.apart.place[found] = k as u32;
            block.apart.r[found] = r;
            found += (acts && r < range) as usize;
        }
        let apart = &mut block.apart;
        term.potential.block(&apart.r[..found], &mut apart.phi[..found], &mut apart.slope[..found]);
        for n in 0..found {
            let k = apart.place[n] as usize;
            block.conservative[k] = T::of(block.conservative[k].wide() - apart.slope[n]);
            if TALLY {
                tally.pair += apart.phi[n] * block.share[k].wide();
            }
        }
    }
}

struct Weights<'a, R: Reals> {
    pass: &'a Pass<R::Scalar>,
    number: usize,
    block: &'a mut Block<R::Scalar>,
}

impl<R: Reals> ShapeVisitor for Weights<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: called within `evaluate`.
        unsafe {
            let Self { pass, number, block } = self;
            let (inverse_range, factor) = (R::splat(pass.inverse_range), R::splat(pass.value));
            let out = block.weight[number].as_mut_ptr();
            let p_r = block.r.as_ptr();
            let count = block.count;
            let mut k = 0;
            while k < count {
                let s = R::load(p_r.add(k)) * inverse_range;
                (factor * S::value(s)).where_below(s, R::constant(1.0)).store(out.add(k));
                k += R::LANES;
            }
        }
    }
}

/// The noise of each pair, as a signed word.
#[inline(always)]
unsafe fn draw<I: Isa>(noise: PairNoise, block: &mut Block<impl Scalar>) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let [k0, k1] = noise.key();
        let schedule =
            [I::U32::splat(k0), I::U32::splat(k1), I::U32::splat(crate::engine::noise::PARITY ^ k0 ^ k1)];
        let p_tag_i = block.tag_i.as_ptr();
        let p_tag_j = block.tag_j.as_ptr();
        let p_noise = block.noise.as_mut_ptr();
        let count = block.count;
        let mut k = 0;
        while k < count {
            let a = I::U32::load(p_tag_i.add(k));
            let b = I::U32::load(p_tag_j.add(k));
            let mut x0 = a.min(b).add(schedule[0]);
            let mut x1 = a.max(b).add(schedule[1]);
            // Written out: rotations by constants are one instruction.
            (x0, x1) = four_rounds::<I>(x0, x1, 0);
            (x0, x1) = inject::<I>(x0, x1, &schedule, 1);
            (x0, x1) = four_rounds::<I>(x0, x1, 4);
            (x0, x1) = inject::<I>(x0, x1, &schedule, 2);
            (x0, x1) = four_rounds::<I>(x0, x1, 0);
            (x0, x1) = inject::<I>(x0, x1, &schedule, 3);
            // Of the last round only the first word is of use.
            x0 = x0.add(x1);
            x0.xor(I::U32::splat(0x8000_0000)).store(p_noise.add(k).cast());
            k += I::U32::LANES;
        }
    }
}

const _: () = assert!(crate::engine::noise::PAIR_ROUNDS == 13);

/// Four rounds of Threefry from round `at` of eight on.
#[inline(always)]
unsafe fn four_rounds<I: Isa>(mut x0: I::U32, mut x1: I::U32, at: usize) -> (I::U32, I::U32) {
    use crate::engine::noise::ROTATIONS;
    // SAFETY: the contract of `simd`.
    unsafe {
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 1]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 2]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 3]).xor(x0);
    }
    (x0, x1)
}

/// The injection of the key behind four rounds.
#[inline(always)]
unsafe fn inject<I: Isa>(x0: I::U32, x1: I::U32, schedule: &[I::U32; 3], number: usize) -> (I::U32, I::U32) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let x1 = x1.add(schedule[(number + 1) % 3]).add(I::U32::splat(number as u32));
        (x0.add(schedule[number % 3]), x1)
    }
}

/// `√3/2³¹`: signed words to numbers of unit variance.
const UNIT: f64 = 1.732_050_807_568_877_2 / 2_147_483_648.0;

#[inline(always)]
unsafe fn thermostat<R: Reals, const SEVERAL: bool, const EXPONENT: usize>(
    drag: &Drag<R::Scalar>,
    inverse_root_dt: f64,
    block: &mut Block<R::Scalar>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let (one, zero) = (R::constant(1.0), R::constant(0.0));
        let (half, unit) = (R::constant(0.5), R::constant(UNIT * inverse_root_dt));
        let p_kind = block.kind.as_ptr();
        let p_r = block.r.as_ptr();
        let p_noise = block.noise.as_ptr();
        let p_along = block.along.as_ptr();
        let p_thermostat = block.thermostat.as_mut_ptr();
        let count = block.count;
        let mut k = 0;
        while k < count {
            let kind = p_kind.add(k);
            let r = R::load(p_r.add(k));
            let t = (one - r * entry::<R, SEVERAL>(&drag.inverse_range, kind)).larger(zero);
            let w = if EXPONENT == 2 { t * t } else { t };
            let xi = (R::load_signed(p_noise.add(k)) + half) * unit;
            let along = R::load(p_along.add(k));
            let pull = entry::<R, SEVERAL>(&drag.sigma, kind) * xi
                - entry::<R, SEVERAL>(&drag.gamma, kind) * w * along;
            (w * pull).store(p_thermostat.add(k));
            k += R::LANES;
        }
    }
}

#[inline(never)]
fn thermostat_of_any_exponent<T: Scalar, const SEVERAL: bool>(
    drag: &Drag<T>,
    exponent: &[T],
    inverse_root_dt: f64,
    block: &mut Block<T>,
) {
    for k in 0..block.count {
        let kind = if SEVERAL { block.kind[k] as usize } else { 0 };
        let t = (1.0 - block.r[k].wide() * drag.inverse_range[kind].wide()).max(0.0);
        let w = t.powf(exponent[kind].wide());
        let xi = (block.noise[k] as f64 + 0.5) * UNIT * inverse_root_dt;
        let pull = drag.sigma[kind].wide() * xi - drag.gamma[kind].wide() * w * block.along[k].wide();
        block.thermostat[k] = T::of(if t > 0.0 { w * pull } else { 0.0 });
    }
}

/// Adds virials of the forces along `ê`.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn virial<R: Reals>(block: &Block<R::Scalar>, forces: &[R::Scalar], out: &mut [f64; 6]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let mut sums = [R::constant(0.0); 6];
        let mut k = 0;
        while k < block.count {
            let share = R::load(block.share.as_ptr().add(k)) * R::load(block.inverse.as_ptr().add(k));
            let f = R::load(forces.as_ptr().add(k)) * share;
            let d = [
                R::load(block.d[0].as_ptr().add(k)),
                R::load(block.d[1].as_ptr().add(k)),
                R::load(block.d[2].as_ptr().add(k)),
            ];
            let fd = [f * d[0], f * d[1], f * d[2]];
            sums[0] = fd[0].mul_add(d[0], sums[0]);
            sums[1] = fd[1].mul_add(d[1], sums[1]);
            sums[2] = fd[2].mul_add(d[2], sums[2]);
            sums[3] = fd[0].mul_add(d[1], sums[3]);
            sums[4] = fd[0].mul_add(d[2], sums[4]);
            sums[5] = fd[1].mul_add(d[2], sums[5]);
            k += R::LANES;
        }
        for c in 0..6 {
            out[c] += sum(sums[c]);
        }
    }
}

/// The forces of a block as rows `fx, fy, fz, −w`.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn rows<R: Reals, const MOVING: bool, const WEIGHT: bool>(block: &mut Block<R::Scalar>) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let zero = R::constant(0.0);
        let p_conservative = block.conservative.as_ptr();
        let p_thermostat = block.thermostat.as_ptr();
        let p_inverse = block.inverse.as_ptr();
        // Without a density there are no weights.
        let p_weight0 = if WEIGHT { block.weight[0].as_ptr() } else { block.r.as_ptr() };
        let p_d0 = block.d[0].as_ptr();
        let p_d1 = block.d[1].as_ptr();
        let p_d2 = block.d[2].as_ptr();
        let p_rows = block.rows.as_mut_ptr();
        let count = block.count;
        let mut k = 0;
        while k < count {
            let mut f = R::load(p_conservative.add(k));
            if MOVING {
                f = f + R::load(p_thermostat.add(k));
            }
            f = f * R::load(p_inverse.add(k));
            let w = if WEIGHT { zero - R::load(p_weight0.add(k)) } else { zero };
            let columns = [f * R::load(p_d0.add(k)), f * R::load(p_d1.add(k)), f * R::load(p_d2.add(k)), w];
            R::rows(columns, p_rows.add(4 * k));
            k += R::LANES;
        }
    }
}

/// Collects the pairs within the range of a density: `−w′ ê` and the second particle of each, one after
/// the other; returns how many. `bits` says which they are.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn collect_near<I: Isa, R: Reals, const TALLY: bool>(
    pass: &Pass<R::Scalar>,
    block: &mut Block<R::Scalar>,
) -> usize {
    pass.force_kind.visit(Near::<I, R, TALLY> { pass, block, of: std::marker::PhantomData })
}

struct Near<'a, I, R: Reals, const TALLY: bool> {
    pass: &'a Pass<R::Scalar>,
    block: &'a mut Block<R::Scalar>,
    of: std::marker::PhantomData<I>,
}

impl<I: Isa, R: Reals, const TALLY: bool> ShapeVisitor for Near<'_, I, R, TALLY> {
    type Output = usize;

    #[inline(always)]
    fn visit<S: Shape>(self) -> usize {
        // SAFETY: called within `collect_near`.
        unsafe {
            let Near { pass, block, .. } = self;
            let inverse_range = R::splat(pass.force_inverse_range);
            let (range, factor) = (R::splat(pass.force_range), R::splat(pass.force));
            let (p_r, p_inverse, p_j) = (block.r.as_ptr(), block.inverse.as_ptr(), block.j.as_ptr());
            let p_d = [block.d[0].as_ptr(), block.d[1].as_ptr(), block.d[2].as_ptr()];
            let near = [block.near[0].as_mut_ptr(), block.near[1].as_mut_ptr(), block.near[2].as_mut_ptr()];
            let near_d =
                [block.near_d[0].as_mut_ptr(), block.near_d[1].as_mut_ptr(), block.near_d[2].as_mut_ptr()];
            let near_j = block.near_j.as_mut_ptr();
            let bits = block.bits.as_mut_ptr();
            let count = block.count;
            let mut found = 0;
            let mut k = 0;
            while k < count {
                let r = R::load(p_r.add(k));
                // Lanes behind the last pair are far away.
                let mask = r.mask_below(range);
                let g = factor * S::slope(r * inverse_range) * R::load(p_inverse.add(k));
                let mut c = 0;
                while c < 3 {
                    let d = R::load(p_d[c].add(k));
                    (g * d).compress(mask, near[c].add(found));
                    if TALLY {
                        d.compress(mask, near_d[c].add(found));
                    }
                    c += 1;
                }
                compress_indices::<I, R>(p_j.add(k), mask, near_j.add(found));
                found += mask.count_ones() as usize;
                match R::LANES {
                    16 => *bits.cast::<u16>().add(k / 16) = mask as u16,
                    8 => *bits.cast::<u8>().add(k / 8) = mask as u8,
                    _ => {
                        let half = bits.cast::<u8>().add(k / 8);
                        *half = if k % 8 == 0 { mask as u8 } else { *half | (mask << 4) as u8 };
                    }
                }
                k += R::LANES;
            }
            found
        }
    }
}

/// Indices may have more lanes than numbers.
#[inline(always)]
unsafe fn compress_indices<I: Isa, R: Reals>(from: *const u32, mask: u32, to: *mut u32) {
    // SAFETY: the contract of `simd`; blocks have room for whole vectors.
    unsafe { I::U32::load(from).compress(mask, to) }
}

/// How many of the pairs `from..to` are set in `bits`.
///
/// # Safety
/// `bits` has them all, and a word behind.
#[inline(always)]
pub unsafe fn count_bits(bits: *const u64, from: usize, to: usize) -> u32 {
    // SAFETY: the caller's.
    unsafe {
        let (word, shift) = (from / 64, from % 64);
        let length = to - from;
        // Two words hold sixty-four pairs, wherever they begin.
        let here = *bits.add(word) >> shift | *bits.add(word + 1) << 1 << (63 - shift);
        if length <= 64 {
            let mask = if length == 64 { u64::MAX } else { (1u64 << length) - 1 };
            return (here & mask).count_ones();
        }
        let mut count = 0;
        let mut p = from;
        while p < to {
            count += (*bits.add(p / 64) >> (p % 64) & 1) as u32;
            p += 1;
        }
        count
    }
}

/// Adds a row to an accumulator.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn add_to<Q: Quad>(p: *mut f64, x: Q) {
    // SAFETY: the contract of `simd`.
    unsafe { Q::load(p).add(x).store(p) }
}
