//! What pairs do, added to the accumulators of their particles.

use super::arithmetic::{Arithmetic, Record};
use super::block::Block;
use super::layer::{Shared, Swept};
use super::simd::{Isa, Quad, Scalar};

/// Adds the rows of the pairs of `slots` of a block to both particles of each pair.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(
    sums: Shared<f64>,
    offset: isize,
    block: &Block<A::Scalar>,
    [first, last]: [usize; 2],
) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        // The second particle gets minus the row, so the weight in it is negative.
        const SIGN: [f64; 4] = [1.0, 1.0, 1.0, -1.0];
        let sign = I::Quad::load(SIGN.as_ptr());
        let base = sums.0.offset(4 * offset);
        let (rows, j) = (block.rows.as_ptr(), block.j.as_ptr());
        let mut p = *block.begin.get_unchecked(first) as usize;
        let mut m = first;
        while m < last {
            let to = *block.begin.get_unchecked(m + 1) as usize;
            let mut sum = I::Quad::zero();
            while p < to {
                let row = A::load_quad(rows.add(4 * p));
                let at = base.add(4 * *j.add(p) as usize);
                sum = sum.add(row);
                I::Quad::load(at).sub(row).store(at);
                p += 1;
            }
            add_to(base.add(4 * *block.members.get_unchecked(m) as usize), sum.mul(sign));
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
    [first, last]: [usize; 2],
) {
    // SAFETY: as `scatter`.
    unsafe {
        let species = swept.terms.species;
        let width = swept.variables;
        let base = swept.densities.0.offset(width as isize * offset);
        let passes = swept.terms.passes.len();
        let mut p = *block.begin.get_unchecked(first) as usize;
        let mut m = first;
        while m < last {
            let to = *block.begin.get_unchecked(m + 1) as usize;
            let i = *block.members.get_unchecked(m) as usize;
            let si = if species > 1 { *swept.species.get_unchecked(i) as usize } else { 0 };
            let at_i = base.add(width * i);
            while p < to {
                let j = *block.j.get_unchecked(p) as usize;
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
