use crate::integrator::Coupling;
use crate::run::error::RunError;
use crate::run::simulation::{Heat, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::thermostat::Stream;

impl Coupling {
    /// The action of the thermostat for steps of `dt`.
    fn action(self, dt: f64) -> Heat {
        Heat { update: self.update, noise: self.noise, time: dt * self.every as f64, stream: Stream(0) }
    }

    /// The action of the thermostat in the present step of `dt`, if it is its turn.
    fn heat(self, system: &Simulation, dt: f64) -> Option<Heat> {
        system.step_number().is_multiple_of(self.every).then(|| self.action(dt))
    }

    /// Finds the virial that it would have at the present positions.
    pub(in crate::run) fn rehearse(self, system: &mut Simulation, dt: f64) -> Result<(), RunError> {
        system.rehearse(self.action(dt), dt)
    }

    /// Announces that it will act, if it is its turn, where the next forces are computed.
    pub(in crate::run) fn announce(self, system: &mut Simulation, dt: f64) {
        if let Some(heat) = self.heat(system, dt) {
            system.expect_heat(heat);
        }
    }

    pub(super) fn act(self, system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
        let want = system.wants_of_heat(want);
        self.heat(system, dt).map_or(Ok(()), |heat| system.heat(heat, want, dt))
    }
}
