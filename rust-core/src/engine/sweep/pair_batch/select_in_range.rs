//! Which pairs a density reaches: kept for the second pass.

use crate::engine::sweep::ground::arithmetic::OFFSET_BITS;
use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::terms::Pass;
use crate::engine::sweep::many_body::in_range_pairs::{I_CODE_BITS, InRangePairs};
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::simd::{Isa, Reals, Words};
use crate::model::kernel::{Shape, ShapeVisitor};

/// Appends to `in_range` the pairs within the range of each density; the block knows how many they are.
#[inline(always)]
pub unsafe fn append_in_range<I: Isa, A: Arithmetic<I>, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    batch: Batch,
) {
    for (pass, term) in data.terms.passes.iter().enumerate() {
        let found = term.force_kernel.visit(SelectInRange::<A::Reals, TALLY> {
            term,
            pairs: buffers.pairs.as_ptr().cast(),
            vectors: batch.count().div_ceil(A::Reals::LANES),
            i_in_batch: buffers.i_in_batch[batch.pairs[0]..].as_ptr(),
            j_offsets: buffers.j_offsets[batch.pairs[0]..].as_ptr(),
            plane_first: in_range.first,
            pair_weight: buffers.pair_weight.as_ptr(),
            weight_gradients: in_range.weight_gradients[pass].end(),
            separations: in_range.separations[pass].end(),
        });
        buffers.found[pass] = found;
    }
}

/// The loop over vectors, for one kernel.
struct SelectInRange<'a, R: Reals, const TALLY: bool> {
    term: &'a Pass<R::Scalar>,
    pairs: *const PairVector<R>,
    vectors: usize,
    i_in_batch: *const u8,
    j_offsets: *const u32,
    plane_first: u32,
    pair_weight: *const R::Scalar,
    weight_gradients: *mut [R::Scalar; 4],
    separations: *mut [R::Scalar; 4],
}

impl<R: Reals, const TALLY: bool> ShapeVisitor for SelectInRange<'_, R, TALLY> {
    type Output = usize;

    /// Rows `−w′ ê` and a code of both particles, and how many.
    #[inline(always)]
    fn visit<S: Shape>(self) -> usize {
        // SAFETY: the contract of `simd`, by way of `append_in_range`; `in_range` has room for whole vectors.
        unsafe {
            let range = R::splat(self.term.force_range);
            let inverse_range = R::splat(self.term.force_inverse_range);
            let factor = R::splat(self.term.force);
            let first = R::Words::splat(self.plane_first << OFFSET_BITS);
            let mut found = 0;
            let mut v = 0;
            while v < self.vectors {
                let pairs = &(*self.pairs.add(v)).geometry;
                let i_in_batch = R::Words::load_bytes(self.i_in_batch.add(v * R::LANES));
                let j = R::Words::load(self.j_offsets.add(v * R::LANES)).sub(first);
                let code = R::encode(j.shift_right::<{ OFFSET_BITS - I_CODE_BITS }>().add(i_in_batch));
                // Lanes behind the last pair are out of reach.
                let mask = pairs.r.mask_below(range);
                let g = factor * S::slope(pairs.r * inverse_range) * pairs.inverse;
                let [dx, dy, dz] = pairs.d;
                let (x, y, z) = ((g * dx).compress(mask), (g * dy).compress(mask), (g * dz).compress(mask));
                R::store_transposed([x, y, z, code.compress(mask)], self.weight_gradients.add(found).cast());
                if TALLY {
                    let pair_weight = R::load(self.pair_weight.add(v * R::LANES));
                    let (x, y, z) = (dx.compress(mask), dy.compress(mask), dz.compress(mask));
                    R::store_transposed(
                        [x, y, z, pair_weight.compress(mask)],
                        self.separations.add(found).cast(),
                    );
                }
                found += mask.count_ones() as usize;
                v += 1;
            }
            found
        }
    }
}
