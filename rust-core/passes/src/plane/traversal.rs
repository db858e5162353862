//! The traversal of columns of a plane: their search groups, and the batches of their pairs.

use crate::cells::sorted::SortedCells;
use crate::pair_search::buffers::SearchBuffers;
use crate::pair_search::cell_ranges::{CellRanges, PlaneSearch, StencilColumns};
use crate::pair_search::clusters::SEARCH_GROUP;
use crate::pair_search::find::FindPairs;
use crate::simd::{Isa, run};
use std::ops::Range;

/// The work that a pass does with each batch of pairs.
pub trait BatchVisitor<I: Isa> {
    /// Evaluates members `slots[0]..slots[1]` of a search group; implementations must be inlined.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; the group has been found, and has these members.
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]);
}

/// Finds the pairs of the particles in `columns` of `plane` with each other, with the next column and with the
/// next plane, and calls `visitor` for successive sets of `lanes` i-particles, in the order of cells; returns the number of search groups.
///
/// # Safety
/// The caller fulfils the contract of `simd`. Particles of the plane, of the next one and the padding
/// are filled, and no thread writes them.
#[inline(always)]
pub unsafe fn each_batch<I: Isa, V: BatchVisitor<I>>(
    cells: &SortedCells,
    plane: usize,
    columns: Range<usize>,
    lanes: usize,
    buffers: &mut SearchBuffers,
    visitor: &mut V,
) -> u64 {
    // SAFETY: columns are those of the grid, and groups and batches those of a column;
    // `SortedParticles::make_room` pads the arrays.
    unsafe {
        let search = PlaneSearch::new(cells, plane);
        let mut ranges = CellRanges::default();
        let mut groups = 0;
        let mut column = columns.start;
        while column < columns.end {
            let stencil = StencilColumns::new(cells, &search, plane, column);
            let [mut first, end] = cells.column(plane, column);
            if !cells.ghosts.is_empty() && stencil.only_ghosts() {
                first = end;
            }
            while first < end {
                let count = SEARCH_GROUP.min(end - first);
                groups += 1;
                // The search is a function call, as it is the same in every pass on an instruction set.
                let find = FindPairs {
                    cells,
                    plane: &search,
                    stencil: &stencil,
                    ranges: &mut ranges,
                    group: [first, count],
                    batch_size: lanes,
                    buffers,
                };
                run(cells.set, find);
                let mut slot = 0;
                while slot < count {
                    let slots = [slot, count.min(slot + lanes)];
                    visitor.visit(buffers, slots);
                    slot = slots[1];
                }
                first += count;
            }
            column += 1;
        }
        groups
    }
}
