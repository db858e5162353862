//! What pairs do, added to the accumulators of their particles.

use super::arithmetic::{Arithmetic, Record};
use super::block::{Block, PLACE_BITS};
use super::layer::{Part, Shared, Swept};
use super::simd::{Isa, Quad, Scalar};

/// An accumulator: a force, and the density if there is one variable; aligned so that none straddles lines of the
/// cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Sum(pub [f64; 4]);

const _: () = assert!(size_of::<Sum>() == 1 << PLACE_BITS);

/// Adds the rows of pairs to both particles of each.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(
    sums: Shared<f64>,
    offset: isize,
    block: &mut Block<A::Scalar>,
    part: Part,
) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        // The second particle gets minus the row, so the weight in it is negative.
        const SIGN: [f64; 4] = [1.0, 1.0, 1.0, -1.0];
        let sign = I::Quad::load(SIGN.as_ptr());
        let base = sums.0.offset(4 * offset);
        let rows = block.rows.as_mut_ptr().cast::<A::Scalar>();
        let places = block.j.as_ptr().add(part.pairs[0]);
        // One loop over all, not one for each member, none of whose ends is to be foreseen: what a member gets is
        // the difference of two running sums, of which every other one is kept. Behind an odd number nothing follows.
        let count = part.count();
        rows.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        let sums = block.pairs.as_mut_ptr().cast::<f64>();
        let mut sum = I::Quad::zero();
        let mut p = 0;
        while p < count {
            sum.store(sums.add(2 * p));
            let row = A::load_quad(rows.add(4 * p));
            let at = base.byte_add(*places.add(p) as usize);
            I::Quad::load(at).sub(row).store(at);
            let next = A::load_quad(rows.add(4 * p + 4));
            let at = base.byte_add(*places.add(p + 1) as usize);
            I::Quad::load(at).sub(next).store(at);
            sum = sum.add(row.add(next));
            p += 2;
        }
        sum.store(sums.add(2 * p));
        let begin = block.begin.as_ptr();
        let [first, last] = part.slots;
        let mut before = I::Quad::zero();
        let mut m = first;
        while m < last {
            let end = *begin.add(m + 1) as usize - part.pairs[0];
            let even = end & !1;
            let odd = A::load_quad(rows.add(4 * even)).mul(I::Quad::splat((end & 1) as f64));
            let all = I::Quad::load(sums.add(2 * even)).add(odd);
            add_to(base.add(4 * (part.first + m - first)), all.sub(before).mul(sign));
            before = all;
            m += 1;
        }
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

/// Adds weights where there are several densities or species.
#[inline(always)]
pub unsafe fn scatter_weights<T: Scalar>(
    swept: &Swept<T, impl Record>,
    offset: isize,
    block: &Block<T>,
    part: Part,
) {
    // SAFETY: as `scatter`.
    unsafe {
        let species = swept.terms.species;
        let width = swept.variables;
        let base = swept.densities.0.offset(width as isize * offset);
        let passes = swept.terms.passes.len();
        let [first, last] = part.slots;
        let places = block.j.as_ptr().add(part.pairs[0]);
        let mut p = 0;
        let mut m = first;
        while m < last {
            let to = *block.begin.get_unchecked(m + 1) as usize - part.pairs[0];
            let i = part.first + m - first;
            let si = if species > 1 { *swept.species.get_unchecked(i) as usize } else { 0 };
            let at_i = base.add(width * i);
            while p < to {
                let j = (*places.add(p) >> PLACE_BITS) as usize;
                let sj = if species > 1 { *swept.species.get_unchecked(j) as usize } else { 0 };
                let at_j = base.add(width * j + si);
                let mut d = 0;
                while d < passes {
                    let w = block.weight.get_unchecked(d).get_unchecked(p).wide();
                    *at_i.add(d * species + sj) += w;
                    *at_j.add(d * species) += w;
                    d += 1;
                }
                p += 1;
            }
            m += 1;
        }
    }
}
