//! Weights of the densities that some ψ is not linear in.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::Block;
use super::layer::{Part, Swept};
use super::simd::{Isa, Reals, Scalar};
use super::terms::Pass;
use crate::model::kernel::{Shape, ShapeVisitor};

/// Minus the weights of the pairs for each density.
#[inline(always)]
pub unsafe fn weights<I: Isa, A: Arithmetic<I>>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &mut Block<A::Scalar>,
    part: Part,
) {
    for (pass, term) in swept.terms.passes.iter().enumerate() {
        term.kind.visit(Weights::<A::Reals> {
            term,
            factor: A::Scalar::of(-term.value.wide()),
            pairs: block.pairs.as_ptr().cast(),
            vectors: part.count().div_ceil(A::Reals::LANES),
            out: block.weight[pass].as_mut_ptr(),
        });
    }
}

/// The loop over vectors, for one kernel.
struct Weights<'a, R: Reals> {
    term: &'a Pass<R::Scalar>,
    factor: R::Scalar,
    pairs: *const Pairs<R>,
    vectors: usize,
    out: *mut R::Scalar,
}

impl<R: Reals> ShapeVisitor for Weights<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `weights`.
        unsafe {
            let inverse_range = R::splat(self.term.inverse_range);
            let factor = R::splat(self.factor);
            let one = R::constant(1.0);
            let mut v = 0;
            while v < self.vectors {
                let s = (*self.pairs.add(v)).apart.r * inverse_range;
                let w = factor * S::value(s);
                w.where_below(s, one).store(self.out.add(v * R::LANES));
                v += 1;
            }
        }
    }
}
