//! Which particles of the chunks are within reach.

use super::arithmetic::Record;
use super::block::{Block, GROUP};
use super::chunks::Group;
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar};

/// Compares the particles of a group with their chunks, and lists the pairs within reach: those of the
/// first of each two particles, then those of the second.
#[inline(always)]
pub unsafe fn look<I: Isa, T: Scalar, const SHIFTS: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have sixteen particles' room behind their last.
    unsafe {
        let (first, count) = (group.first, group.count);
        let many = block.chunk_count;
        block.reserve(16 * many);
        let q = [swept.q[0].as_ptr(), swept.q[1].as_ptr(), swept.q[2].as_ptr()];
        let points = block.points.as_mut_ptr();
        let twos = block.two_count;
        let mut t = 0;
        while t < twos {
            let [a, b] = *block.twos.get_unchecked(t);
            let to = points.add(t).cast::<u16>();
            let mut c = 0;
            while c < 3 {
                I::fill16(*q[c].add(first + a as usize), to.add(32 * c));
                I::fill16(*q[c].add(first + b as usize), to.add(32 * c + 16));
                c += 1;
            }
            t += 1;
        }
        let limit = swept.quantum.limit;
        let chunks = block.chunks.as_ptr();
        // Masks first, then what they select: the two in one loop wait for each other.
        let masks = block.masks.as_mut_ptr();
        let mut c = 0;
        while c < many {
            let chunk = chunks.add(c);
            let j = (*chunk).from as usize;
            let two = points.add((*chunk).note as usize >> 8);
            let shift = if SHIFTS {
                *group.windows.shift.get_unchecked((*chunk).note as usize & 0xff)
            } else {
                [0; 3]
            };
            let there = [q[0].add(j), q[1].add(j), q[2].add(j)];
            *masks.add(c) = I::near::<SHIFTS>(there, shift, &*two, limit) & (*chunk).allowed;
            c += 1;
        }
        let (out, other) = (block.j.as_mut_ptr(), block.other.as_mut_ptr());
        let mut found = [0, 0];
        let mut ends = [[0u32; GROUP]; 2];
        let mut c = 0;
        while c < many {
            let (chunk, mask) = (chunks.add(c), *masks.add(c));
            let (from, two) = ((*chunk).from, (*chunk).note as usize >> 8);
            I::collect(from, mask & 0xffff, out.add(found[0]));
            I::collect(from, mask >> 16, other.add(found[1]));
            found[0] += (mask & 0xffff).count_ones() as usize;
            found[1] += (mask >> 16).count_ones() as usize;
            // Every two have a chunk; their last one leaves where the next begin.
            *ends[0].get_unchecked_mut(two) = found[0] as u32;
            *ends[1].get_unchecked_mut(two) = found[1] as u32;
            c += 1;
        }
        // Behind each other.
        let mut k = 0;
        while k < found[1] {
            <I::F32 as Reals>::load(other.add(k).cast()).store(out.add(found[0] + k).cast());
            k += <I::F32 as Reals>::LANES;
        }
        let pairs = found[0] + found[1];
        // Lanes behind the last pair: some particle.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = first as u32;
            k += 1;
        }
        block.count = pairs;
        block.members_count = count;
        // Members behind the last are read, and nothing else.
        block.members = [first as u32; GROUP];
        let begin = &mut block.begin;
        begin[0] = 0;
        let mut slot = 0;
        let mut t = 0;
        while t < twos {
            let [a, _] = *block.twos.get_unchecked(t);
            *block.members.get_unchecked_mut(slot) = (first + a as usize) as u32;
            slot += 1;
            *begin.get_unchecked_mut(slot) = *ends[0].get_unchecked(t);
            t += 1;
        }
        let mut t = 0;
        while t < twos {
            let [a, b] = *block.twos.get_unchecked(t);
            // One that looks alone has found nothing as the second.
            if a != b {
                *block.members.get_unchecked_mut(slot) = (first + b as usize) as u32;
                slot += 1;
                *begin.get_unchecked_mut(slot) = found[0] as u32 + *ends[1].get_unchecked(t);
            }
            t += 1;
        }
    }
}
