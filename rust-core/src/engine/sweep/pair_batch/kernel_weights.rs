//! Weights of the densities that some ψ is not linear in.

use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::terms::Pass;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::simd::{Isa, Reals, Scalar};
use crate::model::kernel::{Shape, ShapeVisitor};

/// Minus the weights of the pairs for each density.
#[inline(always)]
pub unsafe fn kernel_weights<I: Isa, A: Arithmetic<I>>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
) {
    for (pass, term) in data.terms.passes.iter().enumerate() {
        term.kernel.visit(KernelWeights::<A::Reals> {
            term,
            factor: A::Scalar::of(-term.value.wide()),
            pairs: buffers.pairs.as_ptr().cast(),
            vectors: batch.count().div_ceil(A::Reals::LANES),
            out: buffers.kernel_weights[pass].as_mut_ptr(),
        });
    }
}

/// The loop over vectors, for one kernel.
struct KernelWeights<'a, R: Reals> {
    term: &'a Pass<R::Scalar>,
    factor: R::Scalar,
    pairs: *const PairVector<R>,
    vectors: usize,
    out: *mut R::Scalar,
}

impl<R: Reals> ShapeVisitor for KernelWeights<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `kernel_weights`.
        unsafe {
            let inverse_range = R::splat(self.term.inverse_range);
            let factor = R::splat(self.factor);
            let one = R::constant(1.0);
            let mut v = 0;
            while v < self.vectors {
                let s = (*self.pairs.add(v)).geometry.r * inverse_range;
                let w = factor * S::value(s);
                w.where_below(s, one).store(self.out.add(v * R::LANES));
                v += 1;
            }
        }
    }
}
