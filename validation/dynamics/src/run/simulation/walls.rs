//! Friction and noise of walls.
//!
//! The drag between a particle and the matter of a wall is a tensor of friction that depends on the distance from the face. At
//! fixed positions it makes the velocity relax to that of the wall: an Ornstein–Uhlenbeck process of each particle by itself, whose
//! solution
//!
//! ```text
//! v′ = V + c (v − V) + √((1 − c²) kT/m) ξ,    c = exp(−ζ Δt/m)
//! ```
//!
//! along the face and across it is exact and keeps the Maxwell distribution at any Δt. It acts at the end of every step, whatever
//! the integrator: as it leaves the distribution of positions and velocities as it is, a step behind it, or half of it before and
//! half behind, have the same errors.

use super::{RunError, Simulation};
use psidpd_core::engine::noise::{PairNoise, normal, threefry2x32};
use psidpd_core::engine::pair_sums::COMPONENTS;
use psidpd_core::engine::{Face, Want, faces};
use psidpd_observe::flux::{Drag, Line};
use std::sync::Arc;

/// The stream of the noise of walls, which no thermostat of pairs has.
const STREAM: u16 = 1 << 15;

/// Rounds of the generator, the fewest that pass BigCrush.
const ROUNDS: usize = 13;

/// The noise and the temperature of an action.
#[derive(Clone, Copy)]
struct Bath {
    key: [u32; 2],
    kt: f64,
    dt: f64,
}

impl Bath {
    /// The velocity behind the action of a wall on a particle at `x` with the velocity `v`, and the velocity lost by drag alone;
    /// `None` out of its range.
    fn act(
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

impl Simulation {
    /// Lets drag and noise of walls act for a time `dt`, where the thermostat acts at all.
    pub(super) fn rub(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        self.motion.wall_virial = [0.0; 6];
        if !self.thermostat.on || !self.rubs() {
            return Ok(());
        }
        self.make_deferred_kick()?;
        let (recording, dimensions) = (self.is_recording(), self.dimensions());
        let sums = want.virial || recording;
        let bath =
            Bath { key: PairNoise::of_stream(self.seed, self.number, STREAM).key(), kt: self.kt(), dt };
        let Simulation { particles, external, forces, .. } = self;
        let mut v = particles.take_velocities();
        let state = particles.now();
        let faces = faces(forces.engine.plan().walls(), &state.domain, dimensions);
        let before = sums.then(|| v.clone());
        let moves = |k: usize| external.frozen.get(k) != Some(&true);
        let act = |k: usize, face: &Face, v: [f64; 3]| {
            let species = state.species[k];
            let mass = state.mass[species as usize];
            bath.act(face, (&state.x[k], species, state.tag[k]), mass, dimensions, v)
        };
        forces.engine.pool().parts(&mut v, |first, v| {
            for (k, v) in (first..).zip(v).filter(|(k, _)| moves(*k)) {
                for face in &faces {
                    if let Some([after, _]) = act(k, face, *v) {
                        *v = after;
                    }
                }
            }
        });
        let Some(before) = before else {
            particles.put_velocities(v);
            return Ok(());
        };
        let mut virial = [0.0; 6];
        let (mut drag, mut lines) = ([0.0; 6], Vec::new());
        let mut given = vec![[0.0; 3]; forces.engine.plan().walls().len()];
        for (k, v) in before.into_iter().enumerate().filter(|(k, _)| moves(*k)) {
            let mut v = v;
            for face in &faces {
                let Some([after, lost]) = act(k, face, v) else { continue };
                let per_time = state.mass[state.species[k] as usize] / dt;
                let force: [f64; 3] = std::array::from_fn(|c| per_time * (after[c] - v[c]));
                let of_drag = lost.map(|lost| -per_time * lost);
                let mut d = [0.0; 3];
                d[face.wall.wall.axis] = face.inwards * face.distance(&state.x[k]);
                for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
                    virial[c] += 0.5 * (d[a] * force[b] + d[b] * force[a]);
                    drag[c] += 0.5 * (d[a] * of_drag[b] + d[b] * of_drag[a]);
                }
                (0..3).for_each(|c| given[face.index][c] -= force[c]);
                lines.push(Line { from: state.x[k], d, f: of_drag });
                v = after;
            }
        }
        particles.put_velocities(v);
        self.motion.wall_virial = virial;
        if recording {
            let lines = if self.records_lines() { vec![lines] } else { Vec::new() };
            self.record_friction(Arc::new(Drag { sum: drag, lines }), &given);
        }
        Ok(())
    }

    /// Whether a wall moves.
    pub fn has_moving_walls(&self) -> bool {
        self.engine().plan().walls().iter().any(|wall| wall.wall.velocity != [0.0; 3])
    }

    /// Whether a wall of the box has friction.
    pub(super) fn rubs(&self) -> bool {
        let walls = self.engine().plan().walls();
        let domain = &self.particles.now().domain;
        !walls.is_empty()
            && faces(walls, domain, self.dimensions())
                .iter()
                .any(|face| face.wall.fields.iter().any(|field| field.friction.is_some()))
    }
}
