use super::simulation::{Course, Task};
use super::{RunError, Simulation};
use crate::scene::{Scene, Stage};
use psidpd_core::engine::Want;
use psidpd_formats::memory;
use std::num::NonZeroUsize;

/// A scene in memory, without files: its stages are made step by step as the caller asks for them. The trajectory has the
/// same bits as that of a [`Runner`](super::Runner).
#[derive(Debug)]
pub struct Live {
    scene: Scene,
    course: Course,
    stage: usize,
    /// The steps made in the present stage.
    done: u64,
    /// The time at which the present stage began.
    begin: f64,
}

impl Live {
    pub fn new(scene: Scene, threads: NonZeroUsize) -> Result<Live, RunError> {
        let particles = scene.initial.count();
        memory::check(particles, memory::PARTICLE)?;
        let simulation = scene.simulation_of_run(scene.initial_state(), threads)?;
        let mut live = Live { scene, course: Course::of(simulation), stage: 0, done: 0, begin: 0.0 };
        live.enter()?;
        Ok(live)
    }

    fn enter(&mut self) -> Result<(), RunError> {
        let stage = &self.scene.stages[self.stage];
        // A stage begins with the velocities at the end of the step before it.
        let simulation = self.course.ended()?;
        self.scene.enter(stage, simulation)?;
        simulation.prepare_for(stage.integrator, stage.dt, Want::TOTALS)
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The present step, which is complete between runs.
    pub fn simulation(&self) -> &Simulation {
        self.course.completed()
    }

    pub fn stage(&self) -> &Stage {
        &self.scene.stages[self.stage]
    }

    pub fn time(&self) -> f64 {
        self.begin + self.done as f64 * self.stage().dt
    }

    pub fn left(&self) -> u64 {
        let all = self.scene.steps();
        all.saturating_sub(self.course.number())
    }

    /// Makes `steps` steps, with the totals after the last one. Beyond the end of the scene the steps are those of its last
    /// stage. `stop` is asked before each step; the step after its first `true` is the last, whose pressure has no drag and noise if the
    /// thermostat does not act in it.
    pub fn run(&mut self, steps: u64, mut stop: impl FnMut() -> bool) -> Result<(), RunError> {
        for k in 1..=steps {
            if self.done == self.stage().steps && self.stage + 1 < self.scene.stages.len() {
                (self.begin, self.stage, self.done) = (self.time(), self.stage + 1, 0);
                self.enter()?;
            }
            let last = stop() || k == steps;
            let want = if last { Want::TOTALS } else { Want::FORCES };
            let (dt, integrator) = (self.stage().dt, self.stage().integrator);
            // The pressure after the last step has the last action of the thermostat.
            let impulses = last || steps - k < integrator.thermostat_every();
            let settles = self.scene.settles(self.stage, self.done);
            let task = Task { want, impulses, settles, ..Task::default() };
            let made = self.course.make(dt, integrator, task);
            if last || made.is_err() {
                let whole = self.course.whole();
                return made.and(whole.map(|_| self.done += 1));
            }
            self.done += 1;
        }
        Ok(())
    }
}
