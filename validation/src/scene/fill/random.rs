use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Uniform points between the corners `low` and `high`.
pub fn fractions(count: usize, low: [f64; 3], high: [f64; 3], random: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    (0..count)
        .map(|_| std::array::from_fn(|k| low[k] + (high[k] - low[k]) * random.random::<f64>()))
        .collect()
}
