//! What pairs do, added to the accumulators of their particles.

use super::arithmetic::{Arithmetic, Record};
use super::block::Block;
use super::layer::{Shared, Swept};
use super::simd::{Isa, Quad, Scalar};

/// How many sums of each member take turns: one alone would wait for itself at every pair.
const BANKS: usize = 4;

/// What pairs add to their first particles: sums for each of a vector's worth of members. All zero between uses.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Banks([[[f64; 4]; BANKS]; 16]);

impl Default for Banks {
    fn default() -> Banks {
        Banks([[[0.0; 4]; BANKS]; 16])
    }
}

impl Banks {
    /// The sum of member `m` in turn `p`.
    ///
    /// # Safety
    /// There are sixteen members.
    #[inline(always)]
    pub unsafe fn at(&mut self, m: usize, p: usize) -> *mut f64 {
        // SAFETY: the caller's.
        unsafe { self.0.as_mut_ptr().cast::<[f64; 4]>().add(BANKS * m + p % BANKS).cast() }
    }

    /// The sum of member `m`, which is zero then.
    ///
    /// # Safety
    /// The contract of `simd`; there are sixteen members.
    #[inline(always)]
    pub unsafe fn take<Q: Quad>(&mut self, m: usize) -> Q {
        // SAFETY: the caller's.
        unsafe {
            let mut sums = [Q::zero(); BANKS];
            let mut p = 0;
            while p < BANKS {
                sums[p] = Q::load(self.at(m, p));
                Q::zero().store(self.at(m, p));
                p += 1;
            }
            sums[0].add(sums[1]).add(sums[2].add(sums[3]))
        }
    }
}

/// Adds the rows of the pairs of `slots` of a block to both particles of each pair.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(
    sums: Shared<f64>,
    offset: isize,
    block: &mut Block<A::Scalar>,
    [first, last]: [usize; 2],
) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        // The second particle gets minus the row, so the weight in it is negative.
        const SIGN: [f64; 4] = [1.0, 1.0, 1.0, -1.0];
        let sign = I::Quad::load(SIGN.as_ptr());
        let base = sums.0.offset(4 * offset);
        let rows = block.rows.as_ptr().cast::<A::Scalar>();
        let (j, which) = (block.j.as_ptr(), block.which.as_ptr());
        let end = *block.begin.get_unchecked(last) as usize;
        let mut p = *block.begin.get_unchecked(first) as usize;
        // One loop over all, not one for each member: none of their ends is to be foreseen.
        while p < end {
            let row = A::load_quad(rows.add(4 * p));
            let at = base.add(4 * *j.add(p) as usize);
            I::Quad::load(at).sub(row).store(at);
            let own = block.banks.at(*which.add(p) as usize, p);
            I::Quad::load(own).add(row).store(own);
            p += 1;
        }
        let mut m = first;
        while m < last {
            let sum = block.banks.take::<I::Quad>(m - first);
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
