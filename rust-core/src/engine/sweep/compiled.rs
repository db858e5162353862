//! The passes, compiled for each instruction set and precision; chosen once.

use crate::engine::settings::Instructions;
use crate::engine::sweep::first_pass::first_pass;
use crate::engine::sweep::ground::arithmetic::{Arithmetic, Double, DoubleParticle, Mixed, MixedParticle};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::many_body::in_range_pairs::{InRangePairs, second_pass};
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::simd::Portable;
use crate::engine::tally::Tally;

/// A first pass.
pub type First<T, R> = unsafe fn(&PassData<T, R>, usize, &mut PairBuffers<T>, &mut InRangePairs<T>) -> Tally;
/// A second pass.
pub type Second<T, R> = unsafe fn(&PassData<T, R>, usize, &InRangePairs<T>, &mut [f64; 6]);

/// The passes of one fluid on one instruction set, without and with energies and virials.
#[derive(Clone, Copy)]
pub struct Passes<T, R> {
    pub first: [First<T, R>; 2],
    pub second: [Second<T, R>; 2],
}

/// Wrappers with the features of an instruction set, into which the generic passes are inlined.
macro_rules! compile {
    ($module:ident, $isa:ty $(, $features:literal)?) => {
        mod $module {
            use super::*;

            $(#[target_feature(enable = $features)])?
            unsafe fn first<A: Arithmetic<$isa>, const MULTISPECIES: bool, const TALLY: bool>(
                data: &PassData<A::Scalar, A::PackedParticle>,
                plane: usize,
                buffers: &mut PairBuffers<A::Scalar>,
                in_range: &mut InRangePairs<A::Scalar>,
            ) -> Tally {
                // SAFETY: the caller's; the features are here.
                unsafe { first_pass::<$isa, A, MULTISPECIES, TALLY>(data, plane, buffers, in_range) }
            }

            $(#[target_feature(enable = $features)])?
            unsafe fn second<A: Arithmetic<$isa>, const MULTISPECIES: bool, const TALLY: bool>(
                data: &PassData<A::Scalar, A::PackedParticle>,
                plane: usize,
                in_range: &InRangePairs<A::Scalar>,
                virial: &mut [f64; 6],
            ) {
                // SAFETY: the caller's; the features are here.
                unsafe { second_pass::<$isa, A, MULTISPECIES, TALLY>(data, plane, in_range, virial) }
            }

            pub fn passes<A: Arithmetic<$isa>>(multispecies: bool) -> Passes<A::Scalar, A::PackedParticle> {
                if multispecies {
                    Passes {
                        first: [first::<A, true, false>, first::<A, true, true>],
                        second: [second::<A, true, false>, second::<A, true, true>],
                    }
                } else {
                    Passes {
                        first: [first::<A, false, false>, first::<A, false, true>],
                        second: [second::<A, false, false>, second::<A, false, true>],
                    }
                }
            }
        }
    };
}

compile!(portable, Portable);
#[cfg(target_arch = "x86_64")]
compile!(avx2, crate::engine::sweep::simd::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
#[cfg(target_arch = "x86_64")]
compile!(
    avx512,
    crate::engine::sweep::simd::Avx512,
    "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);

/// A precision, and its passes on each instruction set.
pub trait Compiled: Send + Sync + Sized + 'static {
    /// What pairs are computed in.
    type Scalar: crate::engine::sweep::simd::Scalar;
    /// What is kept of a particle.
    type PackedParticle: crate::engine::sweep::ground::arithmetic::PackedParticle;
    /// The passes; `instructions` must be available.
    fn passes(instructions: Instructions, multispecies: bool) -> Passes<Self::Scalar, Self::PackedParticle>;
}

macro_rules! precision {
    ($precision:ty, $scalar:ty, $record:ty) => {
        impl Compiled for $precision {
            type Scalar = $scalar;
            type PackedParticle = $record;

            fn passes(instructions: Instructions, multispecies: bool) -> Passes<$scalar, $record> {
                match instructions {
                    #[cfg(target_arch = "x86_64")]
                    Instructions::Avx512 => avx512::passes::<$precision>(multispecies),
                    #[cfg(target_arch = "x86_64")]
                    Instructions::Avx2 => avx2::passes::<$precision>(multispecies),
                    _ => portable::passes::<$precision>(multispecies),
                }
            }
        }
    };
}

precision!(Mixed, f32, MixedParticle);
precision!(Double, f64, DoubleParticle);
