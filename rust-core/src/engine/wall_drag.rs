//! Drag and noise of a particle against the matter of a wall.
//!
//! The drag is a tensor of friction that depends on the distance from the surface. At fixed positions it makes the velocity relax to
//! that of the wall: an Ornstein–Uhlenbeck process of each particle by itself, whose solution
//!
//! ```text
//! v′ = V + c (v − V) + √((1 − c²) kT/m) ξ,    c = exp(−ζ Δt/m)
//! ```
//!
//! along the surface, across it and around a cylinder is exact and keeps the Maxwell distribution at any Δt.

use super::noise::{PairNoise, normal, threefry2x32};
use super::step::Step;
use super::walls::{Face, Place};

/// The stream of the noise of walls, which no thermostat of pairs has.
const STREAM: u16 = 1 << 15;

/// Rounds of the generator, the fewest that pass BigCrush.
const ROUNDS: usize = 13;

/// The noise and the temperature of an action of walls.
#[derive(Debug, Clone, Copy)]
pub struct WallBath {
    key: [u32; 2],
    kt: f64,
    dt: f64,
}

impl WallBath {
    /// The action at the end of a `step`. Its noise depends on the seed, the step, the wall's index and the particle's tag alone.
    pub fn new(step: Step, kt: f64) -> WallBath {
        WallBath { key: PairNoise::of_stream(step.seed, step.number, STREAM).key(), kt, dt: step.dt }
    }

    /// The velocity behind the action of a wall on a particle at `x` with the velocity `v`, and the velocity lost by drag alone;
    /// `None` out of its range.
    pub fn act(
        &self,
        face: &Face,
        (x, species, tag): (&[f64; 3], i32, i32),
        mass: f64,
        dimensions: usize,
        v: [f64; 3],
    ) -> Option<[[f64; 3]; 2]> {
        let friction = face.wall.fields.get(species as usize)?.friction.as_ref()?;
        let z = face.place.distance(x);
        if z >= friction.range() {
            return None;
        }
        // What is lost along the surface, across it and around it, and the width of the noise.
        let of_axes = friction.at(z).map(|zeta| {
            let lost = -(-zeta * self.dt / mass).exp_m1();
            [lost, (lost * (2.0 - lost) * self.kt / mass).sqrt()]
        });
        let wall = &face.wall.wall;
        let xi = |c: usize| {
            let counter = [tag as u32, (3 * face.index + c) as u32];
            f64::from(normal(threefry2x32::<ROUNDS>(counter, self.key)))
        };
        let (mut after, mut lost) = (v, [0.0; 3]);
        match face.place {
            Place::Face { axis, .. } => {
                for c in 0..dimensions {
                    let [part, width] = of_axes[usize::from(c == axis)];
                    lost[c] = part * (v[c] - wall.velocity[c]);
                    after[c] = v[c] - lost[c] + width * xi(c);
                }
            }
            Place::Round { round, .. } => {
                let n = face.place.normal(x);
                let mut e = [0.0; 3];
                round.axis(dimensions).into_iter().for_each(|axis| e[axis] = 1.0);
                // The tensor with these components, times a vector.
                let times = |k: usize, vector: [f64; 3]| {
                    let dot = |a: [f64; 3]| a[0] * vector[0] + a[1] * vector[1] + a[2] * vector[2];
                    let [along, across, around] = of_axes.map(|component| component[k]);
                    let (by_n, by_e) = ((across - around) * dot(n), (along - around) * dot(e));
                    std::array::from_fn(|c| around * vector[c] + by_n * n[c] + by_e * e[c])
                };
                let inside = |f: &dyn Fn(usize) -> f64| {
                    std::array::from_fn(|c| if c < dimensions { f(c) } else { 0.0 })
                };
                lost = times(0, inside(&|c| v[c] - wall.velocity[c]));
                let noise: [f64; 3] = times(1, inside(&xi));
                after = std::array::from_fn(|c| v[c] - lost[c] + noise[c]);
            }
        }
        Some([after, lost])
    }
}
