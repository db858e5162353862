//! Drag and noise of a particle against the matter of a wall.
//!
//! The drag is a tensor of friction that depends on the distance from the face. At fixed positions it makes the velocity relax to
//! that of the wall: an Ornstein–Uhlenbeck process of each particle by itself, whose solution
//!
//! ```text
//! v′ = V + c (v − V) + √((1 − c²) kT/m) ξ,    c = exp(−ζ Δt/m)
//! ```
//!
//! along the face and across it is exact and keeps the Maxwell distribution at any Δt.

use super::noise::{PairNoise, normal, threefry2x32};
use super::step::Step;
use super::walls::Face;

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
        let z = face.distance(x);
        if z >= friction.range() {
            return None;
        }
        // What is lost along the face and across it, and the width of the noise.
        let of_axes = friction.at(z).map(|zeta| {
            let lost = -(-zeta * self.dt / mass).exp_m1();
            [lost, (lost * (2.0 - lost) * self.kt / mass).sqrt()]
        });
        let wall = &face.wall.wall;
        let (mut after, mut lost) = (v, [0.0; 3]);
        for c in 0..dimensions {
            let [part, width] = of_axes[usize::from(c == wall.axis)];
            let counter = [tag as u32, (3 * face.index + c) as u32];
            let xi = f64::from(normal(threefry2x32::<ROUNDS>(counter, self.key)));
            lost[c] = part * (v[c] - wall.velocity[c]);
            after[c] = v[c] - lost[c] + width * xi;
        }
        Some([after, lost])
    }
}
