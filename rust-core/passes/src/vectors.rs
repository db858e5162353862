//! Loops over plain numbers, which the compiler vectorises for each instruction set.

use crate::instruction_set::InstructionSet;
use crate::simd::{self, Isa, Kernel};

/// A loop that the compiler vectorises. No operation is contracted or reordered, so that the results
/// have the same bits on every instruction set.
pub trait Loop {
    type Out;
    /// Runs the loop. Implementations must be inlined: other functions are compiled for the compiler's target.
    fn run(self) -> Self::Out;
}

struct AnySet<L>(L);

impl<L: Loop> Kernel for AnySet<L> {
    type Out = L::Out;

    #[inline(always)]
    unsafe fn run<I: Isa>(self) -> L::Out {
        self.0.run()
    }
}

/// Runs a loop as compiled for an instruction set.
#[inline(always)]
pub fn run<L: Loop>(set: InstructionSet, work: L) -> L::Out {
    // SAFETY: a loop is safe code, so that it has no contract.
    unsafe { simd::run(set, AnySet(work)) }
}

/// Runs a loop as compiled for the best instruction set of the processor.
#[inline(always)]
pub fn run_best<L: Loop>(work: L) -> L::Out {
    run(InstructionSet::best(), work)
}

/// A whole number from 0 to 2²³ − 1 as an integer; others give some integer in that range. Vectors do this and not a cast, which is exact
/// for all numbers. Sums of 2²³ and such a number hold it in their lowest bits.
#[inline(always)]
pub fn integer(number: f32) -> u32 {
    (number + 8_388_608.0).to_bits() & 0x007f_ffff
}

#[cfg(test)]
mod tests {
    use super::integer;

    #[test]
    fn whole_numbers_are_integers() {
        for number in (0..1 << 23).step_by(4099).chain([1, (1 << 23) - 1]) {
            assert_eq!(integer(number as f32), number);
        }
    }
}
