//! Keeps the candidates within the search cutoff, and lists them as pairs.
//!
//! Distances are compared in 16-bit fixed point, sixteen candidates with four i-particles at once. The
//! limit includes the largest rounding error, so that the filter passes too many pairs and never too
//! few: the terms vanish beyond their range.

use super::buffers::SearchBuffers;
use super::cell_ranges::{HALF, SearchGroup};
use super::clusters::{I_PER_MASK, MASKS_PER_CLUSTER, SLOT_BLOCK};
use super::leave_out::leave_out;
use crate::cells::sorted::SortedCells;
use crate::simd::{BroadcastPair, Isa, OFFSET_BITS, Reals};

/// Lists the pairs of a search group, one i-particle after the other; a batch has
/// `batch_size` i-particles, a power of two.
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain the clusters of the group,
/// formed with the same `CLUSTER`.
#[inline(always)]
pub unsafe fn filter_by_distance<I: Isa, const SHIFTS: bool, const CLUSTER: usize, const COLUMNS: usize>(
    cells: &SortedCells,
    group: &SearchGroup<COLUMNS>,
    batch_size: usize,
    buffers: &mut SearchBuffers,
) {
    // SAFETY: `SortedParticles::make_room` pads positions by four vectors after the last particle, so
    // that all sixteen of a j-cluster can be read; `reserve_j_clusters` makes masks, bases and
    // positions of i-clusters for all slots, and `reserve_pairs` makes room for every bit of the masks.
    unsafe {
        let first = group.first;
        let j_cluster_count = buffers.j_cluster_count;
        buffers.reserve_pairs(16 * CLUSTER * j_cluster_count);
        let q = [cells.fixed16[0].as_ptr(), cells.fixed16[1].as_ptr(), cells.fixed16[2].as_ptr()];
        let i_positions = buffers.i_positions.as_mut_ptr();
        let (masks, j_bases) = (buffers.masks.as_mut_ptr(), buffers.j_bases.as_mut_ptr());
        let masks_each = const { CLUSTER / I_PER_MASK };
        let i_clusters = buffers.i_cluster_count;
        // Positions of the i-particles are repeated for sixteen candidates; slots without a j-cluster get empty masks.
        let mut t = 0;
        while t < i_clusters {
            let cluster = buffers.i_clusters.get_unchecked(t);
            let from = first + cluster.first as usize;
            let mut block = cluster.slot_blocks[0] as usize;
            while block < cluster.slot_blocks[1] as usize {
                let mut k = 0;
                while k < CLUSTER {
                    let four = i_positions.add(masks_each * block + k / I_PER_MASK).cast::<BroadcastPair>();
                    let to = four.add(k % I_PER_MASK / 2).cast::<u16>().add(16 * (k % 2));
                    I::broadcast16(*q[0].add(from + k), to);
                    I::broadcast16(*q[1].add(from + k), to.add(32));
                    I::broadcast16(*q[2].add(from + k), to.add(64));
                    k += 1;
                }
                let mut f = 0;
                while f < masks_each {
                    let to = masks.add(SLOT_BLOCK * (masks_each * block + f));
                    to.cast::<[u64; SLOT_BLOCK]>().write([0; SLOT_BLOCK]);
                    f += 1;
                }
                block += 1;
            }
            t += 1;
        }
        // One loop computes all masks, another lists the pairs: in one loop the two would wait for each other.
        let limit = cells.fixed16_scale.limit;
        let (j_clusters, high) = (buffers.j_clusters.as_ptr(), buffers.high_candidates.as_ptr());
        let mut c = 0;
        while c < j_cluster_count {
            let cluster = &*j_clusters.add(c);
            let j = cluster.first as usize;
            let slot = cluster.slot_and_shift as usize >> 8;
            let block = masks_each * (slot / SLOT_BLOCK);
            let shift = if SHIFTS {
                *group.stencil.shift.as_flattened().get_unchecked(cluster.slot_and_shift as usize & 0xff)
            } else {
                [0; 3]
            };
            let j_positions = [q[0].add(j), q[1].add(j), q[2].add(j)];
            let mut near = [0; MASKS_PER_CLUSTER];
            let mut f = 0;
            while f < masks_each {
                near[f] =
                    I::distance_masks::<SHIFTS>(j_positions, shift, &*i_positions.add(block + f), limit);
                f += 1;
            }
            let masks = masks.add(SLOT_BLOCK * block + slot % SLOT_BLOCK);
            *masks = near[0] & cluster.candidates;
            if masks_each > 1 {
                *masks.add(SLOT_BLOCK) = near[1] & *high.add(c);
            }
            *j_bases.add(slot) = cluster.first << OFFSET_BITS;
            c += 1;
        }
        // At a rim many half blocks have no ghost within reach. Wide vectors expand a mask faster than they would
        // recover from a wrong guess of a branch.
        let expands_all = COLUMNS == HALF || I::F32::LANES > 8;
        let (out, i_in_batch) = (buffers.j_offsets.as_mut_ptr(), buffers.i_in_batch.as_mut_ptr());
        let mut pairs = 0;
        let mut member = 0;
        buffers.first = first;
        buffers.begin[0] = 0;
        let mut t = 0;
        while t < i_clusters {
            let cluster = *buffers.i_clusters.get_unchecked(t);
            let [from, to] = cluster.slot_blocks.map(|block| block as usize);
            let end_half = cluster.end_half as usize;
            let mut block = masks_each * from;
            while block < masks_each * to {
                I::transpose_masks(masks.add(SLOT_BLOCK * block));
                block += 1;
            }
            let mut k = 0;
            while k < cluster.size as usize {
                let mut labelled = pairs;
                let mut block = from;
                while block < to {
                    let four = masks_each * block + k / I_PER_MASK;
                    let masks = masks.add(SLOT_BLOCK * four + k % I_PER_MASK);
                    let j_bases = j_bases.add(SLOT_BLOCK * block);
                    if expands_all || *masks != 0 {
                        pairs += I::expand_mask(j_bases, *masks, out.add(pairs));
                    }
                    if 2 * block + 1 < end_half && (expands_all || *masks.add(4) != 0) {
                        pairs += I::expand_mask(j_bases.add(4), *masks.add(4), out.add(pairs));
                    }
                    block += 1;
                }
                if !cells.excluded.is_empty() {
                    pairs = leave_out::<I>(&cells.excluded, first + member, out, [labelled, pairs]);
                }
                // A step expands thirty-two bits, which is enough for most particles.
                loop {
                    let label = 0x101 * (member & (batch_size - 1)) as u16;
                    I::broadcast16(label, i_in_batch.add(labelled).cast());
                    labelled += 32;
                    if labelled >= pairs {
                        break;
                    }
                }
                member += 1;
                *buffers.begin.get_unchecked_mut(member) = pairs as u32;
                k += 1;
            }
            t += 1;
        }
        // Padding lanes refer to a particle that exists.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = (first as u32) << OFFSET_BITS;
            k += 1;
        }
    }
}
