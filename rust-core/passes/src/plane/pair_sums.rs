//! Sums over the listed pairs of a plane.

use super::list::{ExactPair, Listed, Pair, PairList};
use crate::instruction_set::InstructionSet;
use crate::simd::{Isa, Kernel, Quad, prefetch, run};

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

/// Computes `Σ_j g (g·(p_i − p_j) − a ξ)` for every particle `i` of a plane, without noise if `a = 0`.
///
/// A pair of two owned particles adds the opposite to the sum of `j`; ghosts have no sums. `all` has a vector for each sorted
/// particle; of those from `first` on, `sums` has entries for the particles of the plane, followed by those of the next.
///
/// # Safety
/// The arrays have entries for all particles of the lists.
///
/// # Panics
/// Panics if there is noise that has not been drawn for all pairs, and if pairs with ghosts are not in double precision.
pub unsafe fn add_pairs(
    set: InstructionSet,
    lists: &Listed,
    noise: f64,
    all: &[Wide],
    first: usize,
    sums: &mut [Wide],
) {
    let p = &all[first..];
    let Listed { own, with_ghosts } = lists;
    match own.exact.is_empty() {
        true => add::<_, true>(set, own, &own.pairs, noise, [p, p], sums),
        false => add::<_, true>(set, own, &own.exact, noise, [p, p], sums),
    }
    if with_ghosts.start.last().is_some_and(|end| *end > 0) {
        add::<_, false>(set, with_ghosts, &with_ghosts.exact, noise, [p, all], sums);
    }
}

/// Sums over the pairs of owned particles, with `BOTH`, or adds those with ghosts; `p` has the vectors of first and of second particles.
fn add<P: Entry, const BOTH: bool>(
    set: InstructionSet,
    PairList { start, xi, .. }: &PairList,
    pairs: &[P],
    noise: f64,
    p: [&[Wide]; 2],
    sums: &mut [Wide],
) {
    assert!(pairs.len() == start.last().map_or(0, |end| *end as usize), "pairs in this precision");
    let task = AddPairs { start, pairs, xi, noise, p, sums };
    // SAFETY: `InstructionSet` guarantees the instructions, the caller of `add_pairs` the particles.
    unsafe {
        match noise == 0.0 {
            true => run(set, WithNoise::<P, BOTH, false>(task)),
            false => run(set, WithNoise::<P, BOTH, true>(task)),
        }
    }
}

/// Bytes of the list that are asked for ahead of the present pair. The list of 50 000 particles does not fit into the caches of
/// a core; there the midpoint rule takes 20 % less time with it, and with 6 000 particles as much as without.
const AHEAD: usize = 2048;

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
        ExactPair::j(self) as usize
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
    p: [&'a [Wide]; 2],
    sums: &'a mut [Wide],
}

/// With `BOTH` the sums begin at zero, and the opposite is added to second particles.
struct WithNoise<'a, P, const BOTH: bool, const NOISE: bool>(AddPairs<'a, P>);

impl<P: Entry, const BOTH: bool, const NOISE: bool> Kernel for WithNoise<'_, P, BOTH, NOISE> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let AddPairs { start, pairs, xi, noise, p, sums } = self.0;
        assert!(p[0].len() >= start.len() - 1 && sums.len() >= start.len() - 1, "particles of the list");
        assert!(!NOISE || xi.len() >= pairs.len(), "noise of the pairs");
        if BOTH {
            sums.fill(Wide::ZERO);
        }
        let ([p, second], sums) = (p.map(<[Wide]>::as_ptr), sums.as_mut_ptr());
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
                    prefetch(next.wrapping_byte_add(AHEAD));
                    let (j_a, j_b) = (a.j(), b.j());
                    let (g_a, g_b) = (a.g::<I>(), b.g::<I>());
                    let d_a = at.sub(I::Quad::load(second.add(j_a).cast()));
                    let d_b = at.sub(I::Quad::load(second.add(j_b).cast()));
                    let [mut along_a, mut along_b] = d_a.mul(g_a).totals(d_b.mul(g_b));
                    if NOISE {
                        along_a = I::Quad::splat_f32(*xi).mul_add(minus_noise, along_a);
                        along_b = I::Quad::splat_f32(*xi.add(1)).mul_add(minus_noise, along_b);
                        xi = xi.add(2);
                    }
                    sum = along_a.mul_add(g_a, sum);
                    if BOTH {
                        push_away::<I>(along_a, g_a, sums.add(j_a));
                    }
                    sum = along_b.mul_add(g_b, sum);
                    if BOTH {
                        push_away::<I>(along_b, g_b, sums.add(j_b));
                    }
                    next = next.add(2);
                }
                if next < end {
                    let (j, g) = ((*next).j(), (*next).g::<I>());
                    let d = at.sub(I::Quad::load(second.add(j).cast()));
                    let [mut along, _] = d.mul(g).totals(I::Quad::zero());
                    if NOISE {
                        along = I::Quad::splat_f32(*xi).mul_add(minus_noise, along);
                        xi = xi.add(1);
                    }
                    sum = along.mul_add(g, sum);
                    if BOTH {
                        push_away::<I>(along, g, sums.add(j));
                    }
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
