//! Counter-based pair noise: a number for each (seed, step, lower tag, higher tag), on any rank.
//!
//! No state is carried from pair to pair, so the noise does not depend on the order of pairs, on
//! ranks, on threads or on the skin, and both hosts draw the same numbers. The generator is
//! Threefry-2x32 (Salmon, Moraes, Dror and Shaw, SC'11): twenty rounds make one key for each step,
//! thirteen rounds (the fewest that pass BigCrush) one number for each pair under that key. For a
//! fixed seed Threefry permutes its counters, so no two steps share a key and, within a step, no two
//! pairs share a counter.

pub const ROTATIONS: [u32; 8] = [13, 15, 26, 6, 17, 29, 16, 24];
pub const PARITY: u32 = 0x1BD1_1BDA;

/// Number of Threefry rounds for a pair.
pub const PAIR_ROUNDS: usize = 13;

/// The Threefry-2x32 generator with `ROUNDS` rounds.
#[inline(always)]
pub fn threefry2x32<const ROUNDS: usize>(counter: [u32; 2], key: [u32; 2]) -> [u32; 2] {
    let schedule = [key[0], key[1], PARITY ^ key[0] ^ key[1]];
    let mut x0 = counter[0].wrapping_add(schedule[0]);
    let mut x1 = counter[1].wrapping_add(schedule[1]);
    for round in 0..ROUNDS {
        x0 = x0.wrapping_add(x1);
        x1 = x1.rotate_left(ROTATIONS[round % 8]) ^ x0;
        if round % 4 == 3 {
            let injection = round / 4 + 1;
            x0 = x0.wrapping_add(schedule[injection % 3]);
            x1 = x1.wrapping_add(schedule[(injection + 1) % 3]).wrapping_add(injection as u32);
        }
    }
    [x0, x1]
}

/// [`threefry2x32`] with thirteen rounds and without a loop, so that a loop around it vectorises.
#[inline(always)]
pub fn thirteen_rounds(counter: [u32; 2], [k0, k1]: [u32; 2]) -> [u32; 2] {
    let k2 = PARITY ^ k0 ^ k1;
    let x = [counter[0].wrapping_add(k0), counter[1].wrapping_add(k1)];
    let x = inject(four_rounds(x, [13, 15, 26, 6]), k1, k2, 1);
    let x = inject(four_rounds(x, [17, 29, 16, 24]), k2, k0, 2);
    let [x0, x1] = inject(four_rounds(x, [13, 15, 26, 6]), k0, k1, 3);
    let x0 = x0.wrapping_add(x1);
    [x0, x1.rotate_left(17) ^ x0]
}

#[inline(always)]
fn four_rounds([a0, a1]: [u32; 2], by: [u32; 4]) -> [u32; 2] {
    let b0 = a0.wrapping_add(a1);
    let b1 = a1.rotate_left(by[0]) ^ b0;
    let c0 = b0.wrapping_add(b1);
    let c1 = b1.rotate_left(by[1]) ^ c0;
    let d0 = c0.wrapping_add(c1);
    let d1 = c1.rotate_left(by[2]) ^ d0;
    let e0 = d0.wrapping_add(d1);
    [e0, d1.rotate_left(by[3]) ^ e0]
}

#[inline(always)]
fn inject([x0, x1]: [u32; 2], first: u32, second: u32, number: u32) -> [u32; 2] {
    [x0.wrapping_add(first), x1.wrapping_add(second).wrapping_add(number)]
}

/// The distribution of the noise of a pair; either has zero mean and unit variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Law {
    /// The normal distribution.
    #[default]
    Gaussian,
    /// The uniform distribution on (−√3, √3).
    Uniform,
}

impl Law {
    /// Names and values of the distributions.
    pub const ALL: [(&str, Law); 2] = [("gaussian", Law::Gaussian), ("uniform", Law::Uniform)];
}

/// The noise of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairNoise {
    key: [u32; 2],
}

impl PairNoise {
    pub fn new(seed: u64, step: u64) -> PairNoise {
        let split = |x: u64| [x as u32, (x >> 32) as u32];
        PairNoise { key: threefry2x32::<20>(split(step), split(seed)) }
    }

    /// One of several independent noises of a step: `stream` 0 is that of [`PairNoise::new`]. Steps are below 2⁴⁸.
    pub fn of_stream(seed: u64, step: u64, stream: u16) -> PairNoise {
        let [low, high] = stream.to_le_bytes().map(u64::from);
        PairNoise::new(seed, step | low << 56 | high << 48)
    }

    /// The key of the pairs of this step.
    pub fn key(&self) -> [u32; 2] {
        self.key
    }

    /// The noise `ξ_ij = ξ_ji`: zero mean, unit variance, uniform on (−√3, √3).
    ///
    /// A uniform number serves as well as a Gaussian one: only its first two moments enter the
    /// fluctuation–dissipation relation, and a sum over neighbours is near Gaussian anyway.
    #[inline(always)]
    pub fn xi(&self, tag_i: u32, tag_j: u32) -> f64 {
        let word = thirteen_rounds([tag_i.min(tag_j), tag_i.max(tag_j)], self.key)[0];
        // The number (word + 1/2) / 2^31 − 1 lies symmetrically in (−1, 1), so that the mean is exactly zero.
        const SQRT_3: f64 = 1.732_050_807_568_877_2;
        (word as f64 + 0.5) * (SQRT_3 / (1u64 << 31) as f64) - SQRT_3
    }
}

/// A normal number from two words, by the transform of Box and Muller; its magnitude is below 5.9.
///
/// Logarithm and cosine are series, exact to single precision, so that a loop vectorises and
/// gives the same bits everywhere.
#[inline(always)]
pub fn normal(words: [u32; 2]) -> f32 {
    use std::f32::consts::{FRAC_PI_2, LN_2};
    // `u` is in (0, 1), and `turn` in (−1, 1).
    let u = ((words[0] >> 8) as i32 as f32 + 0.5) * (1.0 / 16_777_216.0);
    let turn = ((words[1] >> 8) as i32 as f32 + 0.5) * (1.0 / 8_388_608.0) - 1.0;
    // With u = m 2^e and m from √½ to √2, ln m = 2 artanh s.
    let bits = u.to_bits() as i32;
    let e = (bits - std::f32::consts::FRAC_1_SQRT_2.to_bits() as i32) >> 23;
    let m = f32::from_bits((bits - (e << 23)) as u32);
    let s = (m - 1.0) / (m + 1.0);
    let q = s * s;
    let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0))));
    let logarithm = 2.0 * s * series + e as f32 * LN_2;
    // The cosine is cos 2h = 1 − 2 sin² h.
    let h = FRAC_PI_2 * turn;
    let q = h * h;
    let sine = 1.0
        - q * (1.0 / 6.0)
            * (1.0
                - q * (1.0 / 20.0)
                    * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0)))));
    let sine = h * sine;
    (-2.0 * logarithm).max(0.0).sqrt() * (1.0 - 2.0 * sine * sine)
}
