//! Simulations of scenes.

use super::{RunError, Simulation, State};
use crate::device::{Device, DeviceError, refused_step};
use crate::scene::{Scene, Stage, place_of_integrator};
use psidpd_core::document::{Document, Section, Value};
use psidpd_core::engine::{Precision, Settings};
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
        match simulation.use_device(self.device) {
            Err(RunError::Device(error)) => Err(self.located(error, |_| None)),
            outcome => outcome.and_then(|()| self.check_device()).map(|()| simulation),
        }
    }

    /// Refuses the first setting that the device of this scene does not compute.
    fn check_device(&self) -> Result<(), RunError> {
        if self.device == Device::Cpu {
            return Ok(());
        }
        if self.precision() == Precision::Double {
            let lacks = DeviceError::Lacks("double precision".into());
            return Err(self.located(lacks, |root| root.get("precision")));
        }
        let lacks = |stage: &Stage| {
            let lacks = DeviceError::Lacks(refused_step(stage.integrator)?);
            Some(self.located(lacks, |root| place_of_integrator(root, &stage.name)))
        };
        self.stages.iter().find_map(lacks).map_or(Ok(()), Err)
    }

    /// An error of the device, at its place if the file has it: that of `find`, or else of the key `device`.
    fn located(
        &self,
        error: DeviceError,
        find: impl for<'a> Fn(&Section<'a>) -> Option<Value<'a>>,
    ) -> RunError {
        let document = Document::parse(self.source.name(), self.source.text()).ok();
        let at = document.as_ref().and_then(|document| {
            let root = document.root();
            let value = find(&root).or_else(|| root.get("device"))?;
            let found = value.error(error.to_string());
            Some(error.help().map_or(found.clone(), |help| found.with_help(help)))
        });
        at.map_or(RunError::Device(error), RunError::File)
    }

    /// Whether the length of trial moves is still tuned before step `done` of stage `index`. It is tuned in the
    /// first Monte Carlo stage, including all levels of a ramp; if that is the only one, in its first quarter.
    pub(super) fn settles(&self, index: usize, done: u64) -> bool {
        let mut trials = self.stages.iter().filter(|stage| !stage.integrator.has_time());
        let (Some(first), stage) = (trials.next(), &self.stages[index]) else { return false };
        let is_only = trials.next().is_none();
        !stage.integrator.has_time() && stage.name == first.name && (!is_only || done < stage.steps / 4)
    }

    /// Why a run of the scene cannot be prolonged: how long the last stage is acts on its steps.
    pub(super) fn fixed_length(&self) -> Option<&'static str> {
        let last = self.stages.last()?;
        let first = self.stages.iter().find(|stage| !stage.integrator.has_time());
        if last.level.is_some() {
            Some("the levels of its ramp depend on the number")
        } else if first.is_some_and(|first| first.name == last.name) {
            Some("its first quarter tunes the moves of Monte Carlo")
        } else {
            None
        }
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
