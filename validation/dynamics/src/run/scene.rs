//! A scene as a simulation.

use super::error::RunError;
use super::simulation::Simulation;
use crate::particles::State;
use crate::scene::{Scene, Stage};

impl Scene {
    /// A simulation from `state`, which is of this scene, at step 0: with its seed and its frozen particles.
    /// It is in double precision, as every simulation is; see [`Simulation::set_settings`].
    ///
    /// # Errors
    /// `state` is no state of the model.
    pub fn simulation(&self, state: State) -> Result<Simulation, RunError> {
        let mut simulation = Simulation::new(&self.model, self.kt, state, self.seed)?;
        simulation.set_frozen(&self.frozen);
        Ok(simulation)
    }

    /// Whether the length of trial moves is still looked for before step `done` of stage `index`: in the first stage of
    /// Monte Carlo, all levels of its ramp among it, or in the first quarter of the only one.
    pub(super) fn settles(&self, index: usize, done: u64) -> bool {
        let mut trials = self.stages.iter().filter(|stage| !stage.integrator.has_time());
        let (Some(first), stage) = (trials.next(), &self.stages[index]) else { return false };
        let is_only = trials.next().is_none();
        !stage.integrator.has_time() && stage.name == first.name && (!is_only || done < stage.steps / 4)
    }

    /// Sets the conditions of a stage: temperature, thermostat, body forces. The forces of the present step are
    /// to be computed anew then.
    ///
    /// # Errors
    /// The model does not hold at the temperature.
    pub fn enter(&self, stage: &Stage, simulation: &mut Simulation) -> Result<(), RunError> {
        simulation.set_temperature(stage.kt)?;
        simulation.set_thermostat(stage.thermostat);
        simulation.set_body_forces(if stage.body_forces { &self.body_forces } else { &[] });
        Ok(())
    }
}
