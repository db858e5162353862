//! The course of a run: its steps, its output and its end.

use super::looks::interval_of_looks;
use super::output::{Output, write_json, write_observations};
use super::simulation::{NeededDrag, Task};
use super::watch::{Deviation, Thermometer, Watch};
use super::{Advice, Outcome, Progress, RunError, Runner, Summary, Sums, Timing};
use crate::checkpoint::{BeforeEnd, Position};
use crate::scene::{Stage, every};
use psidpd_core::engine::{Want, processors};
use psidpd_formats::DataFile;
use psidpd_formats::files::{PathError, draft_inside};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

impl Runner<'_> {
    pub(super) fn go_on(
        &mut self,
        stop: &AtomicUsize,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Outcome, RunError> {
        self.clock.restart(self.course.number());
        let scene = self.scene;
        loop {
            let stage = &scene.stages[self.position.stage];
            if !self.position.entered {
                self.enter(stage, progress)?;
                // With many particles the first forces take as long as many steps of few, so a stop request
                // is checked here too.
                if let Some(outcome) = self.interrupted(stop)? {
                    return Ok(outcome);
                }
            }
            while self.position.done < stage.steps {
                self.step(stage, progress)?;
                if let Some(outcome) = self.interrupted(stop)? {
                    return Ok(outcome);
                }
            }
            if self.position.stage + 1 == scene.stages.len() {
                return self.finish();
            }
            let Position { stage, time, .. } = self.position;
            self.position = Position { stage: stage + 1, entered: false, done: 0, begin: time, time };
        }
    }

    /// Ends a run on a stop request, with a checkpoint.
    fn interrupted(&mut self, stop: &AtomicUsize) -> Result<Option<Outcome>, RunError> {
        let stop = stop.load(Ordering::Relaxed);
        let step = self.course.number();
        // The run ends after its last step anyway.
        if stop == 0 || step >= self.steps {
            return Ok(None);
        }
        if self.checkpoints.stored != Some(step) {
            self.checkpoint()?;
        }
        self.clock.earlier = self.timing_until(step);
        Ok(Some(Outcome::Interrupted { stop, step, steps: self.steps }))
    }

    /// Computes the forces before the first step of a stage.
    fn enter(&mut self, stage: &Stage, progress: &mut dyn FnMut(Progress)) -> Result<(), RunError> {
        self.sums = Sums::default();
        self.watch = Watch::default();
        let simulation = self.course.ended()?;
        self.scene.enter(stage, simulation)?;
        simulation.prepare_for(stage.integrator, stage.dt, Want::TOTALS)?;
        self.position.entered = true;
        if self.course.number() == 0 {
            self.report(stage, true, progress)?;
            // A test of writing a checkpoint before the first step reveals a full or read-only disk early.
            if self.scene.output.checkpoint != Some(0) {
                self.checkpoint()?;
            }
        }
        self.keep_state()
    }

    fn step(&mut self, stage: &Stage, progress: &mut dyn FnMut(Progress)) -> Result<(), RunError> {
        let number = self.course.number() + 1;
        let totals = self.is_row(number);
        let mut want = self.observers.wants(number, &stage.name);
        if totals {
            want = Want { energy: true, virial: true, ..want };
        }
        // What the thermostat does in this step is asked for up to the step before it acts again.
        let period = stage.integrator.thermostat_every();
        let last = if number.is_multiple_of(period) { number + period - 1 } else { number };
        let pressure = |step| self.is_row(step) || self.observers.wants_pressure(step, &stage.name);
        let flux = |step| self.observers.wants_flux(step, &stage.name);
        let task = Task {
            want,
            flux: flux(number),
            drag_needed_later: NeededDrag::by((number + 1..=last).map(flux)),
            impulses: (number..=last).any(pressure),
            settles: self.scene.settles(self.position.stage, self.position.done),
        };
        self.course.make(stage.dt, stage.integrator, task)?;
        let is_last = self.position.done + 1 == stage.steps;
        let looks = !self.measures_forces(stage, interval_of_looks(stage));
        let watched = Watch::is_due(stage, self.position.done + 1, looks);
        if watched {
            self.watch.sample(self.course.ended()?, stage, self.position.done + 1, looks)?;
        }
        self.position.done += 1;
        self.position.time = self.position.begin + self.position.done as f64 * stage.dt;
        if self.observers.may_sample(number, &stage.name) {
            let simulation = self.course.whole()?;
            if self.observers.wants_conservative_forces(number, &stage.name) {
                simulation.find_conservative_forces()?;
            }
            self.observers.sample(simulation.view(self.position.time), &stage.name);
        }
        if is_last {
            self.course.whole()?;
        }
        self.report(stage, totals, progress)?;
        let due = match self.scene.output.checkpoint {
            Some(interval) => every(interval, number),
            None => self.checkpoints.is_due(),
        };
        // The end of a run writes its own checkpoint.
        if due && number < self.steps { self.checkpoint() } else { Ok(()) }
    }

    fn is_row(&self, step: u64) -> bool {
        every(self.scene.output.thermo, step) || step == self.steps
    }

    /// Writes the output due after a step.
    fn report(
        &mut self,
        stage: &Stage,
        totals: bool,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), RunError> {
        let step = self.course.number();
        let thermo = totals.then(|| self.course.totals(self.position.time)).transpose()?;
        if step == self.steps && !every(self.scene.output.thermo, step) {
            let rows = self.output.as_ref().and_then(Output::rows);
            self.before_end = Some(BeforeEnd { sums: self.sums, last: self.last, rows });
        }
        if let Some(output) = &mut self.output {
            if let Some(thermo) = &thermo {
                self.last = Some(*thermo);
                // The initial state of a run is not counted in the means of its stage.
                if output.row(thermo)? && step > 0 && thermo.potential.is_finite() {
                    self.sums.add(thermo);
                }
            }
            if self.scene.output.writes_particles(step) {
                let simulation = self.course.whole()?;
                // The threads of a run wait for each other: one that shares its processor with the output holds up all.
                let beside = simulation.settings().threads.get() < processors();
                output.frames().write(step, self.position.time, simulation.state().by_tag(), beside)?;
            }
        }
        // Totals alone do not bring the particles from a device.
        if totals && self.course.is_here() {
            self.keep_state()?;
        }
        let deviations = match self.position.done == stage.steps {
            true => {
                let mut found = std::mem::take(&mut self.watch).deviations(stage);
                let known = found.iter().any(|d| d.thermometer == Thermometer::Configurational);
                found.extend(self.measured_deviation(stage).filter(|_| !known));
                found
            }
            false => Vec::new(),
        };
        let thermo = thermo.as_ref();
        progress(Progress { stage: &stage.name, step, steps: self.steps, thermo, deviations: &deviations });
        Ok(())
    }

    /// The deviation of the configurational temperature that a stage measures, with more configurations than the watch looks at.
    /// The first stage may still settle.
    fn measured_deviation(&self, stage: &Stage) -> Option<Deviation> {
        if !self.measures_forces(stage, u64::MAX) {
            return None;
        }
        let found = self.observers.temperature(&stage.name)?;
        Deviation::measured(stage, found.scalar("configurational")?, found.samples as usize)
    }

    /// Whether the observables of a stage that may have come to rest measure its temperatures, at least once in `interval` steps.
    fn measures_forces(&self, stage: &Stage, interval: u64) -> bool {
        let steady = self.position.stage > 0 && stage.level.is_none();
        let every = self.observers.interval_of_temperature(&stage.name);
        steady
            && stage.thermostat
            && !self.course.has_body_forces()
            && every.is_some_and(|every| every <= interval)
    }

    /// Keeps the present state as the last good one. The output of this step must be written already.
    fn keep_state(&mut self) -> Result<(), RunError> {
        let simulation = self.course.ended()?;
        let good = &mut self.checkpoints.good;
        (good.position, good.sums, good.last) = (self.position, self.sums, self.last);
        good.before_end.clone_from(&self.before_end);
        good.step = simulation.step_number();
        good.state.copy_particles(simulation.state());
        good.forces.clear();
        good.forces.extend_from_slice(simulation.held_forces());
        good.held = simulation.held();
        good.max_move = simulation.max_move();
        good.out_of_bounds = simulation.out_of_bounds();
        self.observers.write_to(&mut good.observers);
        self.output.iter_mut().for_each(Output::note);
        Ok(())
    }

    fn checkpoint(&mut self) -> Result<(), RunError> {
        self.keep_state()?;
        self.store_good()
    }

    fn store_good(&mut self) -> Result<(), RunError> {
        // A checkpoint records the contents of the files, so they are synced first.
        if let Some(output) = &mut self.output {
            self.checkpoints.good.files = output.sync()?;
        }
        self.checkpoints.write()?;
        let step = self.checkpoints.good.step;
        self.timing_until(step).write(&self.folder.path)
    }

    fn timing_until(&self, step: u64) -> Timing {
        let (run, clock) = (&self.course, &self.clock);
        clock.until(step, run.particles(), run.effort(), run.device_name(), run.time_of_one_thread())
    }

    /// Saves the last good state of a failed run.
    pub(super) fn stop(&mut self, cause: RunError) -> RunError {
        let (step, good) = (self.course.number(), self.checkpoints.good.step);
        if cause.is_output() {
            // A newer checkpoint may fit on the disk; if not, the old one remains.
            if self.checkpoints.stored != Some(good) {
                let _ = self.store_good();
            }
            return RunError::Halted { step, cause: Box::new(cause), checkpoint: self.checkpoints.stored };
        }
        let checkpoint = self.checkpoints.stored == Some(good) || self.store_good().is_ok();
        match self.write_good("last-good.data") {
            Ok(saved) => RunError::Stopped {
                stage: self.scene.stages[self.position.stage].name.clone(),
                cause: Box::new(cause),
                good,
                saved,
                checkpoint,
            },
            // The physics failed first, and its error is more informative.
            Err(_) => cause,
        }
    }

    fn finish(&mut self) -> Result<Outcome, RunError> {
        self.keep_state()?;
        self.output.iter_mut().try_for_each(|output| output.frames().wait())?;
        self.course.ended()?.release_pairs();
        self.write_good("final.data")?;
        write_observations(&self.folder.path, &self.observers.finish())?;
        let summary = self.summary()?;
        write_json(&self.folder.path.join("summary.json"), &summary)?;
        // From here on the run is finished, even if a later write fails.
        self.checkpoints.good.finished = true;
        self.store_good()?;
        self.checkpoints.store.keep_newest()?;
        let simulation = self.course.whole()?;
        let advice = self.scene.stages.last().and_then(|stage| Advice::of(simulation, stage));
        let timing = self.timing_until(self.steps);
        Ok(Outcome::Finished { summary: Box::new(summary), timing, advice })
    }

    /// Writes the last good state as a data file in the folder, and returns its path.
    fn write_good(&self, name: &str) -> Result<PathBuf, RunError> {
        let good = &self.checkpoints.good;
        let path = self.folder.path.join(name);
        let title = format!("psidpd: {}, step {}", self.scene.title, good.step);
        let data = good.state.to_data_by_tag(&title);
        let data = DataFile { names: self.scene.model.species().to_vec(), ..data };
        let write = || {
            let mut draft = draft_inside(&path)?;
            data.write_to(&mut draft)?;
            draft.finish(true)
        };
        write().map_err(PathError::at("write", &path))?;
        Ok(path)
    }

    pub(super) fn summary(&mut self) -> Result<Summary, RunError> {
        Ok(Summary {
            title: self.scene.title.clone(),
            particles: self.course.particles(),
            steps: self.steps,
            out_of_bounds: self.course.out_of_bounds(),
            last: self.last.map_or_else(|| self.course.totals(self.position.time), Ok)?,
            means: self.sums.means(),
        })
    }
}
