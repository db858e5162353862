//! Takes excluded pairs out of the list of an i-particle.

use crate::cells::excluded::Excluded;
use crate::simd::{Isa, OFFSET_BITS, Reals, Words};

/// Closes the gaps that excluded pairs of particle `i` leave among `offsets[from..to]`, and returns where the list ends then.
///
/// # Safety
/// The contract of `simd`. A vector from each pair on may be read and written; `i` and the j-particles exist.
#[inline(always)]
pub unsafe fn leave_out<I: Isa>(
    excluded: &Excluded,
    i: usize,
    offsets: *mut u32,
    [from, to]: [usize; 2],
) -> usize {
    type W<I> = <<I as Isa>::F32 as Reals>::Words;
    // SAFETY: what is written is not behind what has been read; marks are there for all particles and copies.
    unsafe {
        let mut end = to;
        let partners = excluded.partners_of(i);
        if !partners.is_empty() {
            end = from;
            let mut at = from;
            while at < to {
                let j = W::<I>::load(offsets.add(at));
                let mut keep = u32::MAX >> (32 - I::F32::LANES.min(to - at));
                for partner in partners {
                    keep &= !j.mask_equal(W::<I>::splat(*partner));
                }
                I::of_bits(j).compress(keep).store(offsets.add(end).cast());
                end += keep.count_ones() as usize;
                at += I::F32::LANES;
            }
        }
        if excluded.marks.is_empty() {
            return end;
        }
        let own = *excluded.marks.get_unchecked(i);
        let mut left = from;
        let mut at = from;
        while at < end {
            let j = *offsets.add(at);
            let other = *excluded.marks.get_unchecked((j >> OFFSET_BITS) as usize);
            *offsets.add(left) = j;
            left += !own.excludes(other, excluded.between_molecules) as usize;
            at += 1;
        }
        left
    }
}
