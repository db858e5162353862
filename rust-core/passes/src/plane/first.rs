//! The first pass over columns of a plane: the pairs of their particles with each other, with the next column
//! and with the next plane, the
//! forces without density terms, and the weights.

use super::buffers::PairBuffers;
use super::data::PassData;
use super::traversal::{BatchVisitor, each_batch};
use crate::ground::arithmetic::Arithmetic;
use crate::pair_batch::accumulators::PlaneSums;
use crate::pair_batch::batch::Batch;
use crate::pair_batch::buffers::BatchBuffers;
use crate::pair_batch::evaluate::evaluate;
use crate::pair_batch::in_range_pairs::InRangePairs;
use crate::pair_batch::inputs::PairInputs;
use crate::pair_batch::scatter::{scatter_forces, scatter_weights};
use crate::pair_batch::step_constants::StepConstants;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Reals};
use crate::tally::Tally;
use std::ops::Range;

/// Does the first pass over `columns` of `plane`, and writes to `in_range` the pairs that the second pass needs.
///
/// # Safety
/// The caller fulfils the contract of `simd`. Arrays have the sizes that the types in [`PassData`]
/// state; the particles of the plane, of the next one and the padding are filled, and no thread writes
/// them. The sums are those of the plane; they are zero, and no other thread accesses them, for all particles of
/// these columns and of the columns next to them.
#[inline(always)]
pub unsafe fn first_pass<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane: usize,
    columns: Range<usize>,
    sums: PlaneSums,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
) -> Tally {
    let (cells, inputs) = (&data.cells, &data.inputs);
    let passes = inputs.terms.passes.len();
    // SAFETY: the caller promises a plane of the grid; the scheduler has filled it and the next one.
    unsafe {
        if MULTISPECIES && inputs.caches_all_pairs() {
            in_range.full_cache.clear(passes, TALLY);
        } else {
            in_range.clear(passes, cells.column(plane, 0)[0] as u32);
        }
        let PairBuffers { search, batch } = buffers;
        let constants = StepConstants::<I, A>::new(inputs);
        let mut pass = FirstPass::<I, A, MULTISPECIES, TALLY> {
            inputs,
            constants,
            sums,
            buffers: &mut *batch,
            in_range,
            tally: Tally::default(),
        };
        let groups = each_batch::<I, _>(cells, plane, columns, A::Reals::LANES, search, &mut pass);
        let tally = pass.tally;
        batch.counts.searched += groups;
        tally
    }
}

/// Evaluates batches, and adds the forces and weights of their pairs.
struct FirstPass<'a, I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool> {
    inputs: &'a PairInputs<'a, A::Scalar, A::PackedParticle>,
    constants: StepConstants<I, A>,
    sums: PlaneSums<'a>,
    buffers: &'a mut BatchBuffers<A::Scalar>,
    in_range: &'a mut InRangePairs<A::Scalar>,
    tally: Tally,
}

impl<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool> BatchVisitor<I>
    for FirstPass<'_, I, A, MULTISPECIES, TALLY>
{
    #[inline(always)]
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]) {
        // SAFETY: `SortedParticles::make_room` pads `packed` by a vector after the last particle;
        // `reserve` makes room for the batch; the caller of `first_pass` promises the rest.
        unsafe {
            let (inputs, sums) = (self.inputs, self.sums);
            let Some(batch) = Batch::of_group(search, slots) else { return };
            let buffers = &mut *self.buffers;
            buffers.reserve(batch.count);
            A::load_i_particles(inputs.packed.as_ptr().add(batch.first), &mut buffers.i_particles);
            evaluate::<I, A, MULTISPECIES, TALLY>(
                inputs,
                &self.constants,
                buffers,
                self.in_range,
                batch,
                &mut self.tally,
            );
            // Forces are added first: the quads of weights replace theirs.
            if !(MULTISPECIES && inputs.caches_all_pairs()) {
                scatter_forces::<I, A>(sums, buffers, batch);
                self.in_range.add::<TALLY>(&buffers.found, batch);
            }
            if sums.variables > 1 {
                scatter_weights::<I, A, MULTISPECIES>(inputs, sums, buffers, batch);
            }
        }
    }
}
