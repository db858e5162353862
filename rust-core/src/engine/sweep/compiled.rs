//! The passes, compiled for each instruction set and precision; chosen once.

use super::arithmetic::{Arithmetic, Double, DoubleRecord, Mixed, MixedRecord};
use super::block::Block;
use super::layer::{Swept, first_pass};
use super::many_body::{NearPairs, second_pass};
use super::settings::Instructions;
use super::simd::Portable;
use crate::engine::tally::Tally;

/// A first pass.
pub type First<T, R> = unsafe fn(&Swept<T, R>, usize, &mut Block<T>, &mut NearPairs<T>) -> Tally;
/// A second pass.
pub type Second<T, R> = unsafe fn(&Swept<T, R>, usize, &NearPairs<T>, &mut [f64; 6]);

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
            unsafe fn first<A: Arithmetic<$isa>, const SEVERAL: bool, const TALLY: bool>(
                swept: &Swept<A::Scalar, A::Record>,
                layer: usize,
                block: &mut Block<A::Scalar>,
                near: &mut NearPairs<A::Scalar>,
            ) -> Tally {
                // SAFETY: the caller's; the features are here.
                unsafe { first_pass::<$isa, A, SEVERAL, TALLY>(swept, layer, block, near) }
            }

            $(#[target_feature(enable = $features)])?
            unsafe fn second<A: Arithmetic<$isa>, const SEVERAL: bool, const TALLY: bool>(
                swept: &Swept<A::Scalar, A::Record>,
                layer: usize,
                near: &NearPairs<A::Scalar>,
                virial: &mut [f64; 6],
            ) {
                // SAFETY: the caller's; the features are here.
                unsafe { second_pass::<$isa, A, SEVERAL, TALLY>(swept, layer, near, virial) }
            }

            pub fn passes<A: Arithmetic<$isa>>(several: bool) -> Passes<A::Scalar, A::Record> {
                if several {
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
compile!(avx2, super::super::simd::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
#[cfg(target_arch = "x86_64")]
compile!(
    avx512,
    super::super::simd::Avx512,
    "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);

/// A precision, and its passes on each instruction set.
pub trait Compiled: Send + Sync + Sized + 'static {
    /// What pairs are computed in.
    type Scalar: super::simd::Scalar;
    /// What is kept of a particle.
    type Record: super::arithmetic::Record;
    /// The passes; `instructions` must be available.
    fn passes(instructions: Instructions, several: bool) -> Passes<Self::Scalar, Self::Record>;
}

macro_rules! precision {
    ($precision:ty, $scalar:ty, $record:ty) => {
        impl Compiled for $precision {
            type Scalar = $scalar;
            type Record = $record;

            fn passes(instructions: Instructions, several: bool) -> Passes<$scalar, $record> {
                match instructions {
                    #[cfg(target_arch = "x86_64")]
                    Instructions::Avx512 => avx512::passes::<$precision>(several),
                    #[cfg(target_arch = "x86_64")]
                    Instructions::Avx2 => avx2::passes::<$precision>(several),
                    _ => portable::passes::<$precision>(several),
                }
            }
        }
    };
}

precision!(Mixed, f32, MixedRecord);
precision!(Double, f64, DoubleRecord);
