//! Which particles of the chunks are within reach.

use super::arithmetic::Record;
use super::block::{Block, GROUP};
use super::chunks::{FOUR, Group};
use super::layer::Swept;
use super::simd::{Isa, Scalar};

/// Compares the particles of a group with their chunks, and lists the pairs within reach: those of the first of
/// each four, then those of the second …
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
        block.reserve(16 * many);
        let q = [swept.q[0].as_ptr(), swept.q[1].as_ptr(), swept.q[2].as_ptr()];
        let points = block.points.as_mut_ptr();
        let fours = block.four_count;
        let mut t = 0;
        while t < fours {
            let from = first + block.fours.get_unchecked(t)[0] as usize;
            let mut k = 0;
            while k < FOUR {
                let to = points.add(2 * t + k / 2).cast::<u16>().add(16 * (k % 2));
                I::fill16(*q[0].add(from + k), to);
                I::fill16(*q[1].add(from + k), to.add(32));
                I::fill16(*q[2].add(from + k), to.add(64));
                k += 1;
            }
            t += 1;
        }
        let limit = swept.quantum.limit;
        let chunks = block.chunks.as_ptr();
        // Masks first, then what they select: the two in one loop wait for each other.
        let masks = block.masks.as_mut_ptr();
        let mut c = 0;
        while c < many {
            let chunk = &*chunks.add(c);
            let j = chunk.from as usize;
            let four = points.add(2 * (chunk.note as usize >> 8));
            let shift =
                if SHIFTS { *group.windows.shift.get_unchecked(chunk.note as usize & 0xff) } else { [0; 3] };
            let there = [q[0].add(j), q[1].add(j), q[2].add(j)];
            *masks.add(c) = I::near::<SHIFTS>(there, shift, [&*four, &*four.add(1)], limit) & chunk.allowed;
            c += 1;
        }
        let lists = [
            block.lists[0].as_mut_ptr(),
            block.lists[1].as_mut_ptr(),
            block.lists[2].as_mut_ptr(),
            block.lists[3].as_mut_ptr(),
        ];
        let mut found = [0; FOUR];
        let mut ends = [[0u32; FOUR]; GROUP];
        let mut c = 0;
        while c < many {
            let (chunk, mask) = (&*chunks.add(c), *masks.add(c));
            let ends = ends.get_unchecked_mut(chunk.note as usize >> 8);
            let mut k = 0;
            while k < FOUR {
                let mask = (mask >> (16 * k)) as u32 & 0xffff;
                I::collect(chunk.from, mask, lists[k].add(found[k]));
                found[k] += mask.count_ones() as usize;
                // Every four has a chunk; its last one leaves where the next begins.
                ends[k] = found[k] as u32;
                k += 1;
            }
            c += 1;
        }
        // Behind each other.
        let out = block.j.as_mut_ptr();
        let mut pairs = 0;
        let mut slot = 0;
        let begin = &mut block.begin;
        begin[0] = 0;
        // Members behind the last are read, and nothing else.
        block.members = [first as u32; GROUP];
        let mut k = 0;
        while k < FOUR {
            let mut p = 0;
            while p < found[k] {
                let sixteen = lists[k].add(p).cast::<[u32; 16]>().read_unaligned();
                out.add(pairs + p).cast::<[u32; 16]>().write_unaligned(sixteen);
                p += 16;
            }
            let mut t = 0;
            while t < fours {
                let [a, many] = *block.fours.get_unchecked(t);
                if k < many as usize {
                    *block.members.get_unchecked_mut(slot) = (first + a as usize + k) as u32;
                    slot += 1;
                    *begin.get_unchecked_mut(slot) = pairs as u32 + *ends.get_unchecked(t).get_unchecked(k);
                }
                t += 1;
            }
            pairs += found[k];
            k += 1;
        }
        // Lanes behind the last pair: some particle.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = first as u32;
            k += 1;
        }
    }
}
