//! The first pass over the pairs of one plane: of its particles with each other and with the next plane.
//!
//! What pairs add to a particle of the plane goes to the plane's own accumulators, what they add to one
//! of the next plane to accumulators that only this plane writes. Sums therefore do not depend on
//! which thread does which plane, nor when.

use crate::engine::sweep::ground::arithmetic::Arithmetic;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::many_body::in_range_pairs::InRangePairs;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::{PairBuffers, SEARCH_GROUP};
use crate::engine::sweep::pair_batch::evaluate::{StepConstants, evaluate};
use crate::engine::sweep::pair_batch::scatter::{scatter, scatter_kernel_weights};
use crate::engine::sweep::pair_search::cell_ranges::{CellRanges, PlaneSearch, StencilColumns};
use crate::engine::sweep::pair_search::distance_filter::filter_by_distance;
use crate::engine::sweep::pair_search::j_clusters::{SearchGroup, form_j_clusters};
use crate::engine::sweep::simd::{Isa, Reals};
use crate::engine::tally::Tally;

// With up to seven bits before the first they fit into a word.
const _: () = assert!(SEARCH_GROUP <= 57);

/// First pass: finds the pairs of `plane`, adds forces that need no density, and weights.
///
/// # Safety
/// The contract of `simd`; arrays are as [`PassData`] says; no other call is in the same plane.
#[inline(always)]
pub unsafe fn first_pass<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane: usize,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
) -> Tally {
    // SAFETY: the caller's.
    unsafe {
        let grid = data.grid;
        let mut tally = Tally::default();
        let plane_first = *data.start.get_unchecked(plane * grid.columns_per_plane * grid.cells_per_column);
        let passes = data.terms.passes.len();
        if MULTISPECIES && data.terms.full_cache {
            in_range.full_cache.clear(passes, TALLY);
        } else {
            in_range.clear(passes, plane_first);
        }
        let plane_search = PlaneSearch::new(data, plane);
        let ghosts = !data.ghost.is_empty();
        let constants = StepConstants::<I, A>::new(data);
        let mut cell_ranges = CellRanges::default();
        let mut column = 0;
        while column < grid.columns_per_plane {
            let cell = (plane * grid.columns_per_plane + column) * grid.cells_per_column;
            let stencil = StencilColumns::new(data, &plane_search, plane, column);
            let mut first = *data.start.get_unchecked(cell) as usize;
            let end = *data.start.get_unchecked(cell + grid.cells_per_column) as usize;
            // Ghosts look for owned particles only.
            if ghosts && stencil.owned.iter().all(|[first, last]| first == last) {
                first = end;
            }
            while first < end {
                let count = SEARCH_GROUP.min(end - first);
                let group = [first, count];
                if grid.i_cluster_size == 8 {
                    find_pairs::<I, A, 8>(
                        data,
                        &plane_search,
                        &stencil,
                        &mut cell_ranges,
                        column,
                        group,
                        buffers,
                    );
                } else {
                    find_pairs::<I, A, 4>(
                        data,
                        &plane_search,
                        &stencil,
                        &mut cell_ranges,
                        column,
                        group,
                        buffers,
                    );
                }
                let mut slot = 0;
                while slot < count {
                    let last = count.min(slot + A::Reals::LANES);
                    evaluate_batch::<I, A, MULTISPECIES, TALLY>(
                        data,
                        &constants,
                        plane,
                        buffers,
                        in_range,
                        [slot, last],
                        &mut tally,
                    );
                    slot = last;
                }
                first += count;
            }
            column += 1;
        }
        tally
    }
}

/// Finds the pairs of a group: `count` particles of a column from `first` on.
#[inline(always)]
unsafe fn find_pairs<I: Isa, A: Arithmetic<I>, const CLUSTER: usize>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane_search: &PlaneSearch,
    stencil: &StencilColumns,
    cell_ranges: &mut CellRanges,
    column: usize,
    [first, count]: [usize; 2],
    buffers: &mut PairBuffers<A::Scalar>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let flags = plane_search.cell_ranges::<I, CLUSTER>(
            data,
            column,
            [first, count],
            &stencil.present,
            cell_ranges,
        );
        let group = SearchGroup { plane_search, stencil, flags, first, count };
        // Owned particles look at all there are.
        if stencil.with_ghosts && data.has_ghosts([first, count]) {
            form_j_clusters::<I, A::Scalar, true, CLUSTER>(data, &group, cell_ranges, buffers);
        } else {
            form_j_clusters::<I, A::Scalar, false, CLUSTER>(data, &group, cell_ranges, buffers);
        }
        if stencil.wraps || flags.before | flags.after != 0 {
            filter_by_distance::<I, A::Scalar, true, CLUSTER>(data, &group, A::Reals::LANES, buffers);
        } else {
            filter_by_distance::<I, A::Scalar, false, CLUSTER>(data, &group, A::Reals::LANES, buffers);
        }
    }
}

/// Evaluates the pairs of a vector's worth of a group, and adds what they do.
#[inline(always)]
unsafe fn evaluate_batch<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    plane: usize,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    [first, last]: [usize; 2],
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`; there are records for a vector behind the last particle.
    unsafe {
        let pairs =
            [*buffers.begin.get_unchecked(first) as usize, *buffers.begin.get_unchecked(last) as usize];
        if pairs[0] == pairs[1] {
            return;
        }
        let batch = Batch { slots: [first, last], first: buffers.first + first, pairs };
        A::load_i_particles(data.packed.as_ptr().add(batch.first), &mut buffers.i_particles);
        evaluate::<I, A, MULTISPECIES, TALLY>(data, constants, buffers, in_range, batch, tally);
        let accumulator_offset = *data.accumulator_offset.get_unchecked(plane);
        // Forces first: columns of weights take the place of theirs.
        if !(MULTISPECIES && data.terms.full_cache) {
            scatter::<I, A>(data.sums, data.variables, accumulator_offset, buffers, batch);
            in_range.add::<TALLY>(buffers, batch);
        }
        if data.variables > 1 {
            scatter_kernel_weights::<I, A, MULTISPECIES>(data, accumulator_offset, buffers, batch);
        }
    }
}
