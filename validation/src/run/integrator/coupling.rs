//! The thermostat of the splittings.

use crate::run::error::RunError;
use crate::run::simulation::{Heat, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Stream, Update};

/// Which thermostat a splitting has, and how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// How velocities are changed.
    pub update: Update,
    /// It acts at every so many steps, for as many Δt.
    pub every: u64,
    /// The law of its noise.
    pub noise: Law,
}

/// Names of the updates in scene files.
pub const THERMOSTAT_STEPS: [(&str, Update); 2] =
    [("midpoint", Update::Midpoint), ("pairwise", Update::OrnsteinUhlenbeck)];

impl Coupling {
    /// The midpoint rule at every step.
    pub const DEFAULT: Coupling = Coupling { update: Update::Midpoint, every: 1, noise: Law::Gaussian };

    /// The name of the update.
    pub fn name(&self) -> &'static str {
        THERMOSTAT_STEPS.iter().find(|(_, update)| *update == self.update).map_or("", |found| found.0)
    }

    /// Acts on velocities, if it is its turn.
    pub(super) fn act(self, system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
        if !system.step_number().is_multiple_of(self.every) {
            return Ok(());
        }
        let time = dt * self.every as f64;
        system.heat(Heat { update: self.update, noise: self.noise, time, stream: Stream(0) }, want, dt)
    }
}
