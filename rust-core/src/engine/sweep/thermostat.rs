//! Noise and drag of a vector of pairs.

use super::arithmetic::Pairs;
use super::simd::{Reals, Scalar, Words};
use super::terms::{Drag, Exponent};
use crate::engine::noise::{PAIR_ROUNDS, PARITY, PairNoise, ROTATIONS};

/// The key of a step's noise, and `dt^{-1/2}`.
#[derive(Clone, Copy)]
pub struct Draw<R: Reals> {
    schedule: [R::Words; 3],
    unit: R,
}

/// `√3/2³¹`: signed words to numbers of unit variance.
const UNIT: f64 = 1.732_050_807_568_877_2 / 2_147_483_648.0;

const _: () = assert!(PAIR_ROUNDS == 13);

impl<R: Reals> Draw<R> {
    #[inline(always)]
    pub unsafe fn new((noise, inverse_root_dt): (PairNoise, f64)) -> Draw<R> {
        let [k0, k1] = noise.key();
        // SAFETY: the contract of `simd`.
        unsafe {
            Draw {
                schedule: [R::Words::splat(k0), R::Words::splat(k1), R::Words::splat(PARITY ^ k0 ^ k1)],
                unit: R::constant(UNIT * inverse_root_dt),
            }
        }
    }

    /// `ξ dt^{-1/2}` of each pair: Threefry2x32 of the two tags, in order.
    #[inline(always)]
    pub unsafe fn noise(&self, [a, b]: [R::Words; 2]) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut x0 = a.min(b).add(self.schedule[0]);
            let mut x1 = a.max(b).add(self.schedule[1]);
            // Written out: rotations by constants are one instruction.
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = self.inject(x0, x1, 1);
            (x0, x1) = four_rounds(x0, x1, 4);
            (x0, x1) = self.inject(x0, x1, 2);
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = self.inject(x0, x1, 3);
            // Of the last round only the first word is of use.
            let word = x0.add(x1).xor(R::Words::splat(0x8000_0000));
            (R::of_signed(word) + R::constant(0.5)) * self.unit
        }
    }

    /// The injection of the key behind four rounds.
    #[inline(always)]
    unsafe fn inject(&self, x0: R::Words, x1: R::Words, number: usize) -> (R::Words, R::Words) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let x1 = x1.add(self.schedule[(number + 1) % 3]).add(R::Words::splat(number as u32));
            (x0.add(self.schedule[number % 3]), x1)
        }
    }
}

impl<T: Scalar> Drag<T> {
    /// `−γ w_R² (ê·v) + σ w_R ξ dt^{−1/2}`.
    #[inline(always)]
    pub unsafe fn force<R: Reals<Scalar = T>, const SEVERAL: bool>(&self, pairs: &Pairs<R>) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let kind = pairs.kind;
            let t = (one - pairs.apart.r * kind.of::<SEVERAL>(&self.inverse_range)).larger(zero);
            let w = match &self.exponent {
                Exponent::One => t,
                Exponent::Two => t * t,
                Exponent::Any(exponent) => power(t, kind.of::<SEVERAL>(exponent)),
            };
            let pull = kind.of::<SEVERAL>(&self.sigma) * pairs.noise
                - kind.of::<SEVERAL>(&self.gamma) * w * pairs.apart.along;
            w * pull
        }
    }
}

/// `t^e` where `t` is above zero, zero elsewhere.
#[inline(always)]
unsafe fn power<R: Reals>(t: R, exponent: R) -> R {
    let (mut bases, mut exponents) = ([R::Scalar::default(); 16], [R::Scalar::default(); 16]);
    // SAFETY: no vector has more lanes.
    unsafe {
        t.store(bases.as_mut_ptr());
        exponent.store(exponents.as_mut_ptr());
    }
    powers(&mut bases[..R::LANES], &exponents);
    // SAFETY: as above.
    unsafe { R::load(bases.as_ptr()) }
}

#[inline(never)]
fn powers<T: Scalar>(bases: &mut [T], exponents: &[T]) {
    for (t, e) in bases.iter_mut().zip(exponents) {
        let base = t.wide();
        *t = T::of(if base > 0.0 { base.powf(e.wide()) } else { 0.0 });
    }
}

/// Four rounds of Threefry from round `at` of eight on.
#[inline(always)]
unsafe fn four_rounds<W: Words>(mut x0: W, mut x1: W, at: usize) -> (W, W) {
    // SAFETY: the contract of `simd`.
    unsafe {
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 1]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 2]).xor(x0);
        x0 = x0.add(x1);
        x1 = x1.rotate(ROTATIONS[at + 3]).xor(x0);
    }
    (x0, x1)
}
