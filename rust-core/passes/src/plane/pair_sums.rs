//! Sums over the listed pairs of a plane.

use super::list::{ExactPair, Pair, PairList};
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

/// Computes `Σ_j g (g·(p_i − p_j) − a ξ)` for every particle `i`, with the opposite term of the pair for `j`; without noise,
/// `a = 0`, it does not read `xi`. `p` and `sums` have entries for the particles of the plane, followed by those of the next.
///
/// # Safety
/// Both arrays have entries for all particles of the list.
///
/// # Panics
/// Panics if there is noise and `xi` has not an entry for each pair.
pub unsafe fn add_pairs(
    set: InstructionSet,
    list: &PairList,
    xi: &[f32],
    noise: f64,
    p: &[Wide],
    sums: &mut [Wide],
) {
    match list.exact.is_empty() {
        true => add(set, AddPairs { start: &list.start, pairs: &list.pairs, xi, noise, p, sums }),
        false => add(set, AddPairs { start: &list.start, pairs: &list.exact, xi, noise, p, sums }),
    }
}

fn add<P: Entry>(set: InstructionSet, task: AddPairs<P>) {
    // SAFETY: `InstructionSet` guarantees the instructions, the caller of `add_pairs` the particles.
    unsafe {
        match task.noise == 0.0 {
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
        // SAFETY: it is a reference. The read is volatile: otherwise the compiler loads it together with `g`, and extracts it.
        unsafe { (&raw const self.j).read_volatile() as usize }
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
    noise: f64,
    p: &'a [Wide],
    sums: &'a mut [Wide],
}

struct WithNoise<'a, P, const NOISE: bool>(AddPairs<'a, P>);

impl<P: Entry, const NOISE: bool> Kernel for WithNoise<'_, P, NOISE> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let AddPairs { start, pairs, xi, noise, p, sums } = self.0;
        assert!(p.len() >= start.len() - 1 && sums.len() >= start.len() - 1, "particles of the list");
        assert!(!NOISE || xi.len() >= pairs.len(), "noise of the pairs");
        sums.fill(Wide::ZERO);
        let (p, sums) = (p.as_ptr(), sums.as_mut_ptr());
        // SAFETY: `start` has indices of pairs, and these have particles that the arrays contain.
        unsafe {
            let (minus_noise, first) = (I::Quad::splat(-noise), pairs.as_ptr());
            let (mut next, mut xi) = (first, xi.as_ptr());
            for (i, end) in start.iter().skip(1).enumerate() {
                let end = first.add(*end as usize);
                let at = I::Quad::load(p.add(i).cast());
                let mut sum = I::Quad::load(sums.add(i).cast());
                // Two pairs at once share the additions across elements.
                while next.wrapping_add(1) < end {
                    let (a, b) = (&*next, &*next.add(1));
                    let (j_a, j_b) = (a.j(), b.j());
                    let (g_a, g_b) = (a.g::<I>(), b.g::<I>());
                    let d_a = at.sub(I::Quad::load(p.add(j_a).cast()));
                    let d_b = at.sub(I::Quad::load(p.add(j_b).cast()));
                    let [mut along_a, mut along_b] = d_a.mul(g_a).totals(d_b.mul(g_b));
                    if NOISE {
                        along_a = I::Quad::splat_f32(*xi).mul_add(minus_noise, along_a);
                        along_b = I::Quad::splat_f32(*xi.add(1)).mul_add(minus_noise, along_b);
                        xi = xi.add(2);
                    }
                    sum = along_a.mul_add(g_a, sum);
                    push_away::<I>(along_a, g_a, sums.add(j_a));
                    sum = along_b.mul_add(g_b, sum);
                    push_away::<I>(along_b, g_b, sums.add(j_b));
                    next = next.add(2);
                }
                if next < end {
                    let (j, g) = ((*next).j(), (*next).g::<I>());
                    let d = at.sub(I::Quad::load(p.add(j).cast()));
                    let [mut along, _] = d.mul(g).totals(I::Quad::zero());
                    if NOISE {
                        along = I::Quad::splat_f32(*xi).mul_add(minus_noise, along);
                        xi = xi.add(1);
                    }
                    sum = along.mul_add(g, sum);
                    push_away::<I>(along, g, sums.add(j));
                    next = next.add(1);
                }
                sum.store(sums.add(i).cast());
            }
        }
    }
}

/// Subtracts `along g` from the sum of a particle.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
unsafe fn push_away<I: Isa>(along: I::Quad, g: I::Quad, sum: *mut Wide) {
    // SAFETY: the caller promises a particle.
    unsafe { along.neg_mul_add(g, I::Quad::load(sum.cast())).store(sum.cast()) };
}
