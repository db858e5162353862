//! Potentials of any form: evaluated in double precision, apart from the others, for the pairs they act on.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::layer::{Part, Swept};
use super::simd::{Isa, Reals, Scalar, Words};
use crate::engine::tally::Tally;
use crate::model::pair::PairForm;

/// Forces along `ê` of the pairs of a vector's worth of a group.
#[inline(always)]
pub unsafe fn aside<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    metric: &A::Metric,
    block: &mut Block<A::Scalar>,
    part: Part,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let mut k = 0;
        while k < part.count() {
            let which = <A::Reals as Reals>::Words::load_bytes(block.which.as_ptr().add(k));
            let (records, places) = (swept.records.as_ptr(), block.j.as_ptr().add(part.pairs[0] + k));
            let (pairs, _) = A::separate::<false>(metric, records, &block.own, which, places, false);
            let mut lanes = [A::Scalar::default(); 16];
            pairs.r.store(lanes.as_mut_ptr());
            for (r, lane) in block.aside.all[k..].iter_mut().zip(&lanes[..A::Reals::LANES]) {
                *r = lane.wide();
            }
            k += A::Reals::LANES;
        }
    }
    if SEVERAL {
        for k in 0..part.count() {
            let [a, b] = block.pair(part, k).map(|i| swept.species[i] as usize);
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
    block.conservative[..part.count()].fill(T::default());
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
