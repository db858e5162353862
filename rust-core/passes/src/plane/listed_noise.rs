//! The noise of listed pairs.

use super::list::PairList;
use crate::instruction_set::InstructionSet;
use crate::noise::{Law, PairNoise, normal, thirteen_rounds};
use crate::simd::{Isa, Kernel, run};

impl PairNoise {
    /// The noise of each pair of tags `a[k]`, `b[k]`, in single precision: the same bits on every instruction set.
    pub fn fill(&self, law: Law, a: &[u32], b: &[u32], xi: &mut [f32]) {
        // SAFETY: the kernel requires the instruction set only, which `InstructionSet::best` has found.
        unsafe { run(InstructionSet::best(), Fill { noise: *self, law, a, b, xi }) }
    }
}

impl PairList {
    /// Draws the noise of the pairs.
    pub fn draw(&mut self, noise: PairNoise, law: Law) {
        let PairList { tags: [a, b], xi, .. } = self;
        xi.resize(a.len(), 0.0);
        noise.fill(law, a, b, xi);
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
