//! Which particles of the chunks are within reach.

use super::arithmetic::Record;
use super::block::Block;
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar};

/// Compares particles with their chunks, and appends the pairs within reach.
#[inline(always)]
pub unsafe fn look<I: Isa, T: Scalar, const GHOSTS: bool, const SHIFTS: bool>(
    swept: &Swept<T, impl Record>,
    shifts: &[[f32; 16]; 3],
    limit: I::F32,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have a vector's room behind their last particle.
    unsafe {
        let lanes = I::F32::LANES;
        block.reserve(block.count + lanes * block.chunk_count);
        block.begin.resize(block.members.len() + 1, 0);
        let out = block.j.as_mut_ptr();
        let begin = block.begin.as_mut_ptr();
        let place = [block.place[0].as_ptr(), block.place[1].as_ptr(), block.place[2].as_ptr()];
        let x = [swept.x[0].as_ptr(), swept.x[1].as_ptr(), swept.x[2].as_ptr()];
        let chunks = block.chunks.as_ptr();
        // Masks first, then what they select: the two in one loop wait for each other.
        let masks = block.masks.as_mut_ptr();
        let many = block.chunk_count;
        let mut c = 0;
        while c < many {
            let chunk = chunks.add(c);
            let j = (*chunk).from as usize;
            let member = (*chunk).member as usize;
            let mut p = [*place[0].add(member), *place[1].add(member), *place[2].add(member)];
            if SHIFTS {
                let shift = (*chunk).shift as usize;
                p[0] -= *shifts[0].get_unchecked(shift);
                p[1] -= *shifts[1].get_unchecked(shift);
                p[2] -= *shifts[2].get_unchecked(shift);
            }
            let dx = I::F32::splat(p[0]) - I::F32::load(x[0].add(j));
            let dy = I::F32::splat(p[1]) - I::F32::load(x[1].add(j));
            let dz = I::F32::splat(p[2]) - I::F32::load(x[2].add(j));
            let mut r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
            if GHOSTS {
                // Two ghosts are no concern of this rank.
                let i = *block.members.get_unchecked(member) as usize;
                let far = I::F32::splat(*swept.ghost.get_unchecked(i) * 1e15);
                r2 = far.mul_add(I::F32::load(swept.ghost.as_ptr().add(j)), r2);
            }
            let left = ((*chunk).to - (*chunk).from).min(lanes as u32);
            *masks.add(c) = r2.mask_below(limit) & ((1u32 << left) - 1);
            c += 1;
        }
        let mut count = block.count;
        let mut c = 0;
        while c < many {
            let (chunk, mask) = (chunks.add(c), *masks.add(c));
            I::collect((*chunk).from, mask, out.add(count));
            count += mask.count_ones() as usize;
            // Every member has a chunk; its last one leaves where the next begins.
            *begin.add((*chunk).member as usize + 1) = count as u32;
            c += 1;
        }
        block.count = count;
    }
}
