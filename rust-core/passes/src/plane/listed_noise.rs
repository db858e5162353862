//! The noise of listed pairs, which is drawn where it is read: a pair in memory would have one more number for it, and two for tags.

use super::list::{Entry, PairList};
use crate::instruction_set::InstructionSet;
use crate::noise::{Law, PairNoise, normal, thirteen_rounds};
use crate::simd::{Isa, Kernel, Reals, Words, run};
use std::ops::Range;

impl PairNoise {
    /// The noise of each pair of tags `a[k]`, `b[k]`, in single precision: the same bits on every instruction set.
    pub fn fill(&self, law: Law, a: &[u32], b: &[u32], xi: &mut [f32]) {
        // SAFETY: the kernel requires the instruction set only, which `InstructionSet::best` has found.
        unsafe { run(InstructionSet::best(), Fill { noise: *self, law, a, b, xi }) }
    }
}

/// The noise of pairs of sorted particles.
#[derive(Debug, Clone, Copy)]
pub struct ListedNoise<'a> {
    pub noise: PairNoise,
    pub law: Law,
    /// Tag of each sorted particle, and of the copies that lists count as particles.
    pub tags: &'a [u32],
}

/// The most numbers in a vector.
const LANES: usize = 16;

/// The noise of some pairs, followed by unspecified numbers, and tags of the pairs.
#[derive(Debug, Clone, Default)]
pub struct Drawn {
    tags: [Vec<u32>; 2],
    pub xi: Vec<f32>,
}

impl ListedNoise<'_> {
    /// The noise of all pairs of a list, followed by unspecified numbers.
    ///
    /// # Panics
    /// Panics if there are too few tags.
    pub fn of_list(&self, list: &PairList) -> Vec<f32> {
        let mut drawn = Drawn::default();
        let last = (0..list.count()).map(|k| list.second(k)).max();
        assert!(last.is_none_or(|last| list.j_from + last < self.tags.len()), "tags of the particles");
        // SAFETY: there are tags of all second particles.
        unsafe { self.draw(list, 0..list.particles(), &mut drawn) };
        drawn.xi
    }

    /// Draws the noise of the pairs of some particles, counted from the first of the list.
    ///
    /// # Safety
    /// There are tags of all second particles of the pairs.
    ///
    /// # Panics
    /// Panics if there are too few pairs, or too few tags of first particles.
    pub unsafe fn draw(&self, list: &PairList, particles: Range<usize>, drawn: &mut Drawn) {
        if particles.is_empty() {
            return drawn.xi.clear();
        }
        let of_seconds = &self.tags[list.j_from..];
        let of_firsts = &self.tags[list.first + particles.start..list.first + particles.end];
        let start = &list.start[particles.start..particles.end + 1];
        let all = start[0] as usize..start[start.len() - 1] as usize;
        let Drawn { tags: [a, b], xi } = drawn;
        // Whole vectors: noise of what lies behind the last pair takes less time than pairs left over, one by one.
        let room = all.len().next_multiple_of(LANES);
        a.resize(room + LANES, 0);
        b.resize(room, 0);
        xi.resize(room, 0.0);
        // SAFETY: there is room for the pairs and a vector; the caller promises tags.
        unsafe {
            match list.exact.is_empty() {
                true => gather(Gather { start, pairs: &list.pairs[all], of_firsts, of_seconds, a, b }),
                false => gather(Gather { start, pairs: &list.exact[all], of_firsts, of_seconds, a, b }),
            }
        }
        self.noise.fill(self.law, &a[..room], b, xi);
    }
}

/// # Safety
/// `of_seconds` has tags of all second particles of the pairs; `start` has their numbers by particle, and `a` and `b` have room for them,
/// `a` for [`LANES`] more.
unsafe fn gather<P: Entry>(task: Gather<P>) {
    // SAFETY: `InstructionSet::best` has found the instructions; the caller promises the rest.
    unsafe { run(InstructionSet::best(), task) }
}

/// Gathers the tags of both particles of pairs.
struct Gather<'a, P> {
    start: &'a [u32],
    pairs: &'a [P],
    of_firsts: &'a [u32],
    of_seconds: &'a [u32],
    a: &'a mut [u32],
    b: &'a mut [u32],
}

impl<P: Entry> Kernel for Gather<'_, P> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        type W<I> = <<I as Isa>::F32 as Reals>::Words;
        let Gather { start, pairs, of_firsts, of_seconds, a, b } = self;
        let mut a = a.as_mut_ptr();
        // SAFETY: the caller of `gather` promises room and tags.
        unsafe {
            for (ends, tag) in start.windows(2).zip(of_firsts) {
                // A vector at once, of which the next particle overwrites what is too much.
                let (count, tag) = ((ends[1] - ends[0]) as usize, W::<I>::splat(*tag));
                tag.store(a);
                let mut k = W::<I>::LANES;
                while k < count {
                    tag.store(a.add(k));
                    k += W::<I>::LANES;
                }
                a = a.add(count);
            }
            for (b, pair) in b.iter_mut().zip(pairs) {
                *b = *of_seconds.get_unchecked(pair.j());
            }
        }
    }
}

/// A loop that the compiler vectorises.
struct Fill<'a> {
    noise: PairNoise,
    law: Law,
    a: &'a [u32],
    b: &'a [u32],
    xi: &'a mut [f32],
}

impl Kernel for Fill<'_> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let Fill { noise, law, a, b, xi } = self;
        let (key, pairs) = (noise.key(), xi.iter_mut().zip(a).zip(b));
        match law {
            Law::Gaussian => {
                pairs.for_each(|((xi, a), b)| *xi = normal(thirteen_rounds([*a.min(b), *a.max(b)], key)));
            }
            Law::Uniform => pairs.for_each(|((xi, a), b)| *xi = noise.xi(*a, *b) as f32),
        }
    }
}
