//! Removes excluded pairs from the list of an i-particle.

use crate::cells::excluded::Excluded;
use crate::simd::{Isa, OFFSET_BITS, Reals, Words};

/// Removes the excluded pairs of particle `i` from `offsets[from..to]`, and returns the new end of the list.
///
/// # Safety
/// The caller fulfils the contract of `simd`. A vector at each pair may be read and written; `i` and the j-particles exist.
#[inline(always)]
pub unsafe fn leave_out<I: Isa>(
    excluded: &Excluded,
    i: usize,
    offsets: *mut u32,
    [from, to]: [usize; 2],
) -> usize {
    type W<I> = <<I as Isa>::F32 as Reals>::Words;
    // SAFETY: each vector is written at or before the address that it was read from; sides and molecules have
    // entries for all particles and copies, and the look-up clamps padding lanes to the last entry.
    unsafe {
        let partners = excluded.partners_of(i);
        // A particle without a side or a molecule is excluded from no pair.
        let sides = excluded.sides.get(i).map_or(0, |sides| sides.rotate_left(16));
        let molecule = excluded.molecules.get(i).copied().unwrap_or(0);
        if partners.is_empty() & (sides == 0) & (molecule == 0) {
            return to;
        }
        let zero = W::<I>::splat(0);
        let mut end = from;
        let mut at = from;
        while at < to {
            let j = W::<I>::load(offsets.add(at));
            let mut keep = u32::MAX >> (32 - I::F32::LANES.min(to - at));
            for partner in partners {
                keep &= !j.mask_equal(W::<I>::splat(*partner));
            }
            if (sides != 0) | (molecule != 0) {
                let place = j.shift_right::<OFFSET_BITS>();
                if sides != 0 {
                    let last = W::<I>::splat(excluded.sides.len() as u32 - 1);
                    let others = W::<I>::lookup(excluded.sides.as_ptr(), place.min(last));
                    keep &= !others.mask_common(W::<I>::splat(sides));
                }
                if molecule != 0 {
                    let last = W::<I>::splat(excluded.molecules.len() as u32 - 1);
                    let others = W::<I>::lookup(excluded.molecules.as_ptr(), place.min(last));
                    let same = others.mask_equal(W::<I>::splat(molecule));
                    keep &= match excluded.between_molecules {
                        true => same | others.mask_equal(zero),
                        false => !same,
                    };
                }
            }
            I::of_bits(j).compress(keep).store(offsets.add(end).cast());
            end += keep.count_ones() as usize;
            at += I::F32::LANES;
        }
        end
    }
}
