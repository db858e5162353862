//! The first pass over columns of a plane: the pairs of their particles with each other, with the next column, with the
//! next plane and with ghosts, the forces without density terms, and the weights.

use super::buffers::PairBuffers;
use super::data::PassData;
use super::list::{ListTerms, Listed, PairList, PairsAt, VectorsOfPairs, append_batch};
use super::traversal::{BatchVisitor, each_batch};
use crate::ground::arithmetic::{Arithmetic, Double, Mixed, PairVector};
use crate::instruction_set::InstructionSet;
use crate::pair_batch::accumulators::PlaneSums;
use crate::pair_batch::batch::Batch;
use crate::pair_batch::buffers::BatchBuffers;
use crate::pair_batch::evaluate::evaluate;
use crate::pair_batch::in_range_pairs::InRangePairs;
use crate::pair_batch::inputs::PairInputs;
use crate::pair_batch::scatter::{scatter_forces, scatter_weights};
use crate::pair_batch::step_constants::StepConstants;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Kernel, Reals, run};
use crate::tally::Tally;
use std::ops::Range;

/// Does the first pass over `columns` of `plane`, writes the pairs that the second pass needs to `in_range`, those with
/// ghosts to `rim`, and appends those that are listed to the lists of the plane.
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
    rim: &mut InRangePairs<A::Scalar>,
) -> Tally {
    let (cells, inputs, listed) = (&data.cells, &data.inputs, data.listed);
    let passes = inputs.terms.passes.len();
    // SAFETY: the caller promises a plane of the grid; the scheduler has filled it and the next one.
    unsafe {
        if MULTISPECIES && inputs.terms.full_cache {
            in_range.full_cache.clear(passes, TALLY);
            rim.full_cache.clear(passes, TALLY);
        } else {
            in_range.clear(passes, cells.column(plane, 0)[0] as u32);
            // The ghosts may be of any plane.
            rim.clear(passes, 0);
        }
        let PairBuffers { search, batch, lists } = buffers;
        let constants = StepConstants::<I, A>::new(inputs);
        let mut pass = FirstPass::<I, A, MULTISPECIES, TALLY> {
            inputs,
            constants,
            sums,
            buffers: &mut *batch,
            in_range,
            rim,
            listed,
            set: cells.set,
            lists: &mut *lists,
            tally: Tally::default(),
        };
        let last = columns.end - 1;
        let groups = each_batch::<I, _>(cells, plane, columns, A::Reals::LANES, search, &mut pass);
        let tally = pass.tally;
        if listed.is_some() {
            lists.own.begin_at(cells.column(plane, last)[1]);
        }
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
    rim: &'a mut InRangePairs<A::Scalar>,
    listed: Option<&'a ListTerms>,
    set: InstructionSet,
    lists: &'a mut Listed,
    tally: Tally,
}

/// The pairs of a batch, as the pass has computed them.
struct Computed {
    /// [`PairVector`]s of the instruction set.
    pairs: *const u8,
}

impl<I: Isa, A: Arithmetic<I>> VectorsOfPairs<I, A> for Computed {
    #[inline(always)]
    unsafe fn at(&self, k: usize) -> PairsAt<A::Reals> {
        // SAFETY: the caller promises a number of a pair; the array has whole vectors.
        unsafe {
            let pairs = self.pairs.cast::<PairVector<A::Reals>>();
            let PairVector { geometry, species_pair } = *pairs.add(k / A::Reals::LANES);
            PairsAt { geometry, species_pair }
        }
    }
}

/// Lists the pairs of a batch. It is called, as the pass is compiled for more fluids than the list.
struct Append<'a, const MULTISPECIES: bool> {
    list: &'a mut PairList,
    terms: &'a ListTerms,
    batch: Batch<'a>,
    computed: Computed,
    is_double: bool,
}

impl<const MULTISPECIES: bool> Kernel for Append<'_, MULTISPECIES> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let Append { list, terms, batch, computed, is_double } = self;
        // SAFETY: the pass appends its batches in their order, with the arrays of this batch.
        unsafe {
            match is_double {
                false => append_batch::<I, Mixed, MULTISPECIES>(list, terms, batch, &computed),
                true => append_batch::<I, Double, MULTISPECIES>(list, terms, batch, &computed),
            }
        }
    }
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
            let in_range = if batch.with_ghosts { &mut *self.rim } else { &mut *self.in_range };
            buffers.reserve(batch.count);
            A::load_i_particles(inputs.packed.as_ptr().add(batch.first), &mut buffers.i_particles);
            evaluate::<I, A, MULTISPECIES, TALLY>(
                inputs,
                &self.constants,
                buffers,
                in_range,
                batch,
                &mut self.tally,
            );
            if let Some(terms) = self.listed {
                let computed = Computed { pairs: buffers.pairs.as_ptr().cast() };
                let list = self.lists.of(batch);
                let is_double = size_of::<A::Scalar>() == size_of::<f64>();
                run(self.set, Append::<MULTISPECIES> { list, terms, batch, computed, is_double });
            }
            // Forces are added first: the quads of weights replace theirs.
            if !(MULTISPECIES && inputs.terms.full_cache) {
                scatter_forces::<I, A>(sums, buffers, batch);
                in_range.add::<TALLY>(&buffers.found, batch);
            }
            if sums.variables > 1 {
                scatter_weights::<I, A, MULTISPECIES>(inputs, sums, buffers, batch);
            }
        }
    }
}
