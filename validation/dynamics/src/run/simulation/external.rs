//! Frozen particles and body forces, which act on the fluid from outside.

use super::Simulation;
use super::particles::Particles;
use crate::particles::{BodyForce, Tags};
use psidpd_core::engine::Pool;

#[derive(Debug, Clone)]
pub(super) struct External {
    frozen_tags: Tags,
    /// Whether each particle is frozen; empty if none is.
    pub frozen: Vec<bool>,
    /// Sum of the forces on the frozen particles in the last evaluation.
    pub support_force: [f64; 3],
    pub body_forces: Vec<BodyForce>,
}

impl External {
    pub fn none() -> External {
        let frozen_tags = Tags::none();
        External { frozen_tags, frozen: Vec::new(), support_force: [0.0; 3], body_forces: Vec::new() }
    }

    /// Finds the frozen particles by their tags, because reordering moves them, and sets their velocities to zero.
    pub fn find_frozen(&mut self, particles: &mut Particles) {
        self.frozen.clear();
        if self.frozen_tags.is_empty() {
            return;
        }
        self.frozen.extend(particles.now().tag.iter().map(|tag| self.frozen_tags.contain(*tag)));
        if !self.frozen.contains(&true) {
            self.frozen.clear();
        }
        self.clear_frozen(particles.velocities_mut());
    }

    pub fn clear_frozen(&self, vectors: &mut [[f64; 3]]) {
        for (vector, _) in vectors.iter_mut().zip(&self.frozen).filter(|(_, frozen)| **frozen) {
            *vector = [0.0; 3];
        }
    }

    /// Adds body forces, and sets all forces on frozen particles to zero, so that no integrator moves them.
    pub fn add_forces(&mut self, particles: &mut Particles, pool: &Pool) {
        let (state, force) = particles.forces_mut();
        if !self.body_forces.is_empty() {
            pool.parts(force, |first, force| {
                for (k, sum) in (first..).zip(force) {
                    let species = state.species[k];
                    let mass = state.mass[species as usize];
                    for body in self.body_forces.iter().filter(|body| body.acts_on(species, state.tag[k])) {
                        let acceleration = body.at(&state.domain, state.x[k]);
                        (0..3).for_each(|c| sum[c] += mass * acceleration[c]);
                    }
                }
            });
        }
        self.support_force = [0.0; 3];
        for (force, _) in force.iter_mut().zip(&self.frozen).filter(|(_, frozen)| **frozen) {
            for (sum, f) in self.support_force.iter_mut().zip(std::mem::take(force)) {
                *sum += f;
            }
        }
    }
}

impl Simulation {
    pub(super) fn add_external_forces(&mut self) {
        self.external.add_forces(&mut self.particles, self.forces.engine.pool());
    }

    /// Freezes exactly the particles of these tags: they stay at rest and act on the others. Temperature and
    /// momentum exclude them.
    pub fn set_frozen(&mut self, tags: &Tags) {
        self.external.frozen_tags = tags.clone();
        self.external.find_frozen(&mut self.particles);
    }

    pub fn frozen(&self) -> &[bool] {
        &self.external.frozen
    }

    pub fn mobile(&self) -> usize {
        self.len() - self.frozen().iter().filter(|frozen| **frozen).count()
    }

    /// The sum of all forces on the frozen particles in the last evaluation, which their support must balance.
    pub fn support_force(&self) -> [f64; 3] {
        self.external.support_force
    }

    /// Sets the body forces, from the next evaluation of forces on.
    pub fn set_body_forces(&mut self, forces: &[BodyForce]) {
        self.external.body_forces = forces.to_vec();
    }

    pub fn has_body_forces(&self) -> bool {
        !self.external.body_forces.is_empty()
    }
}
