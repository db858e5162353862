//! Potentials of any form: evaluated in double precision, apart from the others, for the pairs they act on.

use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::simd::{Isa, Reals, Scalar};
use crate::engine::tally::Tally;
use crate::model::pair::PairForm;

/// Forces along `ê` of the pairs of a vector's worth of a group.
#[inline(always)]
pub unsafe fn scalar_fallback<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        for k in 0..batch.count() {
            let r: *const A::Scalar = (&raw const (*pairs.add(k / A::Reals::LANES)).geometry.r).cast();
            buffers.fallback.all[k] = (*r.add(k % A::Reals::LANES)).wide();
        }
    }
    // With one all kinds are zero.
    if MULTISPECIES && data.terms.species > 1 {
        for k in 0..batch.count() {
            // SAFETY: there are species of all particles.
            let [a, b] = buffers.pair(batch, k).map(|i| unsafe { *data.species.at(i) } as usize);
            buffers.fallback.species_pair[k] = (a * data.terms.species + b) as u32;
        }
    }
    each::<A::Scalar, MULTISPECIES>(data, buffers, batch, TALLY.then_some(tally));
}

#[inline(never)]
fn each<T: Scalar, const MULTISPECIES: bool>(
    data: &PassData<T, impl crate::engine::sweep::ground::arithmetic::PackedParticle>,
    buffers: &mut PairBuffers<T>,
    batch: Batch,
    mut tally: Option<&mut Tally>,
) {
    let terms = data.terms;
    for term in &terms.scalar_fallback {
        let [a, b] = term.between;
        let (ab, ba) = ((a * terms.species + b) as u32, (b * terms.species + a) as u32);
        let range = term.potential.range();
        let mut found = 0;
        let fallback = &mut buffers.fallback;
        for k in 0..batch.count() {
            let r = fallback.all[k];
            let acts = !MULTISPECIES || fallback.species_pair[k] == ab || fallback.species_pair[k] == ba;
            fallback.index[found] = k as u32;
            fallback.r[found] = r;
            found += (acts && r < range) as usize;
        }
        term.potential.block(&fallback.r[..found], &mut fallback.phi[..found], &mut fallback.slope[..found]);
        for n in 0..found {
            let k = buffers.fallback.index[n] as usize;
            buffers.conservative[k] = T::of(buffers.conservative[k].wide() - buffers.fallback.slope[n]);
            if let Some(tally) = &mut tally {
                let [i, j] = buffers.pair(batch, k);
                tally.pair += buffers.fallback.phi[n] * data.pair_weight(i, j);
            }
        }
    }
}
