//! Counter-based pair noise: a number for each (seed, step, lower tag, higher tag), whoever asks.
//!
//! No state is carried from pair to pair, so the noise does not depend on the order of pairs, on
//! ranks, on threads or on the skin, and both hosts draw the same numbers. The generator is
//! Threefry-2x32 (Salmon, Moraes, Dror and Shaw, SC'11): twenty rounds make one key for each step,
//! thirteen rounds (the fewest that pass BigCrush) one number for each pair under that key. For a
//! fixed seed Threefry permutes its counters, so no two steps share a key and, within a step, no two
//! pairs share a counter.

pub(super) const ROTATIONS: [u32; 8] = [13, 15, 26, 6, 17, 29, 16, 24];
pub(super) const PARITY: u32 = 0x1BD1_1BDA;

/// Rounds of the number of a pair.
pub(super) const PAIR_ROUNDS: usize = 13;

/// Threefry-2x32 of `ROUNDS` rounds.
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

/// The noise of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairNoise {
    key: [u32; 2],
}

impl PairNoise {
    /// The noise of step `step` under `seed`.
    pub fn new(seed: u64, step: u64) -> PairNoise {
        let split = |x: u64| [x as u32, (x >> 32) as u32];
        PairNoise { key: threefry2x32::<20>(split(step), split(seed)) }
    }

    /// The key of the pairs of this step.
    pub(super) fn key(&self) -> [u32; 2] {
        self.key
    }

    /// `ξ_ij = ξ_ji`: zero mean, unit variance, uniform on (−√3, √3).
    ///
    /// A uniform number serves as well as a Gaussian one: only its first two moments enter the
    /// fluctuation–dissipation relation, and a sum over neighbours is near Gaussian anyway.
    #[inline(always)]
    pub fn xi(&self, tag_i: u32, tag_j: u32) -> f64 {
        let word = threefry2x32::<PAIR_ROUNDS>([tag_i.min(tag_j), tag_i.max(tag_j)], self.key)[0];
        // (word + 1/2) / 2^31 − 1 lies symmetrically in (−1, 1), so the mean is exactly zero.
        const SQRT_3: f64 = 1.732_050_807_568_877_2;
        (word as f64 + 0.5) * (SQRT_3 / (1u64 << 31) as f64) - SQRT_3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known answers published with Random123.
    #[test]
    fn known_answers() {
        let zero = [0, 0];
        let ones = [u32::MAX, u32::MAX];
        let (pi_counter, pi_key) = ([0x243f6a88, 0x85a308d3], [0x13198a2e, 0x03707344]);
        assert_eq!(threefry2x32::<13>(zero, zero), [0x9d1c5ec6, 0x8bd50731]);
        assert_eq!(threefry2x32::<13>(ones, ones), [0xfd36d048, 0x2d17272c]);
        assert_eq!(threefry2x32::<13>(pi_counter, pi_key), [0xba3e4725, 0xf27d669e]);
        assert_eq!(threefry2x32::<20>(zero, zero), [0x6b200159, 0x99ba4efe]);
        assert_eq!(threefry2x32::<20>(ones, ones), [0x1cb996fc, 0xbb002be7]);
        assert_eq!(threefry2x32::<20>(pi_counter, pi_key), [0xc4923a9c, 0x483df7a0]);
    }

    #[test]
    fn symmetric_in_the_pair_and_different_for_every_part_of_the_key() {
        let noise = PairNoise::new(7, 11);
        assert_eq!(noise.xi(3, 5), noise.xi(5, 3));
        assert_ne!(noise.xi(3, 5), noise.xi(3, 6));
        assert_ne!(noise.xi(3, 5), PairNoise::new(7, 12).xi(3, 5));
        assert_ne!(noise.xi(3, 5), PairNoise::new(8, 11).xi(3, 5));
        assert_ne!(noise.xi(3, 5), PairNoise::new(7 | 1 << 40, 11).xi(3, 5));
        assert_ne!(noise.xi(3, 5), PairNoise::new(7, 11 | 1 << 40).xi(3, 5));
    }

    /// Correlation of two series of unit-variance numbers, in standard deviations of its own
    /// distribution under independence.
    fn correlation_in_sigmas(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0f64);
        for (a, b) in pairs {
            sum += a * b;
            count += 1.0;
        }
        sum / count.sqrt()
    }

    /// Mean, variance and the correlations that a bad key would show. Twelve numbers, each standard
    /// normal if the noise is what it should be; |z| < 5 fails by chance once in 1.4·10⁵ runs, and
    /// the seed is fixed.
    #[test]
    fn moments_and_independence_of_steps_tags_and_seeds() {
        let seed = 20_031;
        let n = 40_000u32;
        let now = PairNoise::new(seed, 1000);
        let next = PairNoise::new(seed, 1001);
        let other_seed = PairNoise::new(seed + 1, 1000);
        let draws: Vec<f64> = (1..=n).map(|t| now.xi(t, t + 1)).collect();
        let count = n as f64;
        let mean: f64 = draws.iter().sum::<f64>() / count;
        let variance: f64 = draws.iter().map(|x| x * x).sum::<f64>() / count;
        let fourth: f64 = draws.iter().map(|x| x.powi(4)).sum::<f64>() / count;
        // Var(ξ²) = 9/5 − 1; Var(ξ⁴) = 9 − 81/25 for the uniform law of unit variance.
        let mut z = vec![
            mean * count.sqrt(),
            (variance - 1.0) * (count / 0.8).sqrt(),
            (fourth - 1.8) * (count / 5.76).sqrt(),
        ];
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(t, t + 1), next.xi(t, t + 1)))));
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(t, t + 1), now.xi(t, t + 2)))));
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(t, t + 1), now.xi(t + 1, t + 2)))));
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(t, t + 7), other_seed.xi(t, t + 7)))));
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(t, n), next.xi(t + 1, n)))));
        z.push(correlation_in_sigmas((1..=n).map(|t| (now.xi(2 * t, 5), now.xi(2 * t + 1, 5)))));
        // Over steps, for one pair: what Brownian motion sees.
        let at = |s: u64| PairNoise::new(seed, s).xi(17, 4711);
        for lag in 1..=3 {
            z.push(correlation_in_sigmas((0..n as u64).map(|s| (at(s), at(s + lag)))));
        }
        for (k, z) in z.iter().enumerate() {
            assert!(z.abs() < 5.0, "statistic {k}: {z} standard deviations, seed {seed}");
        }
    }
}
