use super::error::RunError;
use super::folder::Folder;
use super::outcome::{Outcome, Progress};
use super::output::{Output, replaces};
use super::simulation::Simulation;
use super::summary::Summary;
use super::timing::Timing;
use super::underway::Run;

use crate::checkpoint::{Checkpoint, CheckpointError, Found, Identity, Position, Store, Sums, Written};
use crate::particles::State;
use crate::scene::{Initial, Scene};
use psidpd_core::engine::{Fault, Settings};
use psidpd_formats::memory;
use psidpd_observe::Observers;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::AtomicUsize;
use std::time::Duration;

/// The version of this program.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// What to do with an earlier run in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Begin {
    /// From the first step, where there is no run yet.
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
        /// The instruction set that it was computed with, if that is another one: the same holds.
        instructions: Option<String>,
        /// What is wrong with the newest checkpoint, if it is the one before.
        fallback: Option<CheckpointError>,
    },
    /// The end: there is nothing left to do.
    Finished,
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
    /// [`RunError::Unfinished`] for [`Begin::New`] where a run waits to be taken up again, [`RunError::Finished`] where
    /// one has ended;
    /// [`RunError::Checkpoint`] for [`Begin::Resume`] if its checkpoints cannot be used;
    /// [`RunError::Busy`] if another run is on its way there; a model or initial state that does not work;
    /// a folder that cannot be written.
    pub fn begin(scene: &'a Scene, out: &Path, begin: Begin) -> Result<Runner<'a>, RunError> {
        let folder = Folder::open(out)?;
        let store = Store::new(out);
        let identity = Identity::of(scene.source.text(), &scene.folder, scene.precision(), &scene.model);
        if begin == Begin::Resume
            && let Some(found) = store.find(|checkpoint| usable(checkpoint, &identity, scene, out))?
        {
            return Runner::resume(scene, folder, store, found);
        }
        if begin == Begin::New {
            refuse_other_runs(&store, &identity, out)?;
        }
        if let Initial::File { path, .. } = &scene.initial
            && replaces(out, path)
        {
            return Err(RunError::OwnInput { path: path.clone() });
        }
        let particles = scene.initial.parts().iter().map(|part| part.count).sum();
        memory::check(particles)?;
        let state = scene.initial_state();
        let simulation = simulation(scene, state.clone())?;
        store.clear()?;
        let good = Checkpoint {
            program: PROGRAM.into(),
            instructions: simulation.settings().instructions.to_string(),
            identity,
            finished: false,
            step: 0,
            position: Position::default(),
            forces: Vec::new(),
            state,
            max_move: None,
            out_of_bounds: [0; 2],
            last: None,
            sums: Sums::default(),
            files: BTreeMap::new(),
            observers: Observers::new(&scene.observe, scene.stages.iter().map(|s| s.name.as_str()))
                .to_bytes(),
        };
        let mut output = Output::create(scene, out)?;
        let good = Checkpoint { files: output.written(), ..good };
        let run = Run::new(scene, folder, store, simulation, Some(output), good, Timing::default())?;
        Ok(Runner { start: Start::New, run })
    }

    fn resume(scene: &'a Scene, folder: Folder, store: Store, found: Found) -> Result<Runner<'a>, RunError> {
        let Found { checkpoint: good, fallback } = found;
        let mut simulation = simulation(scene, good.state.clone())?;
        if let Some(stage) = scene.stages.get(good.position.stage) {
            scene.enter(stage, &mut simulation)?;
        }
        let instructions = simulation.settings().instructions.to_string();
        simulation.restore(good.step, &good.state, &good.forces, good.out_of_bounds);
        simulation.set_max_move(good.max_move);
        if fallback.is_some() {
            store.fall_back()?;
        }
        let (start, output) = if good.finished {
            (Start::Finished, None)
        } else {
            let program = (good.program != PROGRAM).then(|| good.program.clone());
            let instructions = (good.instructions != instructions).then(|| good.instructions.clone());
            let start = Start::Resumed { step: good.step, program, instructions, fallback };
            (start, Some(Output::reopen(folder.path(), &good.files)?))
        };
        let good = Checkpoint { program: PROGRAM.into(), instructions, ..good };
        let timing = Timing::read(folder.path());
        // `about.json` does not depend on where a run stopped. The folder of a finished run may be one that cannot be written.
        if !folder.path().join("about.json").is_file() {
            super::about::about(scene)
                .write(folder.path())
                .or_else(|error| if good.finished { Ok(()) } else { Err(error) })?;
        }
        let mut run = Run::new(scene, folder, store, simulation, output, good, timing)?;
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

    /// Sets how many threads share the work: one, unless told otherwise. What a run writes does not depend on it.
    ///
    /// # Errors
    /// The model does not hold at the present temperature: never, since it did before.
    pub fn set_threads(&mut self, threads: NonZeroUsize) -> Result<(), RunError> {
        let settings = self.run.simulation.settings();
        self.run.simulation.set_settings(Settings { threads, ..settings })
    }

    /// Makes forces wrong, as [`Simulation::falsify`]: call it last, for a run at one temperature.
    ///
    /// # Errors
    /// As there.
    #[doc(hidden)]
    pub fn falsify(&mut self, fault: Fault) -> Result<(), RunError> {
        self.run.simulation.falsify(fault)
    }

    /// How forces are computed, for people: see [`Simulation::evaluation`].
    pub fn evaluation(&self) -> String {
        self.run.simulation.evaluation()
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
            // What is left of checkpoints before does no harm, and the folder may be one that cannot be written.
            let _ = run.store.keep_newest();
            return Ok(Outcome::Finished {
                summary: Box::new(run.summary()),
                timing: run.timing.clone(),
                advice: None,
            });
        }
        run.go_on(stop, progress).map_err(|error| run.stop(error))
    }
}

/// The simulation of a scene in the precision that its runs have, free to reorder particles.
fn simulation(scene: &Scene, state: State) -> Result<Simulation, RunError> {
    let mut simulation = scene.simulation(state)?;
    simulation.set_settings(Settings { precision: scene.precision(), ..simulation.settings() })?;
    simulation.set_reordering(true);
    Ok(simulation)
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
    // A finished run no longer needs its files; the user may have moved them.
    for (name, expected) in checkpoint.files.iter().filter(|_| !checkpoint.finished) {
        let file = out.join(name);
        let found = file.metadata().map_or(0, |m| m.len());
        let Written { length, .. } = *expected;
        if found < length {
            return Err(CheckpointError::File { path, file, found, expected: length });
        }
        // What cannot be read may still be written to: that is found out when it is opened.
        if Written::of(&file, length).is_ok_and(|found| found != *expected) {
            return Err(CheckpointError::Edited { path, file, length });
        }
    }
    Ok(())
}

/// A new run never replaces another.
fn refuse_other_runs(store: &Store, identity: &Identity, out: &Path) -> Result<(), RunError> {
    if !store.exists() {
        return Ok(());
    }
    let folder = out.to_owned();
    Err(match store.find(|_| Ok(())) {
        Ok(Some(found)) if found.checkpoint.finished => {
            RunError::Finished { folder, other: !identity.differences(&found.checkpoint.identity).is_empty() }
        }
        Ok(Some(found)) => RunError::Unfinished { folder, step: Some(found.checkpoint.step) },
        _ => RunError::Unfinished { folder, step: None },
    })
}
