//! The first pass over a plane: the pairs of its particles with each other and with the next plane, the forces that need no
//! density, and the weights.

use super::buffers::PairBuffers;
use super::data::PassData;
use crate::ground::arithmetic::Arithmetic;
use crate::pair_batch::accumulators::PlaneSums;
use crate::pair_batch::batch::Batch;
use crate::pair_batch::evaluate::evaluate;
use crate::pair_batch::in_range_pairs::InRangePairs;
use crate::pair_batch::scatter::{scatter_forces, scatter_weights};
use crate::pair_batch::step_constants::StepConstants;
use crate::pair_search::cell_ranges::{CellRanges, PlaneSearch, StencilColumns};
use crate::pair_search::clusters::SEARCH_GROUP;
use crate::pair_search::find::FindPairs;
use crate::simd::{Isa, Reals, call};
use crate::tally::Tally;

/// Does the first pass over `plane`; leaves in `in_range` what the second one needs.
///
/// # Safety
/// The contract of `simd`. Arrays are as the types in [`PassData`] say; places of the plane, of the next one and the padding
/// behind are filled, and nobody writes them. The sums are those of the plane, and zero.
#[inline(always)]
pub unsafe fn first_pass<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane: usize,
    sums: PlaneSums,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
) -> Tally {
    // SAFETY: columns are those of the grid, groups and batches those of a column; the caller upholds the rest.
    unsafe {
        let (cells, grid) = (&data.cells, data.cells.grid);
        let mut tally = Tally::default();
        let passes = data.inputs.terms.passes.len();
        if MULTISPECIES && data.inputs.caches_all_pairs() {
            in_range.full_cache.clear(passes, TALLY);
        } else {
            in_range.clear(passes, cells.column(plane, 0)[0] as u32);
        }
        let search = PlaneSearch::new(cells, plane);
        let constants = StepConstants::<I, A>::new(&data.inputs);
        let mut ranges = CellRanges::default();
        let mut column = 0;
        while column < grid.columns_per_plane {
            let stencil = StencilColumns::new(cells, &search, plane, column);
            let [mut first, end] = cells.column(plane, column);
            if !cells.ghosts.is_empty() && stencil.only_ghosts() {
                first = end;
            }
            while first < end {
                let count = SEARCH_GROUP.min(end - first);
                let (group, lanes) = ([first, count], A::Reals::LANES);
                buffers.batch.counts.searched += 1;
                // A call: what finds pairs is the same in every pass on an instruction set.
                call::<I, _>(FindPairs {
                    cells,
                    plane: &search,
                    stencil: &stencil,
                    ranges: &mut ranges,
                    group,
                    batch_size: lanes,
                    buffers: &mut buffers.search,
                });
                let mut slot = 0;
                while slot < count {
                    let slots = [slot, count.min(slot + lanes)];
                    do_batch::<I, A, MULTISPECIES, TALLY>(
                        data, &constants, sums, buffers, in_range, slots, &mut tally,
                    );
                    slot = slots[1];
                }
                first += count;
            }
            column += 1;
        }
        tally
    }
}

/// Evaluates the batch of members `slots[0]..slots[1]` of the search group, and adds what its pairs do.
///
/// # Safety
/// As [`first_pass`]; the group has been found.
#[inline(always)]
unsafe fn do_batch<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    sums: PlaneSums,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    slots: [usize; 2],
    tally: &mut Tally,
) {
    // SAFETY: `packed` has a vector of padding behind the last particle (`SortedParticles::make_room`); `reserve` makes room for the
    // batch; the caller upholds the rest.
    unsafe {
        let inputs = &data.inputs;
        let Some(batch) = Batch::of_group(&buffers.search, slots) else { return };
        let buffers = &mut buffers.batch;
        buffers.reserve(batch.count);
        A::load_i_particles(inputs.packed.as_ptr().add(batch.first), &mut buffers.i_particles);
        evaluate::<I, A, MULTISPECIES, TALLY>(inputs, constants, buffers, in_range, batch, tally);
        // Forces first: the quads of weights replace theirs.
        if !(MULTISPECIES && inputs.caches_all_pairs()) {
            scatter_forces::<I, A>(sums, buffers, batch);
            in_range.add::<TALLY>(&buffers.found, batch);
        }
        if sums.variables > 1 {
            scatter_weights::<I, A, MULTISPECIES>(inputs, sums, buffers, batch);
        }
    }
}
