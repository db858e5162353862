use crate::integrator::Coupling;
use crate::run::error::RunError;
use crate::run::simulation::{Heat, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::thermostat::Stream;

impl Coupling {
    /// Acts on velocities, if it is its turn.
    pub(super) fn act(self, system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
        if !system.step_number().is_multiple_of(self.every) {
            return Ok(());
        }
        let time = dt * self.every as f64;
        system.heat(Heat { update: self.update, noise: self.noise, time, stream: Stream(0) }, want, dt)
    }
}
