//! Potentials of any form: evaluated in double precision, apart from the others, for the pairs they act on.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar, Words};
use crate::engine::tally::Tally;
use crate::model::pair::PairForm;

/// Forces along `ê` of the pairs `from..to` of a block, of which `members` from `slot` on are the first.
#[inline(always)]
pub unsafe fn aside<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    metric: &A::Metric,
    block: &mut Block<A::Scalar>,
    slot: usize,
    [from, to]: [usize; 2],
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let mut k = from;
        while k < to {
            let which = <A::Reals as Reals>::Words::load_bytes(block.which.as_ptr().add(k));
            let index = block.j.as_ptr().add(k);
            let (pairs, _) = A::separate(metric, swept.records.as_ptr(), &block.own, which, index, false);
            let mut lanes = [A::Scalar::default(); 16];
            pairs.r.store(lanes.as_mut_ptr());
            for (r, lane) in block.aside.all[k..].iter_mut().zip(&lanes[..A::Reals::LANES]) {
                *r = lane.wide();
            }
            k += A::Reals::LANES;
        }
    }
    if SEVERAL {
        for k in from..to {
            let i = block.members[slot + block.which[k] as usize] as usize;
            let (a, b) = (swept.species[i] as usize, swept.species[block.j[k] as usize] as usize);
            block.aside.kind[k] = (a * swept.terms.species + b) as u32;
        }
    }
    each::<A::Scalar, SEVERAL>(swept, block, slot, [from, to], TALLY.then_some(tally));
}

#[inline(never)]
fn each<T: Scalar, const SEVERAL: bool>(
    swept: &Swept<T, impl super::arithmetic::Record>,
    block: &mut Block<T>,
    slot: usize,
    [from, to]: [usize; 2],
    mut tally: Option<&mut Tally>,
) {
    let terms = swept.terms;
    block.conservative[from..to].fill(T::default());
    for term in &terms.apart {
        let [a, b] = term.between;
        let (ab, ba) = ((a * terms.species + b) as u32, (b * terms.species + a) as u32);
        let range = term.potential.range();
        let mut found = 0;
        let aside = &mut block.aside;
        for k in from..to {
            let r = aside.all[k];
            let acts = !SEVERAL || aside.kind[k] == ab || aside.kind[k] == ba;
            aside.place[found] = k as u32;
            aside.r[found] = r;
            found += (acts && r < range) as usize;
        }
        term.potential.block(&aside.r[..found], &mut aside.phi[..found], &mut aside.slope[..found]);
        for n in 0..found {
            let k = aside.place[n] as usize;
            block.conservative[k] = T::of(block.conservative[k].wide() - aside.slope[n]);
            if let Some(tally) = &mut tally {
                let i = block.members[slot + block.which[k] as usize] as usize;
                tally.pair += aside.phi[n] * swept.share(i, block.j[k] as usize);
            }
        }
    }
}
