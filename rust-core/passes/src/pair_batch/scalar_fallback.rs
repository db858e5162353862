//! Potentials without vector code, formulas and tables: evaluated in double precision for the pairs they act on.

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::inputs::PairInputs;
use crate::ground::arithmetic::{Arithmetic, PackedParticle, PairVector};
use crate::simd::{Isa, Reals, Scalar};
use crate::tally::Tally;
use psidpd_model::pair::PairForm;

/// Adds the forces along `ê` of these potentials to those in the buffers.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain the distances of the batch.
#[inline(always)]
pub unsafe fn scalar_fallback<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
    tally: &mut Tally,
) {
    // SAFETY: a vector is an array of its lanes, and `BatchBuffers` has a vector for every pair of the batch.
    unsafe {
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        for k in 0..batch.count {
            let r: *const A::Scalar = (&raw const (*pairs.add(k / A::Reals::LANES)).geometry.r).cast();
            buffers.fallback.all[k] = (*r.add(k % A::Reals::LANES)).wide();
        }
    }
    // With one species all entries stay zero.
    if MULTISPECIES && inputs.terms.species > 1 {
        for k in 0..batch.count {
            // SAFETY: `SortedParticles::make_room` makes an entry for each particle if there are several species.
            let [a, b] = batch.pair(k).map(|i| unsafe { *inputs.species.at(i) } as usize);
            buffers.fallback.species_pair[k] = (a * inputs.terms.species + b) as u32;
        }
    }
    each::<A::Scalar, MULTISPECIES>(inputs, buffers, batch, TALLY.then_some(tally));
}

#[inline(never)]
fn each<T: Scalar, const MULTISPECIES: bool>(
    inputs: &PairInputs<T, impl PackedParticle>,
    buffers: &mut BatchBuffers<T>,
    batch: Batch,
    mut tally: Option<&mut Tally>,
) {
    let terms = inputs.terms;
    for term in &terms.scalar_fallback {
        let [a, b] = term.between;
        let (ab, ba) = ((a * terms.species + b) as u32, (b * terms.species + a) as u32);
        let range = term.potential.range();
        let mut found = 0;
        let fallback = &mut buffers.fallback;
        for k in 0..batch.count {
            let r = fallback.all[k];
            let acts = !MULTISPECIES || fallback.species_pair[k] == ab || fallback.species_pair[k] == ba;
            fallback.index[found] = k as u32;
            fallback.r[found] = r;
            found += (acts && r < range) as usize;
        }
        term.potential.block(&fallback.r[..found], &mut fallback.phi[..found], &mut fallback.slope[..found]);
        for n in 0..found {
            let k = fallback.index[n] as usize;
            buffers.conservative[k] = T::of(buffers.conservative[k].wide() - fallback.slope[n]);
            if let Some(tally) = &mut tally {
                tally.pair += fallback.phi[n] * batch.pair_weight();
            }
        }
    }
}
