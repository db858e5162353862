//! Runs the three steps of the search.

use super::buffers::SearchBuffers;
use super::cell_ranges::{CellRanges, PlaneSearch, SearchGroup, StencilColumns, WHOLE};
use super::distance_filter::filter_by_distance;
use super::j_clusters::form_j_clusters;
use crate::cells::sorted::SortedCells;
use crate::simd::{Isa, Kernel};

/// Lists the pairs of a search group: of `count` i-particles of a column, beginning with `first`. With the half stencil
/// these are the pairs of owned particles, with the whole one those of an owned particle and a ghost.
pub struct FindPairs<'a, const COLUMNS: usize> {
    pub cells: &'a SortedCells<'a>,
    pub plane: &'a PlaneSearch,
    pub stencil: &'a StencilColumns<COLUMNS>,
    pub ranges: &'a mut CellRanges<COLUMNS>,
    /// The pair `[first, count]`.
    pub group: [usize; 2],
    /// Number of i-particles of a batch.
    pub batch_size: usize,
    pub buffers: &'a mut SearchBuffers,
}

impl<const COLUMNS: usize> Kernel for FindPairs<'_, COLUMNS> {
    type Out = ();
    const VBMI2: bool = true;

    /// # Safety
    /// The caller fulfils the contract of `simd`. The particles are of the column.
    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        // SAFETY: the caller fulfils the contract of `in_clusters`.
        unsafe {
            match self.cells.grid.i_cluster_size {
                8 => self.in_clusters::<I, 8>(),
                _ => self.in_clusters::<I, 4>(),
            }
        }
    }
}

impl<const COLUMNS: usize> FindPairs<'_, COLUMNS> {
    /// Runs the search with i-clusters of `CLUSTER` particles.
    ///
    /// # Safety
    /// The caller fulfils the contract of [`FindPairs::run`].
    #[inline(always)]
    unsafe fn in_clusters<I: Isa, const CLUSTER: usize>(self) {
        let FindPairs { cells, plane, stencil, ranges, group: [first, count], batch_size, buffers } = self;
        // SAFETY: `SortedParticles::make_room` pads particles; the caller promises a group of at most
        // `SEARCH_GROUP`, for which ranges and buffers have room.
        unsafe {
            let flags = plane.cell_ranges::<I, CLUSTER, COLUMNS>(cells, stencil, [first, count], ranges);
            let group = SearchGroup { plane, stencil, flags, first, count };
            buffers.with_ghosts = COLUMNS == WHOLE;
            form_j_clusters::<I, CLUSTER, COLUMNS>(cells, &group, ranges, buffers);
            if stencil.wraps || flags.before | flags.after != 0 {
                filter_by_distance::<I, true, CLUSTER, COLUMNS>(cells, &group, batch_size, buffers);
            } else {
                filter_by_distance::<I, false, CLUSTER, COLUMNS>(cells, &group, batch_size, buffers);
            }
        }
    }
}
