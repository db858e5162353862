use super::near::Near;
use crate::scene::shape::Shape;
use chacha20::ChaCha8Rng;
use rand::RngExt;

/// Number of attempts at a position before a region counts as full.
const ATTEMPTS: usize = 2000;

/// Draws a uniform point of `shape`.
pub fn point(shape: &Shape, dimensions: usize, random: &mut ChaCha8Rng) -> [f64; 3] {
    let [low, high] = shape.bounds(dimensions);
    loop {
        let x = std::array::from_fn(|k| low[k] + (high[k] - low[k]) * random.random::<f64>());
        if shape.contains(x, dimensions) {
            return x;
        }
    }
}

/// Draws a uniform point of `shape` that is close to no point of `near`; if none is found, the error holds the last attempt.
pub fn point_apart(
    shape: &Shape,
    dimensions: usize,
    near: &Near,
    random: &mut ChaCha8Rng,
) -> Result<[f64; 3], [f64; 3]> {
    let mut x = point(shape, dimensions, random);
    for _ in 1..ATTEMPTS {
        if !near.is_close(x) {
            return Ok(x);
        }
        x = point(shape, dimensions, random);
    }
    if near.is_close(x) { Err(x) } else { Ok(x) }
}
