//! Spans of cells as j-clusters of sixteen particles, each to be compared with an i-cluster of up to four, or eight.

use crate::engine::sweep::ground::arithmetic::PackedParticle;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::pair_batch::buffers::{PairBuffers, SLOT_BLOCK};
use crate::engine::sweep::pair_search::cell_ranges::{
    CellIndices, CellRanges, PlaneSearch, RangeFlags, StencilColumns,
};
use crate::engine::sweep::simd::{Isa, Reals, Scalar};

/// Particles that are compared at once.
pub const I_PER_MASK: usize = 4;

/// Fours of the largest i-cluster.
pub const MASKS_PER_CLUSTER: usize = 2;

/// Sixteen particles that an i-cluster is to be compared with.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct JCluster {
    /// Which of them: sixteen bits for the first of the first four of the i-cluster, then for the second …
    pub eligible: u64,
    pub from: u32,
    /// The slot of its masks, and the shift that the i-cluster sees these with, in the lowest eight bits.
    pub slot_and_shift: u32,
}

/// Particles of a group that look together.
#[derive(Debug, Clone, Copy, Default)]
pub struct ICluster {
    /// The first in the group, and how many.
    pub first: u8,
    pub size: u8,
    /// Their slots, of eight each: from, and to before.
    pub slot_blocks: [u32; 2],
}

/// A group of particles of one column, whose cell ranges are to be cut.
pub struct SearchGroup<'a> {
    pub plane_search: &'a PlaneSearch,
    pub stencil: &'a StencilColumns,
    pub flags: RangeFlags,
    /// The first, and how many.
    pub first: usize,
    pub count: usize,
}

/// Cuts the cell ranges of a group into j-clusters. Up to `CLUSTER` particles that follow each other closely look together.
#[inline(always)]
pub unsafe fn form_j_clusters<I: Isa, T: Scalar, const GHOSTS: bool, const CLUSTER: usize>(
    data: &PassData<T, impl PackedParticle>,
    group: &SearchGroup,
    ranges: &mut CellRanges,
    buffers: &mut PairBuffers<T>,
) {
    // SAFETY: the arrays are as `PassData` says, j-clusters have room.
    unsafe {
        let SearchGroup { plane_search, stencil, count, flags, .. } = *group;
        let mut found = 0;
        let mut i_clusters = 0;
        let mut slot_blocks = 0;
        let mut a = 0;
        while a < count {
            let mut size = CLUSTER.min(count - a);
            if flags.together >> (a / I::F32::LANES) & 1 == 0 {
                // Vectors have cell ranges of one or of the other kind.
                size = size.min(I::F32::LANES - a % I::F32::LANES);
                let x = std::slice::from_raw_parts(data.x[0].at(group.first + a), size);
                size = merge_ranges(x, plane_search.i_cluster_extent, ranges, a);
            }
            let begin = found;
            let masks = ClusterMasks {
                slots: (SLOT_BLOCK * slot_blocks).wrapping_sub(found),
                members: *MEMBERS.get_unchecked(size),
                ghosts: match GHOSTS {
                    // There is room for a vector behind the last.
                    true => ghosts(data.ghost.as_ptr().add(group.first + a).cast::<u64>().read_unaligned()),
                    false => [0; MASKS_PER_CLUSTER],
                },
            };
            // In their own column they look at those behind them.
            let column = *stencil.column.get_unchecked(0);
            let range = [(group.first + a + 1) as u32, *column.add(cell_of(&ranges.end, 0, a))];
            found = append_range::<T, GHOSTS, CLUSTER, true>(data, group, buffers, found, range, 5, &masks);
            let mut w = 1;
            while w < 5 {
                let column = *stencil.column.get_unchecked(w);
                let range =
                    [*column.add(cell_of(&ranges.low, w, a)), *column.add(cell_of(&ranges.end, w, a))];
                found = append_range::<T, GHOSTS, CLUSTER, false>(
                    data,
                    group,
                    buffers,
                    found,
                    range,
                    w + 5,
                    &masks,
                );
                w += 1;
            }
            // Columns that go on in the period before, and in the next.
            let bits = (1u32 << size) - 1;
            if flags.before >> a & bits != 0 {
                let mut w = 1;
                while w < 5 {
                    let column = *stencil.column.get_unchecked(w);
                    let range = [
                        *column.add(cell_of(&ranges.before, w, a)),
                        *column.add(plane_search.cells_per_column as usize),
                    ];
                    found = append_range::<T, GHOSTS, CLUSTER, false>(
                        data, group, buffers, found, range, w, &masks,
                    );
                    w += 1;
                }
            }
            if flags.after >> a & bits != 0 {
                let mut w = 0;
                while w < 5 {
                    let column = *stencil.column.get_unchecked(w);
                    let range = [*column, *column.add(cell_of(&ranges.after, w, a))];
                    found = append_range::<T, GHOSTS, CLUSTER, false>(
                        data,
                        group,
                        buffers,
                        found,
                        range,
                        w + 10,
                        &masks,
                    );
                    w += 1;
                }
            }
            // There is one at least.
            let next = slot_blocks + (found - begin).div_ceil(SLOT_BLOCK);
            *buffers.i_clusters.get_unchecked_mut(i_clusters) =
                ICluster { first: a as u8, size: size as u8, slot_blocks: [slot_blocks as u32, next as u32] };
            slot_blocks = next;
            i_clusters += 1;
            a += size;
        }
        buffers.i_cluster_count = i_clusters;
        buffers.j_cluster_count = found;
    }
}

#[inline(always)]
unsafe fn cell_of(cells_per_column: &CellIndices, w: usize, a: usize) -> usize {
    // SAFETY: of a group.
    unsafe { *cells_per_column.get_unchecked(w).get_unchecked(a) as usize }
}

/// Makes the cell ranges of particle `a` of a group those of all particles that look together with it: of those at `x` the
/// first ones that are near enough to the first. Returns how many.
#[cold]
#[inline(never)]
fn merge_ranges(x: &[f32], i_cluster_extent: f32, ranges: &mut CellRanges, a: usize) -> usize {
    let size = x.iter().take_while(|other| (**other - x[0]).abs() <= i_cluster_extent).count().max(1);
    let all = a..a + size;
    for w in 0..5 {
        for lowest in [&mut ranges.low[w], &mut ranges.before[w]] {
            lowest[a] = lowest[all.clone()].iter().copied().fold(lowest[a], i32::min);
        }
        for highest in [&mut ranges.end[w], &mut ranges.after[w]] {
            highest[a] = highest[all.clone()].iter().copied().fold(highest[a], i32::max);
        }
    }
    size
}

/// Who looks.
struct ClusterMasks {
    /// Added to the number of a j-cluster this is its slot; it wraps.
    slots: usize,
    /// Sixteen bits for each that is there, four by four.
    members: [u64; MASKS_PER_CLUSTER],
    /// The same for each that is a ghost.
    ghosts: [u64; MASKS_PER_CLUSTER],
}

/// Sixteen bits for each of the first particles of an i-cluster, four by four.
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

/// The bits of the first of thirty-two particles, for each of four that look: those of the first j-cluster, and of the
/// second.
static FIRST_BITS: [[u64; 2]; 33] = first_bits();

/// In notes.
const ONE_SLOT: u32 = 1 << 8;

/// Sixteen bits for each of four.
const EACH: u64 = 0x0001_0001_0001_0001;

/// In the j-cluster that begins behind the first of the i-cluster: those behind each of them.
const LATER_MEMBERS: [u64; MASKS_PER_CLUSTER] = [0xfff8_fffc_fffe_ffff, 0xff80_ffc0_ffe0_fff0];

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

/// Appends the j-clusters of the particles `from..to`, at least one if they are those behind the i-cluster in its own column;
/// returns how many there are then.
#[inline(always)]
unsafe fn append_range<T: Scalar, const GHOSTS: bool, const CLUSTER: usize, const SAME_COLUMN: bool>(
    data: &PassData<T, impl PackedParticle>,
    group: &SearchGroup,
    buffers: &mut PairBuffers<T>,
    found: usize,
    [mut from, mut to]: [u32; 2],
    shift: usize,
    masks: &ClusterMasks,
) -> usize {
    // SAFETY: j-clusters have room for two more; more make room.
    unsafe {
        let mut owned = [[u64::MAX; MASKS_PER_CLUSTER]; 2];
        if GHOSTS {
            // Two ghosts are no concern of this rank.
            if and_masks(masks.ghosts, masks.members) == masks.members {
                let [first, last] = *group.stencil.owned.get_unchecked(shift % 5);
                if !SAME_COLUMN {
                    from = from.max(first);
                }
                to = to.min(last);
            }
            let from = from as usize;
            owned = [from, from + 16].map(|from| not_ghost_ghost(masks.ghosts, data.owned_bits(from)));
        }
        let length = to.saturating_sub(from) as usize;
        let slot_and_shift = (masks.slots.wrapping_add(found) << 8 | shift) as u32;
        let members = if SAME_COLUMN { and_masks(masks.members, LATER_MEMBERS) } else { masks.members };
        if length > 32 {
            return append_long_range(data, buffers, found, from, to, members, masks, slot_and_shift);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let bits = FIRST_BITS.get_unchecked(length).map(|bits| [bits; MASKS_PER_CLUSTER]);
        let [first, next] = [
            and_masks(bits[0], and_masks(members, owned[0])),
            and_masks(bits[1], and_masks(masks.members, owned[1])),
        ];
        let out = buffers.j_clusters.as_mut_ptr().add(found);
        *out = JCluster { eligible: first[0], from, slot_and_shift };
        *out.add(1) =
            JCluster { eligible: next[0], from: from + 16, slot_and_shift: slot_and_shift + ONE_SLOT };
        if CLUSTER > I_PER_MASK {
            buffers
                .eligible_high
                .as_mut_ptr()
                .add(found)
                .cast::<[u64; 2]>()
                .write_unaligned([first[1], next[1]]);
        }
        found + (SAME_COLUMN || length > 0) as usize + (length > 16) as usize
    }
}

#[inline(always)]
fn and_masks(a: [u64; MASKS_PER_CLUSTER], b: [u64; MASKS_PER_CLUSTER]) -> [u64; MASKS_PER_CLUSTER] {
    std::array::from_fn(|f| a[f] & b[f])
}

/// Which of sixteen particles concern this rank, of which `owned` are no ghosts, for an i-cluster.
#[inline(always)]
fn not_ghost_ghost(ghosts: [u64; MASKS_PER_CLUSTER], owned: u32) -> [u64; MASKS_PER_CLUSTER] {
    let owned = EACH * u64::from(owned);
    ghosts.map(|ghosts| !ghosts | owned)
}

/// Sixteen bits for each of eight particles that is a ghost, of a byte for each that is 1 then.
#[inline(always)]
fn ghosts(bytes: u64) -> [u64; MASKS_PER_CLUSTER] {
    [bytes & 0xffff_ffff, bytes >> 32].map(|four| {
        let spread =
            four & 0xff | (four & 0xff00) << 8 | (four & 0xff_0000) << 16 | (four & 0xff00_0000) << 24;
        0xffff * spread
    })
}

/// More j-clusters than two; `first` look at the first of them.
#[cold]
#[inline(never)]
#[allow(clippy::too_many_arguments)]
fn append_long_range<T: Scalar>(
    data: &PassData<T, impl PackedParticle>,
    buffers: &mut PairBuffers<T>,
    mut found: usize,
    from: u32,
    to: u32,
    first: [u64; MASKS_PER_CLUSTER],
    masks: &ClusterMasks,
    mut slot_and_shift: u32,
) -> usize {
    buffers.reserve_j_clusters(found + (to - from).div_ceil(16) as usize);
    for begin in (from..to).step_by(16) {
        let bits = [FIRST_BITS[(to - begin).min(16) as usize][0]; MASKS_PER_CLUSTER];
        let mut eligible = and_masks(bits, if begin == from { first } else { masks.members });
        if !data.ghost.is_empty() {
            // SAFETY: of a j-cluster.
            eligible = and_masks(
                eligible,
                not_ghost_ghost(masks.ghosts, unsafe { data.owned_bits(begin as usize) }),
            );
        }
        buffers.j_clusters[found] = JCluster { eligible: eligible[0], from: begin, slot_and_shift };
        buffers.eligible_high[found] = eligible[1];
        slot_and_shift += ONE_SLOT;
        found += 1;
    }
    found
}
