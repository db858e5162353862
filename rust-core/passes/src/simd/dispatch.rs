//! Kernels, run on the instruction set that was found.

use super::Isa;
use super::portable::Portable;
use crate::instruction_set::InstructionSet;
#[cfg(target_arch = "x86_64")]
use crate::settings::Instructions;

/// A piece of work that is written once for all instruction sets.
pub trait Kernel {
    type Out;
    /// Whether it is compiled with VBMI2 too, because it compresses bytes; what does not is compiled once for AVX-512.
    const VBMI2: bool = false;

    /// The work, to be inlined always: what is not is compiled for the compiler's target.
    ///
    /// # Safety
    /// The processor has the instruction set, and what the kernel says of itself.
    unsafe fn run<I: Isa>(self) -> Self::Out;
}

/// Runs a kernel as compiled for an instruction set.
///
/// # Safety
/// What the kernel says of itself.
#[inline(always)]
pub unsafe fn run<K: Kernel>(set: InstructionSet, kernel: K) -> K::Out {
    match set.instructions() {
        // SAFETY: there is an `InstructionSet` only of what the processor has; the rest the caller promises.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512Vbmi2 if K::VBMI2 => unsafe { avx512_vbmi2(kernel) },
        // SAFETY: there is an `InstructionSet` only of what the processor has; the rest the caller promises.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512Vbmi2 | Instructions::Avx512 => unsafe { avx512(kernel) },
        // SAFETY: there is an `InstructionSet` only of what the processor has; the rest the caller promises.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2(kernel) },
        // SAFETY: every processor has it; the rest the caller promises.
        _ => unsafe { portable(kernel) },
    }
}

#[inline(never)]
unsafe fn portable<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: every processor has it; the rest the caller promises.
    unsafe { kernel.run::<Portable>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx2<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: the processor has the features of this function; the rest the caller promises.
    unsafe { kernel.run::<super::avx2::Avx2>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx512<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: the processor has the features of this function; the rest the caller promises.
    unsafe { kernel.run::<super::avx512::Avx512<false>>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx512_vbmi2<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: the processor has the features of this function; the rest the caller promises.
    unsafe { kernel.run::<super::avx512::Avx512<true>>() }
}
