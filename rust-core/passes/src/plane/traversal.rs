//! The traversal of columns of a plane: their search groups, and the batches of their pairs. The particles of a column
//! search among the owned particles, and then those that ghosts may be near among the ghosts.

use crate::cells::sorted::SortedCells;
use crate::pair_search::buffers::SearchBuffers;
use crate::pair_search::cell_ranges::{CellRanges, HALF, PlaneSearch, StencilColumns, WHOLE};
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

/// Finds the pairs of the owned particles in `columns` of `plane` with each other, with the next column and with the
/// next plane, and those with ghosts, and calls `visitor` for successive sets of `lanes` i-particles, in the order of cells; returns the number of search groups.
///
/// # Safety
/// The caller fulfils the contract of `simd`. Particles of the plane, of the next one and the padding
/// are filled, also those of the plane before if there are ghosts, and no thread writes them.
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
        let mut ranges = CellRanges::<HALF>::default();
        let mut ranges_of_ghosts = match cells.grid.layers {
            1 => None,
            _ => Some(buffers.ranges_of_ghosts.take().unwrap_or_default()),
        };
        let mut groups = 0;
        let mut column = columns.start;
        while column < columns.end {
            let stencil = StencilColumns::<HALF>::new(cells, &search, plane, column);
            let own = cells.column(plane, column);
            let mut parts = [own, [own[1]; 2], [own[1]; 2]];
            let mut among_ghosts = ranges_of_ghosts
                .as_deref_mut()
                .map(|ranges| (StencilColumns::<WHOLE>::new(cells, &search, plane, column), ranges));
            if let Some((stencil, _)) = &among_ghosts {
                [parts[1], parts[2]] = stencil.near_ghosts(cells, plane, column);
            }
            let mut part = 0;
            while part < parts.len() {
                let [mut first, end] = parts[part];
                while first < end {
                    let group = [first, SEARCH_GROUP.min(end - first)];
                    let (plane, batch_size) = (&search, lanes);
                    groups += 1;
                    // The search is a function call, as it is the same in every pass on an instruction set.
                    match &mut among_ghosts {
                        Some((stencil, ranges)) if part > 0 => {
                            let buffers = &mut *buffers;
                            run(
                                cells.set,
                                FindPairs { cells, plane, stencil, ranges, group, batch_size, buffers },
                            );
                        }
                        _ => {
                            let (stencil, ranges, buffers) = (&stencil, &mut ranges, &mut *buffers);
                            run(
                                cells.set,
                                FindPairs { cells, plane, stencil, ranges, group, batch_size, buffers },
                            );
                        }
                    }
                    let mut slot = 0;
                    while slot < group[1] {
                        let slots = [slot, group[1].min(slot + lanes)];
                        visitor.visit(buffers, slots);
                        slot = slots[1];
                    }
                    first += group[1];
                }
                part += 1;
            }
            column += 1;
        }
        buffers.ranges_of_ghosts = ranges_of_ghosts.or(buffers.ranges_of_ghosts.take());
        groups
    }
}
