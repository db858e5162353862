use crate::integrator::Coupling;
use crate::run::error::RunError;
use crate::run::simulation::{Heat, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::thermostat::Stream;

impl Coupling {
    /// Its action in the present step of `dt`, if it is its turn.
    fn heat(self, system: &Simulation, dt: f64) -> Option<Heat> {
        let time = dt * self.every as f64;
        let heat = Heat { update: self.update, noise: self.noise, time, stream: Stream(0) };
        system.step_number().is_multiple_of(self.every).then_some(heat)
    }

    /// Announces that it will act, if it is its turn, where the next forces are computed.
    pub(super) fn announce(self, system: &mut Simulation, dt: f64, want: Want) {
        if let Some(heat) = self.heat(system, dt) {
            system.expect_heat(heat, want);
        }
    }

    pub(super) fn act(self, system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
        self.heat(system, dt).map_or(Ok(()), |heat| system.heat(heat, want, dt))
    }
}
