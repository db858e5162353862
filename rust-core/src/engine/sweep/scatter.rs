//! What pairs do, added to the accumulators of their particles.

use super::arithmetic::{Arithmetic, Record};
use super::block::Block;
use super::evaluate::add_to;
use super::layer::{Shared, Swept};
use super::simd::{Isa, Quad, Scalar};

/// Adds the rows of a block to both particles of each pair.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(sums: Shared<f64>, offset: isize, block: &Block<A::Scalar>) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        // The second particle gets minus the row, so the weight in it is negative.
        const SIGN: [f64; 4] = [1.0, 1.0, 1.0, -1.0];
        let sign = I::Quad::load(SIGN.as_ptr());
        let base = sums.0.offset(4 * offset);
        let (begin, members) = (block.begin.as_ptr(), block.members.as_ptr());
        let (rows, j) = (block.rows.as_ptr(), block.j.as_ptr());
        let mut p = 0;
        let mut m = 0;
        while m < block.members.len() {
            let to = *begin.add(m + 1) as usize;
            let mut sum = I::Quad::zero();
            while p < to {
                let row = A::load_quad(rows.add(4 * p));
                let at = base.add(4 * *j.add(p) as usize);
                sum = sum.add(row);
                I::Quad::load(at).sub(row).store(at);
                p += 1;
            }
            add_to(base.add(4 * *members.add(m) as usize), sum.mul(sign));
            m += 1;
        }
    }
}

/// Adds weights where there are several densities or species.
#[inline(always)]
pub unsafe fn scatter_weights<T: Scalar>(swept: &Swept<T, impl Record>, offset: isize, block: &Block<T>) {
    // SAFETY: as `scatter`.
    unsafe {
        let species = swept.terms.species;
        let width = swept.variables;
        let base = swept.densities.0.offset(width as isize * offset);
        let passes = swept.terms.passes.len();
        let mut p = 0;
        while p < block.count {
            let (mut si, mut sj) = (0, 0);
            if species > 1 {
                si = *block.species_i.get_unchecked(p) as usize;
                sj = *block.species_j.get_unchecked(p) as usize;
            }
            let at_i = base.add(width * *block.i.get_unchecked(p) as usize + sj);
            let at_j = base.add(width * *block.j.get_unchecked(p) as usize + si);
            let mut d = 0;
            while d < passes {
                let w = block.weight.get_unchecked(d).get_unchecked(p).wide();
                *at_i.add(d * species) += w;
                *at_j.add(d * species) += w;
                d += 1;
            }
            p += 1;
        }
    }
}
