//! Loops over particles, compiled for the vectors of each instruction set.

use psidpd_passes::instruction_set::InstructionSet;
#[cfg(target_arch = "x86_64")]
use psidpd_passes::settings::Instructions;

/// A loop that the compiler vectorises. No operation is contracted or reordered, so that the results
/// have the same bits on every instruction set.
pub trait Loop {
    type Out;
    /// Runs the loop. Implementations must be inlined: other functions are compiled for the compiler's target.
    fn run(self) -> Self::Out;
}

/// Runs a loop as compiled for an instruction set.
pub fn run<L: Loop>(set: InstructionSet, work: L) -> L::Out {
    match set.instructions() {
        // SAFETY: an `InstructionSet` exists only for instructions of this processor.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 | Instructions::Avx512Vbmi2 => unsafe { avx512(work) },
        // SAFETY: an `InstructionSet` exists only for instructions of this processor.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2(work) },
        _ => work.run(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx2<L: Loop>(work: L) -> L::Out {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx512<L: Loop>(work: L) -> L::Out {
    work.run()
}
