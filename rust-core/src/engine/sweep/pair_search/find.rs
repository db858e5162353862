//! The three steps of the search, one after the other.

use super::buffers::SearchBuffers;
use super::cell_ranges::{CellRanges, PlaneSearch, SearchGroup, StencilColumns};
use super::clusters::SEARCH_GROUP;
use super::distance_filter::filter_by_distance;
use super::j_clusters::form_j_clusters;
use crate::engine::sweep::cells::ghosts::MOST_OF_ANY;
use crate::engine::sweep::cells::sorted::SortedCells;
use crate::engine::sweep::simd::Isa;

const _: () = assert!(SEARCH_GROUP <= MOST_OF_ANY);

/// Lists the pairs of `count` i-particles of a column from `first` on, in i-clusters of `CLUSTER`; batches have
/// `batch_size` i-particles.
///
/// # Safety
/// The contract of `simd`. The particles are of that column.
#[inline(always)]
pub unsafe fn find_pairs<I: Isa, const CLUSTER: usize>(
    cells: &SortedCells,
    plane: &PlaneSearch,
    stencil: &StencilColumns,
    ranges: &mut CellRanges,
    [first, count]: [usize; 2],
    batch_size: usize,
    buffers: &mut SearchBuffers,
) {
    // SAFETY: the caller upholds the contract of `simd`; the group is not longer than `SEARCH_GROUP`, for which ranges
    // and buffers have room.
    unsafe {
        let flags = plane.cell_ranges::<I, CLUSTER>(cells, stencil, [first, count], ranges);
        let group = SearchGroup { plane, stencil, flags, first, count };
        // Ghost masks are applied only to groups that contain ghosts: owned particles pair with every candidate.
        if stencil.with_ghosts && cells.ghosts.any_of([first, count]) {
            form_j_clusters::<I, true, CLUSTER>(cells, &group, ranges, buffers);
        } else {
            form_j_clusters::<I, false, CLUSTER>(cells, &group, ranges, buffers);
        }
        if stencil.wraps || flags.before | flags.after != 0 {
            filter_by_distance::<I, true, CLUSTER>(cells, &group, batch_size, buffers);
        } else {
            filter_by_distance::<I, false, CLUSTER>(cells, &group, batch_size, buffers);
        }
    }
}
