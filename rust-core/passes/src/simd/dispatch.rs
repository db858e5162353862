//! Runs kernels on the instruction set of the processor.

use super::Isa;
use super::portable::Portable;
use crate::instruction_set::InstructionSet;
#[cfg(target_arch = "x86_64")]
use crate::settings::Instructions;

/// A piece of work that is written once for all instruction sets.
pub trait Kernel {
    type Out;
    /// Whether the kernel is also compiled with VBMI2, which compresses bytes; other kernels are compiled once for AVX-512.
    const VBMI2: bool = false;

    /// Does the work. Implementations must be inlined: other functions are compiled for the compiler's target.
    ///
    /// # Safety
    /// The processor has the instruction set, and the caller fulfils the contract of the kernel.
    unsafe fn run<I: Isa>(self) -> Self::Out;
}

/// Runs a kernel as compiled for an instruction set.
///
/// # Safety
/// The caller fulfils the contract of the kernel.
#[inline(always)]
pub unsafe fn run<K: Kernel>(set: InstructionSet, kernel: K) -> K::Out {
    match set.instructions() {
        // SAFETY: an `InstructionSet` exists only for instructions of this processor; the caller
        // fulfils the kernel's contract.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512Vbmi2 if K::VBMI2 => unsafe { avx512_vbmi2(kernel) },
        // SAFETY: an `InstructionSet` exists only for instructions of this processor; the caller
        // fulfils the kernel's contract.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512Vbmi2 | Instructions::Avx512 => unsafe { avx512(kernel) },
        // SAFETY: an `InstructionSet` exists only for instructions of this processor; the caller
        // fulfils the kernel's contract.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { avx2(kernel) },
        // SAFETY: every processor has the target's instructions; the caller fulfils the kernel's contract.
        _ => unsafe { portable(kernel) },
    }
}

#[inline(never)]
unsafe fn portable<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: every processor has the target's instructions; the caller fulfils the kernel's contract.
    unsafe { kernel.run::<Portable>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx2<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: `run` calls this only on processors with these features; its caller fulfils the kernel's contract.
    unsafe { kernel.run::<super::avx2::Avx2>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx512<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: `run` calls this only on processors with these features; its caller fulfils the kernel's contract.
    unsafe { kernel.run::<super::avx512::Avx512<false>>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn avx512_vbmi2<K: Kernel>(kernel: K) -> K::Out {
    // SAFETY: `run` calls this only on processors with these features; its caller fulfils the kernel's contract.
    unsafe { kernel.run::<super::avx512::Avx512<true>>() }
}
