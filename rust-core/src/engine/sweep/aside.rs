//! Potentials of any form: evaluated in double precision, apart from the others, for the pairs they act on.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::Block;
use super::layer::{Part, Swept};
use super::simd::{Isa, Reals, Scalar};
use crate::engine::tally::Tally;
use crate::model::pair::PairForm;

/// Forces along `ê` of the pairs of a vector's worth of a group.
#[inline(always)]
pub unsafe fn aside<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &mut Block<A::Scalar>,
    part: Part,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
        for k in 0..part.count() {
            let r: *const A::Scalar = (&raw const (*pairs.add(k / A::Reals::LANES)).apart.r).cast();
            block.aside.all[k] = (*r.add(k % A::Reals::LANES)).wide();
        }
    }
    // With one all kinds are zero.
    if SEVERAL && swept.terms.species > 1 {
        for k in 0..part.count() {
            // SAFETY: there are species of all particles.
            let [a, b] = block.pair(part, k).map(|i| unsafe { *swept.species.at(i) } as usize);
            block.aside.kind[k] = (a * swept.terms.species + b) as u32;
        }
    }
    each::<A::Scalar, SEVERAL>(swept, block, part, TALLY.then_some(tally));
}

#[inline(never)]
fn each<T: Scalar, const SEVERAL: bool>(
    swept: &Swept<T, impl super::arithmetic::Record>,
    block: &mut Block<T>,
    part: Part,
    mut tally: Option<&mut Tally>,
) {
    let terms = swept.terms;
    for term in &terms.apart {
        let [a, b] = term.between;
        let (ab, ba) = ((a * terms.species + b) as u32, (b * terms.species + a) as u32);
        let range = term.potential.range();
        let mut found = 0;
        let aside = &mut block.aside;
        for k in 0..part.count() {
            let r = aside.all[k];
            let acts = !SEVERAL || aside.kind[k] == ab || aside.kind[k] == ba;
            aside.place[found] = k as u32;
            aside.r[found] = r;
            found += (acts && r < range) as usize;
        }
        term.potential.block(&aside.r[..found], &mut aside.phi[..found], &mut aside.slope[..found]);
        for n in 0..found {
            let k = block.aside.place[n] as usize;
            block.conservative[k] = T::of(block.conservative[k].wide() - block.aside.slope[n]);
            if let Some(tally) = &mut tally {
                let [i, j] = block.pair(part, k);
                tally.pair += block.aside.phi[n] * swept.share(i, j);
            }
        }
    }
}
