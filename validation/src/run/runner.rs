use super::checkpoint::{Checkpoint, CheckpointError, Found, Identity, Position, Store};
use super::error::RunError;
use super::folder::Folder;
use super::output::Output;
use super::restart::write_data;
use super::simulation::Simulation;
use super::summary::{Summary, Sums};
use super::thermo::Thermo;
use super::timing::{Session, Timing};
use crate::scene::{Scene, Stage};
use psidpd_core::engine::Want;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Time between checkpoints of scenes that do not say.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(600);

/// The version of this program.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// Where a run is, after every step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Steps made, over all stages.
    pub step: u64,
    /// Steps to make, over all stages.
    pub steps: u64,
    /// The totals, on steps that have them.
    pub thermo: Option<&'a Thermo>,
}

/// How a run deals with what is in its folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Begin {
    /// From the first step; a run that is not finished is left alone.
    #[default]
    New,
    /// From the first step, whatever is there.
    Overwrite,
    /// From the last checkpoint; from the first step if there is none.
    Resume,
}

/// What a run begins with.
#[derive(Debug)]
pub enum Start {
    /// The initial state.
    New,
    /// A checkpoint.
    Resumed {
        /// Its step.
        step: u64,
        /// The version of the program that wrote it, if that is another one: the steps that follow need not
        /// be to the last bit those that it would have made.
        program: Option<String>,
        /// What is wrong with the newest checkpoint, if it is the one before.
        fallback: Option<CheckpointError>,
    },
    /// The end: there is nothing left to do.
    Finished,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// All steps are made.
    Finished {
        /// What it came to.
        summary: Box<Summary>,
        /// What it took.
        timing: Timing,
    },
    /// It was asked to stop, and left a checkpoint.
    Interrupted {
        /// What it was told.
        stop: usize,
        /// Steps made.
        step: u64,
        /// Steps to make.
        steps: u64,
    },
}

/// Runs a scene from its first step to its last, whatever is in the folder `out`; see [`Runner`].
///
/// # Errors
/// [`RunError::Stopped`] if the physics fails; [`RunError::Halted`] or [`RunError::Output`] if a file
/// cannot be written.
pub fn run_scene(scene: &Scene, out: &Path, progress: &mut dyn FnMut(Progress)) -> Result<Summary, RunError> {
    let mut runner = Runner::begin(scene, out, Begin::Overwrite)?;
    let never = AtomicUsize::new(0);
    loop {
        if let Outcome::Finished { summary, .. } = runner.run(&never, progress)? {
            return Ok(*summary);
        }
    }
}

/// A run of a scene in a folder.
///
/// It writes `thermo.csv` and `dump.lammpstrj` as it goes, `final.data` and `summary.json` at its end, and
/// every now and then a [`Checkpoint`], from which it can go on bit for bit: what is in these files, and in
/// the checkpoint of a finished run, does not depend on how often it was interrupted, or at which moment.
/// Wall times are in `timing.json` alone.
///
/// If the physics fails on the way, the last good state, that of the last checkpoint, thermo row or start of
/// a stage, is written to `last-good.data` and as a checkpoint.
pub struct Runner<'a> {
    start: Start,
    run: Run<'a>,
}

impl<'a> Runner<'a> {
    /// Prepares a run in the folder `out`, which is made if need be.
    ///
    /// # Errors
    /// [`RunError::Unfinished`] for [`Begin::New`] where a run waits to be taken up again;
    /// [`RunError::Checkpoint`] for [`Begin::Resume`] if its checkpoints cannot be used;
    /// [`RunError::Busy`] if another run is on its way there; a model or initial state that does not work;
    /// a folder that cannot be written.
    pub fn begin(scene: &'a Scene, out: &Path, begin: Begin) -> Result<Runner<'a>, RunError> {
        let folder = Folder::open(out)?;
        let store = Store::new(out);
        let identity = Identity::of(scene);
        if begin == Begin::Resume
            && let Some(found) = store.find(|checkpoint| usable(checkpoint, &identity, scene, out))?
        {
            return Runner::resume(scene, folder, store, found);
        }
        if begin == Begin::New {
            refuse_unfinished(&store, out)?;
        }
        let state = scene.initial_state();
        let simulation = simulation(scene, state.clone())?;
        store.clear()?;
        let good = Checkpoint {
            program: PROGRAM.into(),
            identity,
            finished: false,
            step: 0,
            position: Position::default(),
            forces: Vec::new(),
            state,
            out_of_bounds: [0; 2],
            last: None,
            sums: Sums::default(),
            files: BTreeMap::new(),
            observers: Vec::new(),
        };
        let mut output = Output::create(scene, out)?;
        let good = Checkpoint { files: output.lengths(), ..good };
        let run = Run::new(scene, folder, store, simulation, Some(output), good, Timing::default());
        Ok(Runner { start: Start::New, run })
    }

    fn resume(scene: &'a Scene, folder: Folder, store: Store, found: Found) -> Result<Runner<'a>, RunError> {
        let Found { checkpoint: good, fallback } = found;
        let mut simulation = simulation(scene, good.state.clone())?;
        if let Some(stage) = scene.stages.get(good.position.stage) {
            simulation.set_temperature(stage.kt)?;
            simulation.set_thermostat(stage.thermostat);
        }
        simulation.restore(good.step, &good.state, &good.forces, good.out_of_bounds);
        if fallback.is_some() {
            store.fall_back()?;
        }
        let (start, output) = if good.finished {
            (Start::Finished, None)
        } else {
            let program = (good.program != PROGRAM).then(|| good.program.clone());
            let start = Start::Resumed { step: good.step, program, fallback };
            (start, Some(Output::reopen(folder.path(), &good.files)?))
        };
        let good = Checkpoint { program: PROGRAM.into(), ..good };
        let timing = Timing::read(folder.path());
        let mut run = Run::new(scene, folder, store, simulation, output, good, timing);
        run.stored = Some(run.good.step);
        Ok(Runner { start, run })
    }

    /// What it begins with.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// Sets the time between checkpoints, ten minutes, for a scene that does not give steps between them.
    pub fn set_checkpoint_interval(&mut self, interval: Duration) {
        self.run.interval = interval;
    }

    /// How many particles there are.
    pub fn particles(&self) -> usize {
        self.run.simulation.len()
    }

    /// Makes the steps that are left. At the end of the first step that finds `stop` other than 0, the run
    /// writes a checkpoint and ends.
    ///
    /// # Errors
    /// [`RunError::Stopped`] if the physics fails; [`RunError::Halted`] if a file cannot be written.
    pub fn run(
        &mut self,
        stop: &AtomicUsize,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Outcome, RunError> {
        let Runner { start, run } = self;
        if matches!(start, Start::Finished) {
            run.store.keep_newest()?;
            return Ok(Outcome::Finished { summary: Box::new(run.summary()), timing: run.timing.clone() });
        }
        run.go_on(stop, progress).map_err(|error| run.stop(error))
    }
}

/// The simulation of a scene, in whatever state.
fn simulation(scene: &Scene, state: super::State) -> Result<Simulation, RunError> {
    Simulation::new(&scene.model, scene.kt, state, scene.seed)
}

/// Whether a run can go on from a checkpoint: it is of this scene, and the files have what it counts on.
fn usable(
    checkpoint: &Checkpoint,
    identity: &Identity,
    scene: &Scene,
    out: &Path,
) -> Result<(), CheckpointError> {
    let path = Store::new(out).path();
    let differences = identity.differences(&checkpoint.identity);
    if !differences.is_empty() {
        return Err(CheckpointError::Foreign { path, differences });
    }
    let position = checkpoint.position;
    let before: u64 = scene.stages.iter().take(position.stage).map(|s| s.steps).sum();
    let fits = scene.stages.get(position.stage).is_some_and(|stage| position.done <= stage.steps)
        && checkpoint.step == before + position.done
        && checkpoint.forces.len() == if position.entered { checkpoint.state.len() } else { 0 };
    if !fits {
        return Err(CheckpointError::Damaged { path, what: "its parts do not fit together".into() });
    }
    for (name, expected) in &checkpoint.files {
        let file = out.join(name);
        let found = file.metadata().map_or(0, |m| m.len());
        if found < *expected {
            return Err(CheckpointError::File { path, file, found, expected: *expected });
        }
    }
    Ok(())
}

fn refuse_unfinished(store: &Store, out: &Path) -> Result<(), RunError> {
    if !store.exists() {
        return Ok(());
    }
    let step = match store.find(|_| Ok(())) {
        Ok(Some(found)) if found.checkpoint.finished => return Ok(()),
        Ok(Some(found)) => Some(found.checkpoint.step),
        _ => None,
    };
    Err(RunError::Unfinished { folder: out.to_owned(), step })
}

/// A run on its way.
struct Run<'a> {
    scene: &'a Scene,
    folder: Folder,
    store: Store,
    simulation: Simulation,
    /// `None` if the run is finished.
    output: Option<Output>,
    /// A state to fall back to.
    good: Checkpoint,
    /// The step of the checkpoint on disk.
    stored: Option<u64>,
    position: Position,
    /// Steps to make, over all stages.
    steps: u64,
    sums: Sums,
    last: Option<Thermo>,
    timing: Timing,
    /// The step that this session began after, and when.
    began: (u64, Instant),
    /// When the last checkpoint was written.
    checkpointed: Instant,
    /// Time between checkpoints, if there are no steps between them.
    interval: Duration,
}

impl<'a> Run<'a> {
    fn new(
        scene: &'a Scene,
        folder: Folder,
        store: Store,
        simulation: Simulation,
        output: Option<Output>,
        good: Checkpoint,
        timing: Timing,
    ) -> Run<'a> {
        let now = Instant::now();
        Run {
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
            timing,
            began: (good.step, now),
            checkpointed: now,
            interval: CHECKPOINT_INTERVAL,
            good,
        }
    }

    fn go_on(&mut self, stop: &AtomicUsize, progress: &mut dyn FnMut(Progress)) -> Result<Outcome, RunError> {
        self.began = (self.simulation.step_number(), Instant::now());
        let scene = self.scene;
        loop {
            let stage = &scene.stages[self.position.stage];
            if !self.position.entered {
                self.enter(stage, progress)?;
            }
            while self.position.done < stage.steps {
                self.step(stage, progress)?;
                let stop = stop.load(Ordering::Relaxed);
                // At its last step a run has come to its end by itself.
                if stop != 0 && self.simulation.step_number() < self.steps {
                    self.checkpoint()?;
                    let step = self.simulation.step_number();
                    self.timing = self.timing_until(step);
                    return Ok(Outcome::Interrupted { stop, step, steps: self.steps });
                }
            }
            if self.position.stage + 1 == scene.stages.len() {
                return self.finish();
            }
            let Position { stage, time, .. } = self.position;
            self.position = Position { stage: stage + 1, entered: false, done: 0, begin: time, time };
        }
    }

    /// Computes the forces that a stage starts with.
    fn enter(&mut self, stage: &Stage, progress: &mut dyn FnMut(Progress)) -> Result<(), RunError> {
        self.sums = Sums::default();
        self.simulation.set_temperature(stage.kt)?;
        self.simulation.set_thermostat(stage.thermostat);
        self.simulation.prepare(stage.dt, Want::TOTALS)?;
        self.position.entered = true;
        if self.simulation.step_number() == 0 {
            self.report(stage, true, progress)?;
            // What the disk thinks of this run is better known before the first step than later.
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
        let want = if totals { Want::TOTALS } else { Want::FORCES };
        self.simulation.step(stage.dt, stage.integrator, want)?;
        self.position.done += 1;
        self.position.time = self.position.begin + self.position.done as f64 * stage.dt;
        self.report(stage, totals, progress)?;
        let due = match self.scene.output.checkpoint {
            Some(interval) => every(interval, number),
            None => self.checkpointed.elapsed() >= self.interval,
        };
        // A run that comes to its end writes one then.
        if due && number < self.steps { self.checkpoint() } else { Ok(()) }
    }

    fn is_row(&self, step: u64) -> bool {
        every(self.scene.output.thermo, step) || step == self.steps
    }

    /// Writes what is due after a step.
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
                // The state a stage starts from is not of that stage.
                if output.row(thermo)? && step > 0 {
                    self.sums.add(thermo);
                }
            }
            if every(self.scene.output.dump, step) {
                output.frame(&self.simulation)?;
            }
        }
        if totals {
            self.keep_state();
        }
        progress(Progress { stage: &stage.name, step, steps: self.steps, thermo: thermo.as_ref() });
        Ok(())
    }

    /// Makes the present state the one to fall back to. Everything due at this step must be written.
    fn keep_state(&mut self) {
        self.good.step = self.simulation.step_number();
        self.good.position = self.position;
        self.simulation.copy_state(&mut self.good.state);
        self.good.forces.clear();
        self.good.forces.extend_from_slice(self.simulation.forces());
        self.good.out_of_bounds = self.simulation.out_of_bounds();
        self.good.last = self.last;
        self.good.sums = self.sums;
        if let Some(output) = &mut self.output {
            self.good.files = output.lengths();
        }
    }

    /// Writes a checkpoint of the present state.
    fn checkpoint(&mut self) -> Result<(), RunError> {
        self.keep_state();
        self.store_good()
    }

    fn store_good(&mut self) -> Result<(), RunError> {
        // A checkpoint counts on what is in the files.
        if let Some(output) = &mut self.output {
            output.sync()?;
        }
        self.store.write(&self.good)?;
        self.stored = Some(self.good.step);
        self.checkpointed = Instant::now();
        self.tell_time(self.good.step)
    }

    /// Writes what this session took up to `step`.
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
            particle_steps_per_second: made / wall_seconds,
        });
        timing
    }

    /// Saves what is left of a run that failed.
    fn stop(&mut self, cause: RunError) -> RunError {
        let step = self.simulation.step_number();
        if matches!(cause, RunError::Output { .. } | RunError::Lammps(_)) {
            // There may be room for a newer checkpoint; if not, that of before is still there.
            if self.stored != Some(self.good.step) {
                let _ = self.store_good();
            }
            return RunError::Halted { step, cause: Box::new(cause), checkpoint: self.stored };
        }
        let checkpoint = self.stored == Some(self.good.step) || self.store_good().is_ok();
        let saved = self.folder.path().join("last-good.data");
        match write_data(&saved, &self.data_title(self.good.step), &self.good.state) {
            Ok(()) => RunError::Stopped {
                stage: self.scene.stages[self.position.stage].name.clone(),
                cause: Box::new(cause),
                good: self.good.step,
                saved,
                checkpoint,
            },
            // The physics failed first, and says more.
            Err(_) => cause,
        }
    }

    fn finish(&mut self) -> Result<Outcome, RunError> {
        self.keep_state();
        let path = self.folder.path().join("final.data");
        write_data(&path, &self.data_title(self.steps), &self.good.state)?;
        std::fs::File::open(&path).and_then(|file| file.sync_all()).map_err(RunError::output(&path))?;
        let summary = self.summary();
        summary.write(&self.folder.path().join("summary.json"))?;
        // From here on the run is finished, whatever happens.
        self.good.finished = true;
        self.store_good()?;
        self.store.keep_newest()?;
        Ok(Outcome::Finished { summary: Box::new(summary), timing: self.timing_until(self.steps) })
    }

    fn data_title(&self, step: u64) -> String {
        format!("psidpd: {}, step {step}", self.scene.title)
    }

    fn summary(&self) -> Summary {
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
