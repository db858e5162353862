//! Density waves of particles, computed for several particles at a time.
//!
//! Phases are computed in double precision and multiplied in single, so that each particle's part is rounded to some 10⁻⁷.

use psidpd_core::engine::Pool;
use psidpd_core::engine::vectors::{self as loops, Loop};
use std::f64::consts::TAU;
use std::ops::{Add, Mul, Sub};

/// The sum `ρ(h) = Σ exp(2πi h·s)` over particles at fractions `s` of the box, real and imaginary part, for each `h` of
/// `vectors`. The first component of each `h` must not be negative.
pub fn waves(pool: &Pool, fractions: impl Iterator<Item = [f64; 3]>, vectors: &[[i32; 3]]) -> Vec<[f64; 2]> {
    let axes = [0, 1, 2].map(|c| Axis::new(vectors.iter().map(|h| h[c])));
    let places: Vec<[Place; 3]> = vectors.iter().map(|h| [0, 1, 2].map(|c| axes[c].place(h[c]))).collect();
    let fractions: Vec<[f64; 3]> = fractions.collect();
    // The blocks and the order of their sum do not depend on the number of threads.
    let mut blocks: Vec<_> =
        fractions.chunks(BLOCK).map(|block| (block, vec![[[0.0; LANES]; 2]; vectors.len()])).collect();
    pool.each(&mut blocks, |(block, waves)| {
        loops::run_best(AddWaves { particles: block, axes: &axes, vectors: &places, waves });
    });
    let mut sums = vec![[0.0; 2]; vectors.len()];
    for (_, waves) in &blocks {
        for (sum, wave) in sums.iter_mut().zip(waves) {
            (0..2).for_each(|k| sum[k] += wave[k].iter().map(|lane| f64::from(*lane)).sum::<f64>());
        }
    }
    sums
}

/// The number of particles in a block, which one thread takes at a time.
const BLOCK: usize = 1024;

/// The number of particles in a vector.
const LANES: usize = 16;

/// The number of vectors whose contributions to a wave are added before they are stored.
const GROUPS: usize = 8;

/// The real and the imaginary part of one complex number for each particle.
type Complex<T = f32> = [[T; LANES]; 2];

/// The components of wave vectors along one direction.
enum Axis {
    /// All up to this one.
    UpTo(usize),
    /// These: few of all, as the box is very long.
    Some(Vec<u32>),
}

/// The index of a phase, and −1 for its conjugate, else 1; 0 where the phase is 1.
type Place = (usize, f32);

/// Largest component for which the phases of all smaller ones are computed.
const TABLE: usize = 4096;

impl Axis {
    fn new(components: impl Iterator<Item = i32>) -> Axis {
        let mut all: Vec<u32> = components.map(i32::unsigned_abs).collect();
        let top = all.iter().copied().max().unwrap_or(0) as usize;
        if top <= TABLE {
            return Axis::UpTo(top);
        }
        all.sort_unstable();
        all.dedup();
        Axis::Some(all)
    }

    fn place(&self, h: i32) -> Place {
        let size = h.unsigned_abs();
        let index = match self {
            Axis::UpTo(_) => size as usize,
            Axis::Some(all) => all.partition_point(|other| *other < size),
        };
        (index, h.signum() as f32)
    }
}

/// The phases `exp(2πi h s_c)` of some particles, for each direction c and each h of its axis; 0 in unused lanes.
struct Phases([Vec<Complex>; 3]);

impl Phases {
    #[inline(always)]
    fn new(particles: &[[f64; 3]], [a, b, c]: &[Axis; 3]) -> Phases {
        Phases([along(a, particles, 0), along(b, particles, 1), along(c, particles, 2)])
    }
}

#[inline(always)]
fn along(axis: &Axis, particles: &[[f64; 3]], c: usize) -> Vec<Complex> {
    let top = match axis {
        Axis::UpTo(top) => *top,
        Axis::Some(all) => {
            let phase = |h: &u32| {
                let mut phase = [[0.0; LANES]; 2];
                for (k, s) in particles.iter().enumerate() {
                    (phase[1][k], phase[0][k]) = (TAU * (f64::from(*h) * s[c]).fract()).sin_cos();
                }
                single(&phase)
            };
            return all.iter().map(phase).collect();
        }
    };
    let [mut first, mut power] = [[[0.0; LANES]; 2]; 2];
    for (k, s) in particles.iter().enumerate() {
        (first[1][k], first[0][k]) = (TAU * s[c]).sin_cos();
        power[0][k] = 1.0;
    }
    let mut powers = Vec::with_capacity(top + 1);
    powers.push(single(&power));
    for _ in 0..top {
        power = times(&power, &first, 1.0);
        powers.push(single(&power));
    }
    powers
}

#[inline(always)]
fn single(phase: &Complex<f64>) -> Complex {
    phase.map(|part| part.map(|x| x as f32))
}

/// The product `a b`, or `a b*` if `sign` is −1.
#[inline(always)]
fn times<T>(a: &Complex<T>, b: &Complex<T>, sign: T) -> Complex<T>
where
    T: Copy + Default + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    let mut product = [[T::default(); LANES]; 2];
    for k in 0..LANES {
        let imaginary = sign * b[1][k];
        product[0][k] = a[0][k] * b[0][k] - a[1][k] * imaginary;
        product[1][k] = a[0][k] * imaginary + a[1][k] * b[0][k];
    }
    product
}

/// Adds the contributions of particles to the wave of each vector.
struct AddWaves<'a> {
    particles: &'a [[f64; 3]],
    axes: &'a [Axis; 3],
    vectors: &'a [[Place; 3]],
    waves: &'a mut [Complex],
}

impl Loop for AddWaves<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let AddWaves { particles, axes, vectors, waves } = self;
        let mut groups: Vec<Phases> = Vec::with_capacity(GROUPS);
        for particles in particles.chunks(LANES * GROUPS) {
            groups.clear();
            for group in particles.chunks(LANES) {
                groups.push(Phases::new(group, axes));
            }
            for ([(a, _), (b, sign_b), (c, sign_c)], wave) in vectors.iter().zip(&mut *waves) {
                let mut sum = *wave;
                for Phases([first, second, third]) in &groups {
                    let mut product = times(&first[*a], &second[*b], *sign_b);
                    // In the plane there is no third factor.
                    if *sign_c != 0.0 {
                        product = times(&product, &third[*c], *sign_c);
                    }
                    for part in 0..2 {
                        for k in 0..LANES {
                            sum[part][k] += product[part][k];
                        }
                    }
                }
                *wave = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};
    use std::num::NonZeroUsize;

    #[test]
    fn waves_are_sums_of_exponentials() {
        let mut random = StdRng::seed_from_u64(5);
        let fractions: Vec<[f64; 3]> = (0..2 * BLOCK + 3).map(|_| random.random()).collect();
        // The last ones are of a box so long that only some components occur.
        let vectors = [[0, 0, 1], [0, 3, -2], [1, -4, 0], [5, 2, 7], [10_000_000, 0, -1], [5_000, -1, 1]];
        let [alone, three] = [1, 3].map(|n| Pool::new(NonZeroUsize::new(n).unwrap()));
        let found = waves(&alone, fractions.iter().copied(), &vectors);
        assert_eq!(waves(&three, fractions.iter().copied(), &vectors), found);
        for (h, found) in vectors.iter().zip(found) {
            let phase = |s: &[f64; 3]| TAU * (0..3).map(|c| f64::from(h[c]) * s[c]).sum::<f64>();
            let expected = [f64::cos, f64::sin].map(|f| fractions.iter().map(|s| f(phase(s))).sum::<f64>());
            let tolerance = 1e-5 + 1e-12 * f64::from(h[0]);
            assert!(
                (0..2).all(|k| (found[k] - expected[k]).abs() < tolerance),
                "{h:?}: {found:?} {expected:?}"
            );
        }
        assert_eq!(waves(&three, std::iter::empty(), &vectors), [[0.0; 2]; 6]);
    }
}
