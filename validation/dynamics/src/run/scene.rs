//! Simulations of scenes.

use super::{RunError, Simulation, State};
use crate::scene::{Scene, Stage};
use psidpd_core::engine::Settings;
use std::num::NonZeroUsize;

impl Scene {
    /// Creates a simulation from `state`, which belongs to this scene, at step 0, with the scene's seed and
    /// frozen particles, in double precision.
    pub fn simulation(&self, state: State) -> Result<Simulation, RunError> {
        let mut simulation = Simulation::new(&self.model, self.kt, state, self.seed)?;
        simulation.set_frozen(&self.frozen);
        Ok(simulation)
    }

    /// The simulation of a run: in the scene's precision and on its device, with reordering of particles.
    pub(super) fn simulation_of_run(
        &self,
        state: State,
        threads: NonZeroUsize,
    ) -> Result<Simulation, RunError> {
        let mut simulation = self.simulation(state)?;
        let precision = self.precision();
        simulation.set_settings(Settings { precision, threads, ..simulation.settings() })?;
        simulation.set_reordering(true);
        let refused = match simulation.use_device(self.device) {
            Err(RunError::Device(error)) => Some(self.located(error, |_| None)),
            outcome => outcome.map(|()| self.refused_by_device())?,
        };
        match refused {
            None => Ok(simulation),
            Some((_, Some(located))) => Err(located.into()),
            Some((error, None)) => Err(error.into()),
        }
    }

    /// Whether the length of trial moves is still tuned before step `done` of stage `index`. It is tuned in the
    /// first Monte Carlo stage, including all levels of a ramp; if that is the only one, in its first quarter.
    pub(super) fn settles(&self, index: usize, done: u64) -> bool {
        let mut trials = self.stages.iter().filter(|stage| !stage.integrator.has_time());
        let (Some(first), stage) = (trials.next(), &self.stages[index]) else { return false };
        let is_only = trials.next().is_none();
        !stage.integrator.has_time() && stage.name == first.name && (!is_only || done < stage.steps / 4)
    }

    /// Sets the temperature, thermostat and body forces of a stage. The caller must then compute the forces
    /// of the present step anew.
    pub fn enter(&self, stage: &Stage, simulation: &mut Simulation) -> Result<(), RunError> {
        simulation.set_temperature(stage.kt)?;
        simulation.set_thermostat(stage.thermostat);
        simulation.set_body_forces(if stage.body_forces { &self.body_forces } else { &[] });
        Ok(())
    }
}
