//! Noise and drag of a vector of pairs.

use super::arithmetic::Pairs;
use super::simd::{Reals, Scalar, Words};
use super::terms::{Drag, Exponent};
use crate::engine::noise::{PAIR_ROUNDS, PARITY, PairNoise, ROTATIONS};

/// `√3/2³¹`: signed words to numbers of unit variance.
pub const UNIT: f64 = 1.732_050_807_568_877_2 / 2_147_483_648.0;

const _: () = assert!(PAIR_ROUNDS == 13);

/// Words of noise of `count` pairs: Threefry2x32 of their two tags, in order. They replace the first tags;
/// runs over by two vectors.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn draw<W: Words>(noise: PairNoise, a: *mut u32, b: *const u32, count: usize) {
    // SAFETY: the caller's.
    unsafe {
        let [k0, k1] = noise.key();
        let schedule = [W::splat(k0), W::splat(k1), W::splat(PARITY ^ k0 ^ k1)];
        let mut k = 0;
        while k < count {
            // Two vectors by turns: one alone waits for itself.
            let (a0, b0) = (W::load(a.add(k)), W::load(b.add(k)));
            let (a1, b1) = (W::load(a.add(k + W::LANES)), W::load(b.add(k + W::LANES)));
            let mut x0 = [a0.min(b0).add(schedule[0]), a1.min(b1).add(schedule[0])];
            let mut x1 = [a0.max(b0).add(schedule[1]), a1.max(b1).add(schedule[1])];
            // Written out: rotations by constants are one instruction.
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = inject(x0, x1, &schedule, 1);
            (x0, x1) = four_rounds(x0, x1, 4);
            (x0, x1) = inject(x0, x1, &schedule, 2);
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = inject(x0, x1, &schedule, 3);
            // Of the last round only the first word is of use.
            let sign = W::splat(0x8000_0000);
            x0[0].add(x1[0]).xor(sign).store(a.add(k));
            x0[1].add(x1[1]).xor(sign).store(a.add(k + W::LANES));
            k += 2 * W::LANES;
        }
    }
}

/// Four rounds of Threefry from round `at` of eight on.
#[inline(always)]
unsafe fn four_rounds<W: Words>(x0: [W; 2], x1: [W; 2], at: usize) -> ([W; 2], [W; 2]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let (x0, x1) = round(x0, x1, ROTATIONS[at]);
        let (x0, x1) = round(x0, x1, ROTATIONS[at + 1]);
        let (x0, x1) = round(x0, x1, ROTATIONS[at + 2]);
        round(x0, x1, ROTATIONS[at + 3])
    }
}

#[inline(always)]
unsafe fn round<W: Words>([a0, b0]: [W; 2], [a1, b1]: [W; 2], by: u32) -> ([W; 2], [W; 2]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let x0 = [a0.add(a1), b0.add(b1)];
        let turned = [a1.rotate(by), b1.rotate(by)];
        (x0, [turned[0].xor(x0[0]), turned[1].xor(x0[1])])
    }
}

/// The injection of the key behind four rounds.
#[inline(always)]
unsafe fn inject<W: Words>(x0: [W; 2], x1: [W; 2], schedule: &[W; 3], number: usize) -> ([W; 2], [W; 2]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let first = schedule[number % 3];
        let second = schedule[(number + 1) % 3].add(W::splat(number as u32));
        ([x0[0].add(first), x0[1].add(first)], [x1[0].add(second), x1[1].add(second)])
    }
}

impl<T: Scalar> Drag<T> {
    /// `−γ w_R² (ê·v) + σ w_R ξ dt^{−1/2}`; `xi` is `ξ dt^{−1/2}`.
    #[inline(always)]
    pub unsafe fn force<R: Reals<Scalar = T>, const SEVERAL: bool>(&self, pairs: &Pairs<R>, xi: R) -> R {
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
            let pull = kind.of::<SEVERAL>(&self.sigma) * xi
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
