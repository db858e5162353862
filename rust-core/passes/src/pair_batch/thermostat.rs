//! Random and dissipative forces of pairs.

use crate::ground::arithmetic::PairVector;
use crate::ground::species_pairs::{SpeciesPair, SpeciesPairTable, TableLookup};
use crate::ground::terms::{Exponent, ThermostatTables};
use crate::noise::{PAIR_ROUNDS, PARITY, PairNoise, ROTATIONS};
use crate::simd::{Reals, Scalar, Words};

/// The factor `√3/2³¹` turns signed words into numbers of unit variance.
pub const NOISE_UNIT: f64 = 1.732_050_807_568_877_2 / 2_147_483_648.0;

const _: () = assert!(PAIR_ROUNDS == 13);

/// Draws a random word for each of `count` pairs: Threefry2x32 of their two tags in ascending order.
/// The words replace the first tags.
///
/// # Safety
/// The caller fulfils the contract of `simd`. Both arrays have room for two vectors after the last pair.
#[inline(always)]
pub unsafe fn draw<W: Words>(noise: PairNoise, a: *mut u32, b: *const u32, count: usize) {
    // SAFETY: `BatchBuffers::reserve` leaves room for two vectors after the tags of the last pair.
    unsafe {
        let [k0, k1] = noise.key();
        let schedule = [W::splat(k0), W::splat(k1), W::splat(PARITY ^ k0 ^ k1)];
        let mut k = 0;
        while k < count {
            // Two vectors alternate: each hides the latency of the other.
            let (a0, b0) = (W::load(a.add(k)), W::load(b.add(k)));
            let (a1, b1) = (W::load(a.add(k + W::LANES)), W::load(b.add(k + W::LANES)));
            let mut x0 = [a0.min(b0).add(schedule[0]), a1.min(b1).add(schedule[0])];
            let mut x1 = [a0.max(b0).add(schedule[1]), a1.max(b1).add(schedule[1])];
            // The rounds are unrolled: rotations by constants take one instruction.
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = inject(x0, x1, &schedule, 1);
            (x0, x1) = four_rounds(x0, x1, 4);
            (x0, x1) = inject(x0, x1, &schedule, 2);
            (x0, x1) = four_rounds(x0, x1, 0);
            (x0, x1) = inject(x0, x1, &schedule, 3);
            // Only the first word of the last round is used.
            let sign = W::splat(0x8000_0000);
            x0[0].add(x1[0]).xor(sign).store(a.add(k));
            x0[1].add(x1[1]).xor(sign).store(a.add(k + W::LANES));
            k += 2 * W::LANES;
        }
    }
}

/// Four rounds of Threefry, with rotations from number `at`.
#[inline(always)]
unsafe fn four_rounds<W: Words>(x0: [W; 2], x1: [W; 2], at: usize) -> ([W; 2], [W; 2]) {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
    unsafe {
        let (x0, x1) = round(x0, x1, ROTATIONS[at]);
        let (x0, x1) = round(x0, x1, ROTATIONS[at + 1]);
        let (x0, x1) = round(x0, x1, ROTATIONS[at + 2]);
        round(x0, x1, ROTATIONS[at + 3])
    }
}

#[inline(always)]
unsafe fn round<W: Words>([a0, b0]: [W; 2], [a1, b1]: [W; 2], by: u32) -> ([W; 2], [W; 2]) {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
    unsafe {
        let x0 = [a0.add(a1), b0.add(b1)];
        let turned = [a1.rotate(by), b1.rotate(by)];
        (x0, [turned[0].xor(x0[0]), turned[1].xor(x0[1])])
    }
}

/// Adds the key after four rounds.
#[inline(always)]
unsafe fn inject<W: Words>(x0: [W; 2], x1: [W; 2], schedule: &[W; 3], number: usize) -> ([W; 2], [W; 2]) {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
    unsafe {
        let first = schedule[number % 3];
        let second = schedule[(number + 1) % 3].add(W::splat(number as u32));
        ([x0[0].add(first), x0[1].add(first)], [x1[0].add(second), x1[1].add(second)])
    }
}

/// The tables of the thermostat, prepared for a loop over pairs.
pub struct ThermostatForce<'a, R: Reals> {
    gamma: TableLookup<R>,
    sigma: TableLookup<R>,
    weight: ThermostatWeight<'a, R>,
    /// Factor that turns signed random words into `ξ dt^{−1/2}`.
    noise_scale: R,
}

/// The weight `w_R(r) = (1 − r/R)^e`, zero beyond the range, prepared for a loop over pairs.
pub struct ThermostatWeight<'a, R: Reals> {
    inverse_range: TableLookup<R>,
    exponent: Power<'a, R::Scalar>,
}

impl<'a, R: Reals> ThermostatWeight<'a, R> {
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(
        inverse_range: &SpeciesPairTable<R::Scalar>,
        exponent: &'a Exponent<R::Scalar>,
    ) -> ThermostatWeight<'a, R> {
        ThermostatWeight {
            // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
            inverse_range: unsafe { TableLookup::new(inverse_range) },
            exponent: match exponent {
                Exponent::One => Power::One,
                Exponent::Two => Power::Two,
                Exponent::Quarters(quarters) => Power::Quarters(*quarters),
                Exponent::Any(table) => Power::Any(table),
            },
        }
    }

    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn weight<const MULTISPECIES: bool>(&self, r: R, species_pair: SpeciesPair<R>) -> R {
        // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
        unsafe {
            let t = R::constant(1.0) - r * self.inverse_range.lookup::<MULTISPECIES>(species_pair);
            let t = t.larger(R::constant(0.0));
            match self.exponent {
                Power::One => t,
                Power::Two => t * t,
                Power::Quarters(quarters) => of_quarters(t, quarters),
                Power::Any(exponent) => {
                    power(t, TableLookup::<R>::new(exponent).lookup::<MULTISPECIES>(species_pair))
                }
            }
        }
    }
}

/// The exponent of `w_R`, the power of `1 − r/R`.
enum Power<'a, T> {
    One,
    Two,
    Quarters(u8),
    Any(&'a SpeciesPairTable<T>),
}

impl<'a, R: Reals> ThermostatForce<'a, R> {
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(tables: &'a ThermostatTables<R::Scalar>, noise_scale: R) -> Self {
        // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
        unsafe {
            ThermostatForce {
                gamma: TableLookup::new(&tables.gamma),
                sigma: TableLookup::new(&tables.sigma),
                weight: ThermostatWeight::new(&tables.inverse_range, &tables.exponent),
                noise_scale,
            }
        }
    }

    /// The force `−γ w_R² (ê·v) + σ w_R ξ dt^{−1/2}`, with `ξ` from a random word, and its first part alone.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn force<const MULTISPECIES: bool>(&self, pairs: &PairVector<R>, word: R::Words) -> [R; 2] {
        // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
        unsafe {
            let species_pair = pairs.species_pair;
            let w = self.weight.weight::<MULTISPECIES>(pairs.geometry.r, species_pair);
            let xi = (R::of_signed(word) + R::constant(0.5))
                * (self.noise_scale * self.sigma.lookup::<MULTISPECIES>(species_pair));
            let drag = self.gamma.lookup::<MULTISPECIES>(species_pair) * w * pairs.geometry.radial_velocity;
            [w * (xi - drag), R::constant(0.0) - w * drag]
        }
    }
}

/// The power `t^(n/4)` of a number from 0 to 1, from the bits of n.
#[inline(always)]
unsafe fn of_quarters<R: Reals>(t: R, n: u8) -> R {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
    unsafe {
        let mut product = R::constant(1.0);
        if n & 3 != 0 {
            let root = square_root(t);
            if n & 1 != 0 {
                product = square_root(root);
            }
            if n & 2 != 0 {
                product = product * root;
            }
        }
        if n & 4 != 0 {
            product = product * t;
        }
        if n & 24 != 0 {
            let square = t * t;
            if n & 8 != 0 {
                product = product * square;
            }
            if n & 16 != 0 {
                product = product * (square * square);
            }
        }
        product
    }
}

#[inline(always)]
unsafe fn square_root<R: Reals>(t: R) -> R {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
    unsafe { t * t.larger(R::constant(1e-30)).inverse_root() }
}

/// The power `t^e` for positive `t`, else zero, by the library function for each lane.
#[inline(always)]
unsafe fn power<R: Reals>(t: R, exponent: R) -> R {
    let (mut bases, mut exponents) = ([R::Scalar::default(); 16], [R::Scalar::default(); 16]);
    // SAFETY: no vector has more lanes than `bases` has elements.
    unsafe {
        t.store(bases.as_mut_ptr());
        exponent.store(exponents.as_mut_ptr());
    }
    powers(&mut bases[..R::LANES], &exponents);
    // SAFETY: no vector has more than sixteen lanes.
    unsafe { R::load(bases.as_ptr()) }
}

#[inline(never)]
fn powers<T: Scalar>(bases: &mut [T], exponents: &[T]) {
    for (t, e) in bases.iter_mut().zip(exponents) {
        let base = t.wide();
        *t = T::of(if base > 0.0 { base.powf(e.wide()) } else { 0.0 });
    }
}
