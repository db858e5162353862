//! The conservative forces on the particles, for observables.
//!
//! A run whose thermostat is apart from the forces has them; others compute them besides, with the engine that they have.

use super::{RunError, Simulation};
use psidpd_core::engine::Precision;

/// Where the conservative forces are that were computed last.
#[derive(Debug, Default)]
pub(super) struct Conservative {
    /// The positions, by number, at which the forces of the run were conservative.
    present: Option<u64>,
    /// Forces that were computed besides, and their positions.
    besides: Vec<[f64; 3]>,
    of_besides: Option<u64>,
}

impl Conservative {
    /// Notes that the forces of the run are conservative at these positions.
    pub fn are_present(&mut self, positions: u64) {
        self.present = Some(positions);
    }
}

impl Simulation {
    /// Finds the conservative forces for observables that sum over the pairs of particles, where these can; others evaluate forces
    /// themselves. Trajectories, totals and counts do not depend on it.
    pub fn find_conservative_forces(&mut self) -> Result<(), RunError> {
        let all_move = self.external.frozen.is_empty();
        let is_periodic = self.particles.now().domain.periodic()[..self.dimensions()].iter().all(|is| *is);
        let sums = all_move && is_periodic && self.forces.has_particle_sums;
        let is_mixed = self.settings().precision == Precision::Mixed;
        if !(sums && is_mixed) || self.known_conservative_forces().is_some() {
            return Ok(());
        }
        let Simulation { particles, forces, conservative, number, .. } = self;
        conservative.besides.resize(particles.now().len(), [0.0; 3]);
        conservative.of_besides = None;
        forces.compute_besides(particles.now(), *number, &mut conservative.besides)?;
        conservative.of_besides = Some(particles.moves());
        Ok(())
    }

    /// The conservative forces at the present positions, if they are known.
    pub(in crate::run) fn known_conservative_forces(&self) -> Option<&[[f64; 3]]> {
        let (now, Conservative { present, besides, of_besides }) =
            (Some(self.particles.moves()), &self.conservative);
        let has_others = self.thermostat.in_forces == Some(true)
            || !self.external.frozen.is_empty()
            || self.has_body_forces();
        match (*present == now && !has_others, *of_besides == now) {
            (true, _) => Some(self.forces()),
            (_, true) => Some(besides),
            _ => None,
        }
    }
}
