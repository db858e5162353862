//! Which particles of the chunks are within reach.

use super::arithmetic::Record;
use super::block::{Block, EIGHT, PLACE_BITS};
use super::chunks::{FOUR, Group};
use super::layer::Swept;
use super::simd::{Isa, Scalar};

/// Compares the particles of a group with their chunks, and lists the pairs within reach, those of one particle after
/// those of another.
#[inline(always)]
pub unsafe fn look<I: Isa, T: Scalar, const SHIFTS: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have sixteen particles' room behind their last.
    unsafe {
        let first = group.first;
        let many = block.chunk_count;
        block.reserve(16 * FOUR * many);
        let q = [swept.q[0].as_ptr(), swept.q[1].as_ptr(), swept.q[2].as_ptr()];
        let points = block.points.as_mut_ptr();
        let (masks, bases) = (block.masks.as_mut_ptr(), block.bases.as_mut_ptr());
        let fours = block.four_count;
        let mut t = 0;
        while t < fours {
            let four = block.fours.get_unchecked(t);
            let from = first + four.first as usize;
            let mut eight = four.eights[0] as usize;
            while eight < four.eights[1] as usize {
                let mut k = 0;
                while k < FOUR {
                    let to = (*points.add(eight)).as_mut_ptr().add(k / 2).cast::<u16>().add(16 * (k % 2));
                    I::fill16(*q[0].add(from + k), to);
                    I::fill16(*q[1].add(from + k), to.add(32));
                    I::fill16(*q[2].add(from + k), to.add(64));
                    k += 1;
                }
                // Slots without a chunk.
                masks.add(EIGHT * eight).cast::<[u64; EIGHT]>().write([0; EIGHT]);
                eight += 1;
            }
            t += 1;
        }
        let limit = swept.quantum.limit;
        let chunks = block.chunks.as_ptr();
        // Masks first, then what they select: the two in one loop wait for each other.
        let mut c = 0;
        while c < many {
            let chunk = &*chunks.add(c);
            let j = chunk.from as usize;
            let slot = chunk.note as usize >> 8;
            let four = &*points.add(slot / EIGHT);
            let shift =
                if SHIFTS { *group.windows.shift.get_unchecked(chunk.note as usize & 0xff) } else { [0; 3] };
            let there = [q[0].add(j), q[1].add(j), q[2].add(j)];
            *masks.add(slot) = I::near::<SHIFTS>(there, shift, four, limit) & chunk.allowed;
            *bases.add(slot) = chunk.from << PLACE_BITS;
            c += 1;
        }
        let out = block.j.as_mut_ptr();
        let mut pairs = 0;
        let mut member = 0;
        block.first = first;
        block.begin[0] = 0;
        let mut t = 0;
        while t < fours {
            let four = *block.fours.get_unchecked(t);
            let [from, to] = four.eights.map(|e| e as usize);
            let mut eight = from;
            while eight < to {
                I::turn(masks.add(EIGHT * eight));
                eight += 1;
            }
            let mut k = 0;
            while k < four.many as usize {
                let mut eight = from;
                while eight < to {
                    let (masks, bases) = (masks.add(EIGHT * eight + k), bases.add(EIGHT * eight));
                    pairs += I::collect(bases, *masks, out.add(pairs));
                    pairs += I::collect(bases.add(4), *masks.add(4), out.add(pairs));
                    eight += 1;
                }
                member += 1;
                *block.begin.get_unchecked_mut(member) = pairs as u32;
                k += 1;
            }
            t += 1;
        }
        // Lanes behind the last pair: some particle.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = (first as u32) << PLACE_BITS;
            k += 1;
        }
    }
}
