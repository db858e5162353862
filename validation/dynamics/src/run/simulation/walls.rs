//! Friction and noise of walls.
//!
//! [`WallBath`] relaxes the velocity of each particle to that of the wall, exactly at fixed positions. It acts at the end of every
//! step, whatever the integrator: as it leaves the distribution of positions and velocities as it is, a step behind it, or half of it
//! before and half behind, have the same errors.

use super::{RunError, Simulation};
use psidpd_core::engine::pair_sums::COMPONENTS;
use psidpd_core::engine::{Face, Step, WallBath, Want, faces};
use psidpd_observe::flux::{Drag, Line};
use std::sync::Arc;

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
        let step = Step { seed: self.seed, number: self.number, dt };
        let bath = WallBath::new(step, self.kt());
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
        let mut given = vec![[0.0; 4]; forces.engine.plan().walls().len()];
        for (k, v) in before.into_iter().enumerate().filter(|(k, _)| moves(*k)) {
            let mut v = v;
            for face in &faces {
                let Some([after, lost]) = act(k, face, v) else { continue };
                let per_time = state.mass[state.species[k] as usize] / dt;
                let force: [f64; 3] = std::array::from_fn(|c| per_time * (after[c] - v[c]));
                let of_drag = lost.map(|lost| -per_time * lost);
                let (z, normal) = (face.place.distance(&state.x[k]), face.place.normal(&state.x[k]));
                let d = normal.map(|n| z * n);
                for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
                    virial[c] += 0.5 * (d[a] * force[b] + d[b] * force[a]);
                    drag[c] += 0.5 * (d[a] * of_drag[b] + d[b] * of_drag[a]);
                }
                (0..3).for_each(|c| given[face.index][c] -= force[c]);
                given[face.index][3] += (0..3).map(|c| normal[c] * force[c]).sum::<f64>();
                lines.push(Line { from: state.x[k], d, f: of_drag });
                v = after;
            }
        }
        particles.put_velocities(v);
        self.motion.wall_virial = virial;
        if recording {
            let friction = if self.records_lines() { lines } else { Vec::new() };
            self.record_friction(Arc::new(Drag { sum: drag, friction, ..Drag::default() }), &given);
        }
        Ok(())
    }

    /// Whether a wall moves.
    pub fn has_moving_walls(&self) -> bool {
        self.engine().plan().walls().iter().any(|wall| wall.wall.velocity != [0.0; 3])
    }

    /// The directions along which the total momentum is conserved: frozen particles and the friction of walls break all conservation,
    /// faces that of the direction across them, and so do round surfaces.
    pub(super) fn conserved(&self) -> [bool; 3] {
        let (free, surfaces) = (self.frozen().is_empty() && !self.rubs(), self.engine().plan().walls());
        let round = |c: usize| surfaces.iter().any(|w| w.wall.surface.round().is_some_and(|r| r.across[c]));
        let periodic = self.particles.now().domain.periodic();
        std::array::from_fn(|c| free && periodic[c] && !round(c))
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
