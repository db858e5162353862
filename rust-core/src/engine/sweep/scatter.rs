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
        let rows = block.rows.as_ptr().cast::<A::Scalar>();
        let places = block.j.as_ptr().add(part.pairs[0]);
        // One loop over all, not one for each member, none of whose ends is to be foreseen: what a member gets is
        // the difference of two running sums.
        let mut running = Running::<I::Quad>::new(block.running.as_mut_ptr().cast());
        let count = part.count();
        let mut p = 0;
        while p < count {
            let row = A::load_quad(rows.add(4 * p));
            let at = base.byte_add(*places.add(p) as usize);
            I::Quad::load(at).sub(row).store(at);
            running.add(p, row);
            p += 1;
        }
        let begin = block.begin.as_ptr();
        let [first, last] = part.slots;
        let mut m = first;
        while m < last {
            let [a, b] = [m, m + 1].map(|m| *begin.add(m) as usize - part.pairs[0]);
            let sum = running.sum(a, b);
            add_to(base.add(4 * (part.first + m - first)), sum.mul(sign));
            m += 1;
        }
    }
}

/// Running sums over rows; those with an even and those with an odd number take turns, as one alone would wait for
/// itself.
pub struct Running<Q> {
    turn: [Q; 2],
    sums: *mut f64,
}

impl<Q: Quad> Running<Q> {
    /// Sums that go to `sums`: room for two more than there are rows.
    ///
    /// # Safety
    /// The contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(sums: *mut f64) -> Running<Q> {
        // SAFETY: the caller's.
        unsafe {
            Q::zero().store(sums);
            Q::zero().store(sums.add(4));
            Running { turn: [Q::zero(); 2], sums }
        }
    }

    /// Adds row `p`, of those from 0 on.
    ///
    /// # Safety
    /// The contract of `simd`.
    #[inline(always)]
    pub unsafe fn add(&mut self, p: usize, row: Q) {
        // SAFETY: the caller's.
        unsafe {
            let sum = self.turn[0].add(row);
            sum.store(self.sums.add(4 * (p + 2)));
            self.turn = [self.turn[1], sum];
        }
    }

    /// The sum of rows `a..b`.
    ///
    /// # Safety
    /// The contract of `simd`; these have been added.
    #[inline(always)]
    pub unsafe fn sum(&self, a: usize, b: usize) -> Q {
        // SAFETY: the caller's.
        unsafe {
            let two = |p: usize| Q::load(self.sums.add(4 * p)).add(Q::load(self.sums.add(4 * p + 4)));
            two(b).sub(two(a))
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
