use super::advice::Advice;
use super::by_tag::ByTag;
use super::error::RunError;
use super::folder::Folder;
use super::outcome::{Outcome, Progress};
use super::output::{Output, write_observations};
use super::simulation::Simulation;
use super::summary::Summary;
use super::timing::{Iterations, Session, Timing};
use super::watch::Watch;
use crate::checkpoint::{Checkpoint, CheckpointError, Position, Store, Sums, Thermo};
use crate::particles::write_data;
use crate::scene::{Scene, Stage};
use psidpd_core::engine::Want;
use psidpd_observe::Observers;
use psidpd_pictures::{write_snapshot, write_vtk};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Wall time between checkpoints of scenes without a step interval.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(600);

/// A run in progress.
pub(super) struct Run<'a> {
    scene: &'a Scene,
    folder: Folder,
    pub store: Store,
    pub simulation: Simulation,
    /// The open files; `None` if the run is finished.
    output: Option<Output>,
    /// The last good state, which a failed run saves.
    pub good: Checkpoint,
    /// The step of the checkpoint on disk.
    pub stored: Option<u64>,
    position: Position,
    /// Total steps of all stages.
    steps: u64,
    sums: Sums,
    last: Option<Thermo>,
    observers: Observers,
    /// The watch over the present stage since the start of this session.
    watch: Watch,
    pub timing: Timing,
    /// The step and the time at which this session began.
    began: (u64, Instant),
    /// The time of the last checkpoint.
    checkpointed: Instant,
    /// Wall time between checkpoints, if the scene gives no steps between them.
    pub interval: Duration,
}

impl<'a> Run<'a> {
    pub fn new(
        scene: &'a Scene,
        folder: Folder,
        store: Store,
        simulation: Simulation,
        output: Option<Output>,
        good: Checkpoint,
        timing: Timing,
    ) -> Result<Run<'a>, RunError> {
        let unused = Observers::new(&scene.observe, scene.stages.iter().map(|s| s.name.as_str()));
        let observers = unused.restore(&good.observers).map_err(|error| CheckpointError::Damaged {
            path: store.path(),
            what: format!("its observables: {error}"),
        })?;
        let now = Instant::now();
        Ok(Run {
            scene,
            folder,
            store,
            simulation,
            output,
            stored: None,
            position: good.position,
            steps: scene.stages.iter().map(|s| s.steps).sum(),
            sums: good.sums,
            last: good.last,
            observers,
            watch: Watch::default(),
            timing,
            began: (good.step, now),
            checkpointed: now,
            interval: CHECKPOINT_INTERVAL,
            good,
        })
    }

    pub fn go_on(
        &mut self,
        stop: &AtomicUsize,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Outcome, RunError> {
        self.began = (self.simulation.step_number(), Instant::now());
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
        let step = self.simulation.step_number();
        // The run ends after its last step anyway.
        if stop == 0 || step >= self.steps {
            return Ok(None);
        }
        if self.stored != Some(step) {
            self.checkpoint()?;
        }
        self.timing = self.timing_until(step);
        Ok(Some(Outcome::Interrupted { stop, step, steps: self.steps }))
    }

    /// Computes the forces before the first step of a stage.
    fn enter(&mut self, stage: &Stage, progress: &mut dyn FnMut(Progress)) -> Result<(), RunError> {
        self.sums = Sums::default();
        self.watch = Watch::default();
        self.scene.enter(stage, &mut self.simulation)?;
        self.simulation.prepare_for(stage.integrator, stage.dt, Want::TOTALS)?;
        self.position.entered = true;
        if self.simulation.step_number() == 0 {
            self.report(stage, true, progress)?;
            // A test of writing a checkpoint before the first step reveals a full or read-only disk early.
            if self.scene.output.checkpoint != Some(0) {
                self.checkpoint()?;
            }
        }
        self.keep_state();
        Ok(())
    }

    fn step(&mut self, stage: &Stage, progress: &mut dyn FnMut(Progress)) -> Result<(), RunError> {
        let number = self.simulation.step_number() + 1;
        let totals = self.is_row(number);
        let mut want = self.observers.wants_in(number, &stage.name);
        if totals {
            want = Want { energy: true, virial: true, ..want };
        }
        self.simulation.record_flux(self.observers.wants_flux(number, &stage.name));
        self.simulation.set_settling(self.scene.settles(self.position.stage, self.position.done));
        self.simulation.begin_step(stage.dt, stage.integrator, want)?;
        let is_last = self.position.done + 1 == stage.steps;
        let watched = Watch::is_due(stage, self.position.done + 1);
        if watched {
            self.simulation.end_step()?;
            self.watch.sample(&mut self.simulation, stage, self.position.done + 1)?;
        }
        let sampled = self.observers.may_sample(number, &stage.name);
        if is_last || totals || sampled || self.writes(number) {
            self.simulation.end_step()?;
            self.simulation.refresh(want)?;
        }
        self.position.done += 1;
        self.position.time = self.position.begin + self.position.done as f64 * stage.dt;
        if sampled {
            self.observers.sample(self.simulation.view(self.position.time), &stage.name);
        }
        self.report(stage, totals, progress)?;
        let due = match self.scene.output.checkpoint {
            Some(interval) => every(interval, number),
            None => self.checkpointed.elapsed() >= self.interval,
        };
        // The end of a run writes its own checkpoint.
        if due && number < self.steps { self.checkpoint() } else { Ok(()) }
    }

    fn is_row(&self, step: u64) -> bool {
        every(self.scene.output.thermo, step) || step == self.steps
    }

    /// Whether the particles at the end of a step are written to a file.
    fn writes(&self, step: u64) -> bool {
        let due = &self.scene.output;
        [due.dump, due.xyz, due.gsd, due.vtk, due.snapshot].into_iter().any(|interval| every(interval, step))
    }

    /// Writes the output due after a step.
    fn report(
        &mut self,
        stage: &Stage,
        totals: bool,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), RunError> {
        let step = self.simulation.step_number();
        let thermo = totals.then(|| Thermo::of(&self.simulation, self.position.time));
        if let Some(output) = &mut self.output {
            if let Some(thermo) = &thermo {
                self.last = Some(*thermo);
                // The initial state of a run is not counted in the means of its stage.
                if output.row(thermo)? && step > 0 && thermo.potential.is_finite() {
                    self.sums.add(thermo);
                }
            }
            let due = &self.scene.output;
            let [dump, xyz, gsd, vtk, snapshot] =
                [due.dump, due.xyz, due.gsd, due.vtk, due.snapshot].map(|interval| every(interval, step));
            if dump || xyz || gsd || vtk || snapshot {
                let sorted = ByTag::of(&self.simulation);
                let frame = match &sorted {
                    Some(sorted) => sorted.frame(&self.simulation, self.position.time),
                    None => self.simulation.frame(self.position.time),
                };
                if dump {
                    output.frame(&frame)?;
                }
                if xyz {
                    output.xyz_frame(&frame)?;
                }
                if gsd {
                    output.gsd_frame(&frame, &self.scene.mass)?;
                }
                if vtk {
                    let kernel = self.scene.model.at(self.scene.kt)?.densities.first().map(|d| d.kernel);
                    write_vtk(self.folder.path(), &frame, kernel)?;
                }
                if snapshot {
                    write_snapshot(self.folder.path(), &frame)?;
                }
            }
        }
        if totals {
            self.keep_state();
        }
        let deviations = match self.position.done == stage.steps {
            true => self.watch.deviations(stage),
            false => Vec::new(),
        };
        let thermo = thermo.as_ref();
        progress(Progress { stage: &stage.name, step, steps: self.steps, thermo, deviations: &deviations });
        Ok(())
    }

    /// Keeps the present state as the last good one. The output of this step must be written already.
    fn keep_state(&mut self) {
        self.good.step = self.simulation.step_number();
        self.good.position = self.position;
        self.simulation.copy_state(&mut self.good.state);
        self.good.forces.clear();
        self.good.forces.extend_from_slice(self.simulation.forces());
        self.good.max_move = self.simulation.max_move();
        self.good.out_of_bounds = self.simulation.out_of_bounds();
        self.good.last = self.last;
        self.good.sums = self.sums;
        self.good.observers = self.observers.to_bytes();
        if let Some(output) = &mut self.output {
            self.good.files = output.written();
        }
    }

    fn checkpoint(&mut self) -> Result<(), RunError> {
        self.simulation.end_step()?;
        self.keep_state();
        self.store_good()
    }

    fn store_good(&mut self) -> Result<(), RunError> {
        // A checkpoint records the contents of the files, so they are synced first.
        if let Some(output) = &mut self.output {
            output.sync()?;
        }
        self.store.write(&self.good)?;
        self.stored = Some(self.good.step);
        self.checkpointed = Instant::now();
        self.tell_time(self.good.step)
    }

    /// Writes the times of this session up to `step`.
    fn tell_time(&self, step: u64) -> Result<(), RunError> {
        self.timing_until(step).write(self.folder.path())
    }

    fn timing_until(&self, step: u64) -> Timing {
        let (from_step, since) = self.began;
        let wall_seconds = since.elapsed().as_secs_f64();
        let made = step.saturating_sub(from_step) as f64 * self.simulation.len() as f64;
        let mut timing = self.timing.clone();
        timing.sessions.push(Session {
            from_step,
            to_step: step,
            wall_seconds,
            // The clock may not have advanced, and JSON has no infinity.
            particle_steps_per_second: made / wall_seconds.max(1e-9),
            thermostat: Iterations::of(self.simulation.effort()),
        });
        timing
    }

    /// Saves the last good state of a failed run.
    pub fn stop(&mut self, cause: RunError) -> RunError {
        let step = self.simulation.step_number();
        if cause.is_output() {
            // A newer checkpoint may fit on the disk; if not, the old one remains.
            if self.stored != Some(self.good.step) {
                let _ = self.store_good();
            }
            return RunError::Halted { step, cause: Box::new(cause), checkpoint: self.stored };
        }
        let checkpoint = self.stored == Some(self.good.step) || self.store_good().is_ok();
        let saved = self.folder.path().join("last-good.data");
        match write_data(
            &saved,
            &self.data_title(self.good.step),
            &self.good.state,
            self.scene.model.species(),
        ) {
            Ok(()) => RunError::Stopped {
                stage: self.scene.stages[self.position.stage].name.clone(),
                cause: Box::new(cause),
                good: self.good.step,
                saved,
                checkpoint,
            },
            // The physics failed first, and its error is more informative.
            Err(_) => cause,
        }
    }

    fn finish(&mut self) -> Result<Outcome, RunError> {
        self.keep_state();
        let path = self.folder.path().join("final.data");
        write_data(&path, &self.data_title(self.steps), &self.good.state, self.scene.model.species())?;
        std::fs::File::open(&path).and_then(|file| file.sync_all()).map_err(RunError::output(&path))?;
        write_observations(self.folder.path(), &self.observers.finish())?;
        let summary = self.summary();
        summary.write(&self.folder.path().join("summary.json"))?;
        // From here on the run is finished, even if a later write fails.
        self.good.finished = true;
        self.store_good()?;
        self.store.keep_newest()?;
        let advice = self.scene.stages.last().and_then(|stage| Advice::of(&mut self.simulation, stage));
        let timing = self.timing_until(self.steps);
        Ok(Outcome::Finished { summary: Box::new(summary), timing, advice })
    }

    fn data_title(&self, step: u64) -> String {
        format!("psidpd: {}, step {step}", self.scene.title)
    }

    pub fn summary(&self) -> Summary {
        Summary {
            title: self.scene.title.clone(),
            particles: self.simulation.len(),
            steps: self.steps,
            out_of_bounds: self.simulation.out_of_bounds(),
            last: self.last.unwrap_or_else(|| Thermo::of(&self.simulation, self.position.time)),
            means: self.sums.means(),
        }
    }
}

fn every(interval: u64, step: u64) -> bool {
    interval > 0 && step.is_multiple_of(interval)
}
