//! Which particles of the j-clusters are within reach.

use crate::engine::sweep::ground::arithmetic::OFFSET_BITS;
use crate::engine::sweep::ground::arithmetic::PackedParticle;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::pair_batch::buffers::{PairBuffers, SLOT_BLOCK};
use crate::engine::sweep::pair_search::j_clusters::{I_PER_MASK, MASKS_PER_CLUSTER, SearchGroup};
use crate::engine::sweep::simd::{BroadcastPair, Isa, Scalar};

/// Compares the particles of a group with their j-clusters, and lists the pairs within reach, those of one particle after
/// those of another; particles are counted in vectors of `lanes`.
#[inline(always)]
pub unsafe fn filter_by_distance<I: Isa, T: Scalar, const SHIFTS: bool, const CLUSTER: usize>(
    data: &PassData<T, impl PackedParticle>,
    group: &SearchGroup,
    lanes: usize,
    buffers: &mut PairBuffers<T>,
) {
    // SAFETY: the contract of `simd`; arrays have sixteen particles' room behind their last.
    unsafe {
        let first = group.first;
        let size = buffers.j_cluster_count;
        buffers.reserve(16 * CLUSTER * size);
        let q = [data.fixed16[0].as_ptr(), data.fixed16[1].as_ptr(), data.fixed16[2].as_ptr()];
        let i_positions = buffers.i_positions.as_mut_ptr();
        let (masks, j_bases) = (buffers.masks.as_mut_ptr(), buffers.j_bases.as_mut_ptr());
        let fours = const { CLUSTER / I_PER_MASK };
        let i_clusters = buffers.i_cluster_count;
        let mut t = 0;
        while t < i_clusters {
            let i_cluster = buffers.i_clusters.get_unchecked(t);
            let from = first + i_cluster.first as usize;
            let mut slot_block = i_cluster.slot_blocks[0] as usize;
            while slot_block < i_cluster.slot_blocks[1] as usize {
                let mut k = 0;
                while k < CLUSTER {
                    let four = i_positions.add(fours * slot_block + k / I_PER_MASK).cast::<BroadcastPair>();
                    let to = four.add(k % I_PER_MASK / 2).cast::<u16>().add(16 * (k % 2));
                    I::broadcast16(*q[0].add(from + k), to);
                    I::broadcast16(*q[1].add(from + k), to.add(32));
                    I::broadcast16(*q[2].add(from + k), to.add(64));
                    k += 1;
                }
                // Slots without a j-cluster.
                let mut f = 0;
                while f < fours {
                    masks
                        .add(SLOT_BLOCK * (fours * slot_block + f))
                        .cast::<[u64; SLOT_BLOCK]>()
                        .write([0; SLOT_BLOCK]);
                    f += 1;
                }
                slot_block += 1;
            }
            t += 1;
        }
        let limit = data.fixed16_scale.limit;
        let (j_clusters, eligible) = (buffers.j_clusters.as_ptr(), buffers.eligible_high.as_ptr());
        // Masks first, then what they select: the two in one loop wait for each other.
        let mut c = 0;
        while c < size {
            let j_cluster = &*j_clusters.add(c);
            let j = j_cluster.from as usize;
            let slot = j_cluster.slot_and_shift as usize >> 8;
            let slot_block = fours * (slot / SLOT_BLOCK);
            let shift = if SHIFTS {
                *group.stencil.shift.get_unchecked(j_cluster.slot_and_shift as usize & 0xff)
            } else {
                [0; 3]
            };
            let j_positions = [q[0].add(j), q[1].add(j), q[2].add(j)];
            let mut distance_masks = [0; MASKS_PER_CLUSTER];
            let mut f = 0;
            while f < fours {
                distance_masks[f] =
                    I::distance_masks::<SHIFTS>(j_positions, shift, &*i_positions.add(slot_block + f), limit);
                f += 1;
            }
            let masks = masks.add(SLOT_BLOCK * slot_block + slot % SLOT_BLOCK);
            *masks = distance_masks[0] & j_cluster.eligible;
            if fours > 1 {
                *masks.add(SLOT_BLOCK) = distance_masks[1] & *eligible.add(c);
            }
            *j_bases.add(slot) = j_cluster.from << OFFSET_BITS;
            c += 1;
        }
        let (out, i_in_batch) = (buffers.j_offsets.as_mut_ptr(), buffers.i_in_batch.as_mut_ptr());
        let mut pairs = 0;
        let mut member = 0;
        buffers.first = first;
        buffers.begin[0] = 0;
        let mut t = 0;
        while t < i_clusters {
            let i_cluster = *buffers.i_clusters.get_unchecked(t);
            let [from, to] = i_cluster.slot_blocks.map(|e| e as usize);
            let mut slot_block = fours * from;
            while slot_block < fours * to {
                I::transpose_masks(masks.add(SLOT_BLOCK * slot_block));
                slot_block += 1;
            }
            let mut k = 0;
            while k < i_cluster.size as usize {
                let mut named = pairs;
                let mut slot_block = from;
                while slot_block < to {
                    let four = fours * slot_block + k / I_PER_MASK;
                    let (masks, j_bases) =
                        (masks.add(SLOT_BLOCK * four + k % I_PER_MASK), j_bases.add(SLOT_BLOCK * slot_block));
                    pairs += I::expand_mask(j_bases, *masks, out.add(pairs));
                    pairs += I::expand_mask(j_bases.add(4), *masks.add(4), out.add(pairs));
                    slot_block += 1;
                }
                // Thirty-two at once are mostly enough.
                loop {
                    I::broadcast16(0x101 * (member & (lanes - 1)) as u16, i_in_batch.add(named).cast());
                    named += 32;
                    if named >= pairs {
                        break;
                    }
                }
                member += 1;
                *buffers.begin.get_unchecked_mut(member) = pairs as u32;
                k += 1;
            }
            t += 1;
        }
        // Lanes behind the last pair: some particle.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = (first as u32) << OFFSET_BITS;
            k += 1;
        }
    }
}
