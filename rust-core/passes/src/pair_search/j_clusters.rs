//! Divides the cell ranges of i-clusters into j-clusters of sixteen candidates, with a bit for each possible pair.

use super::buffers::SearchBuffers;
use super::cell_ranges::{CellIndices, CellRanges, HALF, SearchGroup, StencilColumns};
use super::clusters::{I_PER_MASK, ICluster, JCluster, MASKS_PER_CLUSTER, SLOT_BLOCK};
use crate::cells::sorted::SortedCells;
use crate::simd::{Isa, Reals};

/// Forms the i-clusters and j-clusters of a search group. Up to `CLUSTER` consecutive particles form an i-cluster.
///
/// # Safety
/// The caller fulfils the contract of `simd`. `ranges` are those of the group, found with the same `CLUSTER`.
#[inline(always)]
pub unsafe fn form_j_clusters<I: Isa, const CLUSTER: usize, const COLUMNS: usize>(
    cells: &SortedCells,
    group: &SearchGroup<COLUMNS>,
    ranges: &mut CellRanges<COLUMNS>,
    buffers: &mut SearchBuffers,
) {
    // SAFETY: `ranges_of_vector` clamps cells to the column, or one past its last, for which `start`
    // has entries; a group has no more than `SEARCH_GROUP` i-clusters.
    unsafe {
        let SearchGroup { plane, stencil, count, flags, .. } = *group;
        // Among the owned particles each pair is found once.
        let once = COLUMNS == HALF;
        let mut found = 0;
        let mut clusters = 0;
        let mut slot_blocks = 0;
        let mut a = 0;
        while a < count {
            let mut size = CLUSTER.min(count - a);
            if flags.together >> (a / I::F32::LANES) & 1 == 0 {
                // Ranges in other vectors may be merged already: the cluster ends with this vector.
                size = size.min(I::F32::LANES - a % I::F32::LANES);
                let x = std::slice::from_raw_parts(cells.x[0].at(group.first + a), size);
                size = merge_ranges(x, plane.i_cluster_extent, ranges, a);
            }
            let begin = found;
            let masks = ClusterMasks {
                slots: (SLOT_BLOCK * slot_blocks).wrapping_sub(found),
                members: *MEMBERS.get_unchecked(size),
            };
            let mut w = 0;
            if once {
                // In its own column a particle pairs with the particles after it.
                let start = *stencil.start.get_unchecked(0);
                let range = [(group.first + a + 1) as u32, *start.add(cell_of(&ranges.end, 0, a))];
                let shift = StencilColumns::<COLUMNS>::shift_index(0, 1);
                found = append_range::<CLUSTER, true, false>(buffers, found, range, shift, &masks);
                w = 1;
            }
            while w < COLUMNS {
                let start = *stencil.start.get_unchecked(w);
                let range = [*start.add(cell_of(&ranges.low, w, a)), *start.add(cell_of(&ranges.end, w, a))];
                let shift = StencilColumns::<COLUMNS>::shift_index(w, 1);
                found = if once {
                    append_range::<CLUSTER, false, false>(buffers, found, range, shift, &masks)
                } else {
                    append_range::<CLUSTER, false, true>(buffers, found, range, shift, &masks)
                };
                w += 1;
            }
            // The bits mark ranges that continue in the previous, and in the next, period.
            let bits = (1u32 << size) - 1;
            if flags.before >> a & bits != 0 {
                let mut w = once as usize;
                while w < COLUMNS {
                    let start = *stencil.start.get_unchecked(w);
                    let end = *start.add(plane.cells_per_column as usize);
                    let range = [*start.add(cell_of(&ranges.before, w, a)), end];
                    let shift = StencilColumns::<COLUMNS>::shift_index(w, 0);
                    found = append_range::<CLUSTER, false, false>(buffers, found, range, shift, &masks);
                    w += 1;
                }
            }
            if flags.after >> a & bits != 0 {
                let mut w = 0;
                while w < COLUMNS {
                    let start = *stencil.start.get_unchecked(w);
                    let range = [*start, *start.add(cell_of(&ranges.after, w, a))];
                    let shift = StencilColumns::<COLUMNS>::shift_index(w, 2);
                    found = append_range::<CLUSTER, false, false>(buffers, found, range, shift, &masks);
                    w += 1;
                }
            }
            // Among the owned particles every i-cluster has at least one j-cluster.
            let next = slot_blocks + (found - begin).div_ceil(SLOT_BLOCK);
            *buffers.i_clusters.get_unchecked_mut(clusters) = ICluster {
                first: a as u8,
                size: size as u8,
                slot_blocks: [slot_blocks as u32, next as u32],
                end_half: (2 * slot_blocks + (found - begin).div_ceil(SLOT_BLOCK / 2)) as u32,
            };
            slot_blocks = next;
            clusters += 1;
            a += size;
        }
        buffers.i_cluster_count = clusters;
        buffers.j_cluster_count = found;
    }
}

/// The cell of i-particle `a` in stencil column `w`.
///
/// # Safety
/// The stencil has column `w`, and `a` below the size of a search group.
#[inline(always)]
unsafe fn cell_of<const COLUMNS: usize>(indices: &CellIndices<COLUMNS>, w: usize, a: usize) -> usize {
    // SAFETY: the caller promises indices below the sizes of these arrays.
    unsafe { *indices.get_unchecked(w).get_unchecked(a) as usize }
}

/// Shortens an i-cluster to the particles at `x` within `extent` of the first one, `a`, and merges
/// their cell ranges into that of `a`. Returns the number of these particles.
#[cold]
#[inline(never)]
fn merge_ranges<const COLUMNS: usize>(
    x: &[f32],
    extent: f32,
    ranges: &mut CellRanges<COLUMNS>,
    a: usize,
) -> usize {
    let size = x.iter().take_while(|other| (**other - x[0]).abs() <= extent).count().max(1);
    let all = a..a + size;
    for w in 0..COLUMNS {
        for lowest in [&mut ranges.low[w], &mut ranges.before[w]] {
            lowest[a] = lowest[all.clone()].iter().copied().fold(lowest[a], i32::min);
        }
        for highest in [&mut ranges.end[w], &mut ranges.after[w]] {
            highest[a] = highest[all.clone()].iter().copied().fold(highest[a], i32::max);
        }
    }
    size
}

/// What all j-clusters of an i-cluster share.
struct ClusterMasks {
    /// Difference between the slot and the number of a j-cluster; the sum wraps.
    slots: usize,
    /// Sixteen set bits for each member of the i-cluster.
    members: [u64; MASKS_PER_CLUSTER],
}

/// `ClusterMasks::members` for each size of an i-cluster.
static MEMBERS: [[u64; MASKS_PER_CLUSTER]; MASKS_PER_CLUSTER * I_PER_MASK + 1] = members();

const fn members() -> [[u64; MASKS_PER_CLUSTER]; MASKS_PER_CLUSTER * I_PER_MASK + 1] {
    let mut table = [[0; MASKS_PER_CLUSTER]; MASKS_PER_CLUSTER * I_PER_MASK + 1];
    let mut size = 1;
    while size <= MASKS_PER_CLUSTER * I_PER_MASK {
        let bits = u128::MAX >> (128 - 16 * size);
        table[size] = [bits as u64, (bits >> 64) as u64];
        size += 1;
    }
    table
}

/// Candidate bits of the first `n` of thirty-two particles, for each of four members: in the
/// first j-cluster, and in the second.
static FIRST_BITS: [[u64; 2]; 33] = first_bits();

const ONE_SLOT: u32 = 1 << 8;

/// The lowest bit of each member.
const EACH: u64 = 0x0001_0001_0001_0001;

/// In the j-cluster that begins after the first member, the bits of particles after each member: every pair is found once.
const LATER: [u64; MASKS_PER_CLUSTER] = [0xfff8_fffc_fffe_ffff, 0xff80_ffc0_ffe0_fff0];

const fn first_bits() -> [[u64; 2]; 33] {
    let mut table = [[0; 2]; 33];
    let mut length = 0;
    while length <= 32 {
        let bits = (1u64 << length) - 1;
        table[length] = [(bits & 0xffff) * EACH, (bits >> 16) * EACH];
        length += 1;
    }
    table
}

/// Appends the j-clusters of the particles `first..end`, and at least one in the own column; returns the new
/// number of j-clusters. `shift` is the index of the periodic shift. With `OFTEN_EMPTY` an empty range is passed over.
///
/// # Safety
/// Particles up to `end + 16` are inside the padding of `SortedParticles::make_room`.
#[inline(always)]
unsafe fn append_range<const CLUSTER: usize, const OWN_COLUMN: bool, const OFTEN_EMPTY: bool>(
    buffers: &mut SearchBuffers,
    found: usize,
    [first, end]: [u32; 2],
    shift: usize,
    masks: &ClusterMasks,
) -> usize {
    // SAFETY: the buffers always have room for two more j-clusters at each range of a group
    // (`USUAL_J_CLUSTERS`); `append_long_range` makes room for more than two.
    unsafe {
        if OFTEN_EMPTY && first >= end {
            return found;
        }
        let length = end.saturating_sub(first) as usize;
        let slot_and_shift = (masks.slots.wrapping_add(found) << 8 | shift) as u32;
        let members = if OWN_COLUMN { and(masks.members, LATER) } else { masks.members };
        if length > 32 {
            return append_long_range(buffers, found, [first, end], members, masks, slot_and_shift);
        }
        // Two j-clusters are written and those in use counted, so that there is no branch to predict.
        let bits = FIRST_BITS.get_unchecked(length).map(|bits| [bits; MASKS_PER_CLUSTER]);
        let [one, two] = [and(bits[0], members), and(bits[1], masks.members)];
        let out = buffers.j_clusters.as_mut_ptr().add(found);
        *out = JCluster { candidates: one[0], first, slot_and_shift };
        *out.add(1) =
            JCluster { candidates: two[0], first: first + 16, slot_and_shift: slot_and_shift + ONE_SLOT };
        if CLUSTER > I_PER_MASK {
            let high = buffers.high_candidates.as_mut_ptr().add(found);
            high.cast::<[u64; 2]>().write_unaligned([one[1], two[1]]);
        }
        found + (OWN_COLUMN || length > 0) as usize + (length > 16) as usize
    }
}

#[inline(always)]
fn and(a: [u64; MASKS_PER_CLUSTER], b: [u64; MASKS_PER_CLUSTER]) -> [u64; MASKS_PER_CLUSTER] {
    std::array::from_fn(|f| a[f] & b[f])
}

/// Appends more than two j-clusters; `members` are the masks for the first one.
#[cold]
#[inline(never)]
fn append_long_range(
    buffers: &mut SearchBuffers,
    mut found: usize,
    [first, end]: [u32; 2],
    members: [u64; MASKS_PER_CLUSTER],
    masks: &ClusterMasks,
    mut slot_and_shift: u32,
) -> usize {
    buffers.reserve_j_clusters(found + (end - first).div_ceil(16) as usize);
    for begin in (first..end).step_by(16) {
        let bits = [FIRST_BITS[(end - begin).min(16) as usize][0]; MASKS_PER_CLUSTER];
        let candidates = and(bits, if begin == first { members } else { masks.members });
        buffers.j_clusters[found] = JCluster { candidates: candidates[0], first: begin, slot_and_shift };
        buffers.high_candidates[found] = candidates[1];
        slot_and_shift += ONE_SLOT;
        found += 1;
    }
    found
}
