//! The weights `w(r)` of pairs in each density with a pass.

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::inputs::PairInputs;
use crate::ground::arithmetic::{Arithmetic, PairVector};
use crate::ground::terms::Pass;
use crate::simd::{Isa, Reals, Scalar};
use psidpd_model::kernel::{Shape, ShapeVisitor};

/// Computes `−w(r)` of all pairs for each density; the scatter loops subtract these from both particles.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain the distances of the batch.
#[inline(always)]
pub unsafe fn kernel_weights<I: Isa, A: Arithmetic<I>>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
) {
    for (pass, term) in inputs.terms.passes.iter().enumerate() {
        buffers.counts.weighted += 1;
        term.kernel.visit(KernelWeights::<A::Reals> {
            term,
            factor: A::Scalar::of(-term.value.wide()),
            pairs: buffers.pairs.as_ptr().cast(),
            vectors: batch.count.div_ceil(A::Reals::LANES),
            out: buffers.kernel_weights[pass].as_mut_ptr(),
        });
    }
}

/// The loop over vectors of pairs, compiled for each kernel.
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
        // SAFETY: `kernel_weights` alone creates this visitor, and its caller fulfils the contract of
        // `simd`; `BatchBuffers::reserve` has made room for whole vectors.
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
