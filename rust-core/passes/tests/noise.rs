//! Tests of the noise of pairs: known answers, moments, independence, the normal distribution.

use psidpd_passes::noise::*;

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

/// Correlation of two series of unit-variance numbers, in standard deviations of this estimate for independent series.
fn correlation_in_sigmas(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for (a, b) in pairs {
        sum += a * b;
        count += 1.0;
    }
    sum / count.sqrt()
}

/// Tests mean, variance and the correlations that a bad key would cause. The twelve statistics are standard
/// normal for correct noise; |z| < 5 fails by chance once in 1.4·10⁵ runs, and the seed is fixed.
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
    // For the uniform distribution of unit variance Var(ξ²) = 9/5 − 1 and Var(ξ⁴) = 9 − 81/25.
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
    // The noise of one pair over steps, which Brownian motion depends on.
    let at = |s: u64| PairNoise::new(seed, s).xi(17, 4711);
    for lag in 1..=3 {
        z.push(correlation_in_sigmas((0..n as u64).map(|s| (at(s), at(s + lag)))));
    }
    for (k, z) in z.iter().enumerate() {
        assert!(z.abs() < 5.0, "statistic {k}: {z} standard deviations, seed {seed}");
    }
}

/// Tests mean, variance, skewness, kurtosis and the correlations of normal noise within a step; each
/// statistic is standard normal, and nine of them exceed 5 less than once in 10⁵ runs. The seed is fixed.
#[test]
fn normal_noise_is_normal() {
    let n = 200_000u32;
    let noise = PairNoise::of_stream(20_031, 1000, 1);
    let (a, b): (Vec<u32>, Vec<u32>) = (1..=n).map(|t| (t, t + 1)).unzip();
    let mut xi = vec![0.0; n as usize];
    noise.fill(Law::Gaussian, &a, &b, &mut xi);
    let mut back = vec![0.0; n as usize];
    noise.fill(Law::Gaussian, &b, &a, &mut back);
    assert!(xi == back);
    let count = f64::from(n);
    let moment = |power: i32| xi.iter().map(|x| f64::from(*x).powi(power)).sum::<f64>() / count;
    // The variances of powers of a normal number are (2k − 1)!! − ((k − 1)!!)².
    let mut z = vec![
        moment(1) * count.sqrt(),
        (moment(2) - 1.0) * (count / 2.0).sqrt(),
        moment(3) * (count / 15.0).sqrt(),
        (moment(4) - 3.0) * (count / 96.0).sqrt(),
        (moment(6) - 15.0) * (count / 10170.0).sqrt(),
    ];
    let of = |shift: u32| {
        let (a, b): (Vec<u32>, Vec<u32>) = (1..=n).map(|t| (t, t + shift)).unzip();
        let mut xi = vec![0.0; n as usize];
        noise.fill(Law::Gaussian, &a, &b, &mut xi);
        xi
    };
    // The correlations of ξ_ij with ξ_ik, and with ξ_jk.
    let wide = |x: &f32| f64::from(*x);
    let (second, first) = (of(2), of(1));
    z.push(correlation_in_sigmas(xi.iter().map(wide).zip(second.iter().map(wide))));
    z.push(correlation_in_sigmas(xi.iter().map(wide).zip(first[1..].iter().map(wide))));
    let mut other = vec![0.0; n as usize];
    PairNoise::new(20_031, 1000).fill(Law::Gaussian, &a, &b, &mut other);
    z.push(correlation_in_sigmas(xi.iter().map(wide).zip(other.iter().map(wide))));
    PairNoise::of_stream(20_031, 1001, 1).fill(Law::Gaussian, &a, &b, &mut other);
    z.push(correlation_in_sigmas(xi.iter().map(wide).zip(other.iter().map(wide))));
    for (k, z) in z.iter().enumerate() {
        assert!(z.abs() < 5.0, "statistic {k}: {z} standard deviations");
    }
    noise.fill(Law::Uniform, &a, &b, &mut other);
    assert!((0..n as usize).all(|k| other[k] == noise.xi(a[k], b[k]) as f32));
}

/// Compares with Box and Muller's transform in double precision.
#[test]
fn normal_numbers_are_those_of_the_transform() {
    let mut words = [1u32, 77];
    for _ in 0..10_000 {
        words = threefry2x32::<13>(words, [3, 4]);
        let u = (f64::from(words[0] >> 8) + 0.5) / 16_777_216.0;
        let turn = (f64::from(words[1] >> 8) + 0.5) / 8_388_608.0 - 1.0;
        assert_eq!(thirteen_rounds(words, [8, 9]), threefry2x32::<13>(words, [8, 9]));
        let exact = (-2.0 * u.ln()).sqrt() * (std::f64::consts::PI * turn).cos();
        assert!((f64::from(normal(words)) - exact).abs() < 3e-6, "{} {exact}", normal(words));
    }
    for words in [[0, 0], [u32::MAX, u32::MAX], [u32::MAX, 0], [0, 1 << 31]] {
        assert!(normal(words).abs() < 5.95, "{words:?}");
    }
}
