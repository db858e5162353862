//! Sums over the listed pairs of a plane.

use super::list::{ExactPair, Pair, PairList, pairs_of_each};
use crate::instruction_set::InstructionSet;
use crate::simd::{Isa, Kernel, Quad, run};

/// A vector in the size of a register, which no line of the cache ends in; the fourth component is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Wide(pub [f64; 4]);

impl Wide {
    pub const ZERO: Wide = Wide([0.0; 4]);
}

impl std::ops::Deref for Wide {
    type Target = [f64; 4];

    #[inline(always)]
    fn deref(&self) -> &[f64; 4] {
        &self.0
    }
}

impl std::ops::DerefMut for Wide {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; 4] {
        &mut self.0
    }
}

/// Factors of a pair: `a` and `b` of [`add_pairs`].
#[derive(Debug, Clone, Copy)]
pub struct Terms {
    pub noise: f64,
    pub drag: f64,
}

/// Adds `g (a ξ − b g·(p_i − p_j))` to particle `i` of every pair, and subtracts it from `j`. `p` and
/// `sums` have entries for the particles of the plane, followed by those of the next; without noise
/// `xi` is not read. The result has the same bits on every instruction set.
///
/// # Panics
/// Panics if arrays are too short for the list.
pub fn add_pairs(
    set: InstructionSet,
    list: &PairList,
    xi: &[f32],
    terms: Terms,
    p: &[Wide],
    sums: &mut [Wide],
) {
    match list.exact.is_empty() {
        true => add(set, AddPairs { start: &list.start, pairs: &list.pairs, xi, terms, p, sums }),
        false => add(set, AddPairs { start: &list.start, pairs: &list.exact, xi, terms, p, sums }),
    }
}

fn add<P: Entry>(set: InstructionSet, task: AddPairs<P>) {
    // SAFETY: the kernels require the instruction set only, which `InstructionSet` guarantees.
    unsafe {
        match task.terms.noise == 0.0 {
            true => run(set, WithNoise::<P, false>(task)),
            false => run(set, WithNoise::<P, true>(task)),
        }
    }
}

/// A pair in either precision.
trait Entry {
    fn j(&self) -> usize;
    /// The vector `g`, and 0.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    unsafe fn g<I: Isa>(&self) -> I::Quad;
}

impl Entry for Pair {
    #[inline(always)]
    fn j(&self) -> usize {
        self.j as usize
    }

    #[inline(always)]
    unsafe fn g<I: Isa>(&self) -> I::Quad {
        // SAFETY: `j`, which has the same size, follows the three numbers of `g`.
        unsafe { I::Quad::load_three_f32((&raw const *self).cast()) }
    }
}

impl Entry for ExactPair {
    #[inline(always)]
    fn j(&self) -> usize {
        self.j as usize
    }

    #[inline(always)]
    unsafe fn g<I: Isa>(&self) -> I::Quad {
        // SAFETY: `j` follows the three numbers of `g`, and the size of the structure is that of four numbers.
        unsafe { I::Quad::load_three((&raw const *self).cast()) }
    }
}

struct AddPairs<'a, P> {
    start: &'a [u32],
    pairs: &'a [P],
    xi: &'a [f32],
    terms: Terms,
    p: &'a [Wide],
    sums: &'a mut [Wide],
}

struct WithNoise<'a, P, const NOISE: bool>(AddPairs<'a, P>);

impl<P: Entry, const NOISE: bool> Kernel for WithNoise<'_, P, NOISE> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let AddPairs { start, pairs, xi, terms, p, sums } = self.0;
        // With equal lengths one comparison is enough for both arrays.
        let count = p.len().min(sums.len());
        let (p, sums) = (&p[..count], &mut sums[..count]);
        // SAFETY: all loads and stores are at arrays of four numbers.
        unsafe {
            let minus_drag = I::Quad::splat(-terms.drag);
            for (i, of_i) in pairs_of_each(start) {
                let noises = if NOISE { &xi[of_i.clone()] } else { &[] };
                let at = I::Quad::load(p[i].as_ptr());
                let mut sum = I::Quad::zero();
                for (k, pair) in pairs[of_i].iter().enumerate() {
                    let j = pair.j();
                    let g = pair.g::<I>();
                    let along = at.sub(I::Quad::load(p[j].as_ptr())).mul(g).total();
                    let mut factor = minus_drag.mul(along);
                    if NOISE {
                        factor = factor.add(I::Quad::splat(terms.noise * f64::from(noises[k])));
                    }
                    let push = factor.mul(g);
                    sum = sum.add(push);
                    let to = sums[j].as_mut_ptr();
                    I::Quad::load(to).sub(push).store(to);
                }
                let to = sums[i].as_mut_ptr();
                I::Quad::load(to).add(sum).store(to);
            }
        }
    }
}
