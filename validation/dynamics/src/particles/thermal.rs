use chacha20::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Draws velocities of particles of masses `mass` from Maxwell's distribution, with zero total momentum in the `conserved`
/// directions. The velocities are not scaled: their temperature fluctuates as that of a canonical ensemble.
pub fn maxwell(
    mass: impl Iterator<Item = f64>,
    kt: f64,
    dimensions: usize,
    conserved: [bool; 3],
    random: &mut ChaCha8Rng,
) -> Vec<[f64; 3]> {
    let (mut momentum, mut total) = ([0.0; 3], 0.0);
    let draw = |m: f64| {
        let mut v = [0.0; 3];
        for c in 0..dimensions {
            let normal: f64 = StandardNormal.sample(random);
            v[c] = (kt / m).sqrt() * normal;
            momentum[c] += m * v[c];
        }
        total += m;
        v
    };
    let mut v: Vec<[f64; 3]> = mass.map(draw).collect();
    for v in &mut v {
        for c in (0..dimensions).filter(|c| conserved[*c]) {
            v[c] -= momentum[c] / total;
        }
    }
    v
}
