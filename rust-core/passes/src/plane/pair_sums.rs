//! Sums over the listed pairs of a plane.

use super::list::{Entry, Listed, PairList};
use super::listed_noise::{Drawn, ListedNoise};
use crate::instruction_set::InstructionSet;
use crate::simd::{Isa, Kernel, Quad, prefetch, run};
use std::ops::Range;

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

/// The noise of sums over pairs.
#[derive(Debug, Clone, Copy)]
pub struct Noise<'a> {
    pub amplitude: f64,
    pub of_pairs: ListedNoise<'a>,
}

/// Computes `Σ_j g (g·(p_i − p_j) − a ξ)` for every particle `i` of a plane, perhaps with `noise` of the amplitude `a`.
///
/// A pair of two owned particles adds the opposite to the sum of `j`; ghosts have no sums. `all` has a vector for each sorted
/// particle; of those from `first` on, `sums` has entries for the particles of the plane, followed by those of the next. `drawn` is
/// scratch for noise.
///
/// # Safety
/// The arrays have entries for all particles of the lists, those of the noise too.
///
/// # Panics
/// Panics if pairs with ghosts are not in double precision.
pub unsafe fn add_pairs(
    set: InstructionSet,
    lists: &Listed,
    noise: Option<Noise>,
    all: &[Wide],
    first: usize,
    sums: &mut [Wide],
    drawn: &mut Drawn,
) {
    let p = &all[first..];
    let Listed { own, with_ghosts } = lists;
    match own.exact.is_empty() {
        true => add::<_, true>(set, own, &own.pairs, noise, [p, p], sums, drawn),
        false => add::<_, true>(set, own, &own.exact, noise, [p, p], sums, drawn),
    }
    if with_ghosts.start.last().is_some_and(|end| *end > 0) {
        add::<_, false>(set, with_ghosts, &with_ghosts.exact, noise, [p, all], sums, drawn);
    }
}

/// Sums over the pairs of owned particles, with `BOTH`, or adds those with ghosts; `p` has the vectors of first and of second particles.
fn add<P: Entry, const BOTH: bool>(
    set: InstructionSet,
    list: &PairList,
    pairs: &[P],
    noise: Option<Noise>,
    p: [&[Wide]; 2],
    sums: &mut [Wide],
    drawn: &mut Drawn,
) {
    let (start, count) = (&list.start[..], list.particles());
    assert!(pairs.len() == start.last().map_or(0, |end| *end as usize), "pairs in this precision");
    let Some(Noise { amplitude, of_pairs }) = noise.filter(|_| count > 0) else {
        let task = AddPairs { start, particles: 0..count, pairs, xi: &[], noise: 0.0, p, sums };
        // SAFETY: `InstructionSet` guarantees the instructions, the caller of `add_pairs` the particles.
        return unsafe { run(set, WithNoise::<P, BOTH, false>(task)) };
    };
    let mut from = 0;
    while from < count {
        let enough = start[from].saturating_add(DRAWN);
        let to = from + 1 + start[from + 1..count].partition_point(|end| *end < enough);
        // SAFETY: the caller of `add_pairs` promises tags of the particles.
        unsafe { of_pairs.draw(list, from..to, drawn) };
        let (particles, xi, sums) = (from..to, &drawn.xi[..], &mut *sums);
        let task = AddPairs { start, particles, pairs, xi, noise: amplitude, p, sums };
        // SAFETY: as above.
        unsafe { run(set, WithNoise::<P, BOTH, true>(task)) };
        from = to;
    }
}

/// Number of pairs whose noise is drawn at once.
const DRAWN: u32 = 1024;

/// Bytes of the list that are asked for ahead of the present pair. The list of 50 000 particles does not fit into the caches of
/// a core; there the midpoint rule takes 20 % less time with it, and with 6 000 particles as much as without.
const AHEAD: usize = 2048;

/// Pairs of some of the particles of a list; `xi` has their noise.
struct AddPairs<'a, P> {
    start: &'a [u32],
    particles: Range<usize>,
    pairs: &'a [P],
    xi: &'a [f32],
    noise: f64,
    p: [&'a [Wide]; 2],
    sums: &'a mut [Wide],
}

/// With `BOTH` the sums begin at zero before the first particle, and the opposite is added to second particles.
struct WithNoise<'a, P, const BOTH: bool, const NOISE: bool>(AddPairs<'a, P>);

impl<P: Entry, const BOTH: bool, const NOISE: bool> Kernel for WithNoise<'_, P, BOTH, NOISE> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let AddPairs { start, particles, pairs, xi, noise, p, sums } = self.0;
        assert!(p[0].len() >= particles.end && sums.len() >= particles.end, "particles of the list");
        let ends = &start[particles.start..particles.end + 1];
        let of_these = (ends[ends.len() - 1] - ends[0]) as usize;
        assert!(!NOISE || xi.len() >= of_these, "noise of the pairs");
        if BOTH && particles.start == 0 {
            sums.fill(Wide::ZERO);
        }
        let ([p, second], sums) = (p.map(<[Wide]>::as_ptr), sums.as_mut_ptr());
        // SAFETY: `start` has indices of pairs, and these have particles that the arrays contain.
        unsafe {
            let (minus_noise, first) = (I::Quad::splat(-noise), pairs.as_ptr());
            let (mut next, mut xi) = (first.add(ends[0] as usize), xi.as_ptr());
            for (i, end) in particles.zip(&ends[1..]) {
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
