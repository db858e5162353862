use super::checkpoints::Checkpoints;
use super::folder::Folder;
use super::output::{Output, has_begun, in_the_way, input_among, replaces};
use super::simulation::Course;
use super::timing::Clock;
use super::watch::Watch;
use super::{Outcome, Progress, RunError, Simulation, Summary, Sums, Thermo, Timing, about, check_memory};
use crate::checkpoint::{
    BeforeEnd, Checkpoint, CheckpointError, Found, Held, Identity, Position, Store, Written,
};
use crate::scene::{Initial, Scene};
use psidpd_core::engine::Settings;
use psidpd_formats::About;
use psidpd_formats::files::{Protected, open_inside, protect, there};
use psidpd_observe::Observers;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::AtomicUsize;
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// The treatment of an earlier run in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Begin {
    /// Start at the first step, in a folder without a run.
    #[default]
    New,
    /// Start at the first step, and replace an earlier run.
    Overwrite,
    /// Continue from the last checkpoint; start at the first step if there is none.
    Resume,
}

#[derive(Debug)]
pub enum Start {
    New,
    Resumed {
        step: u64,
        /// The number of steps of the run before it was prolonged, if it is.
        prolonged: Option<u64>,
        /// The version of the program that wrote the checkpoint, if it differs from this program: later steps
        /// can differ in rounding.
        program: Option<String>,
        /// The instruction set or the GPU that the run used before, if it differs: later steps can differ in rounding.
        instructions: Option<String>,
        /// The fault of the newest checkpoint, if the run continues from the previous one.
        fallback: Option<CheckpointError>,
    },
    Finished,
}

/// Runs a scene from its first step to its last and replaces an earlier run in the folder `out`; see [`Runner`].
pub fn run_scene(scene: &Scene, out: &Path, progress: &mut dyn FnMut(Progress)) -> Result<Summary, RunError> {
    Runner::begin(scene, out, Begin::Overwrite)?.run_to_end(progress)
}

/// A run of a scene in a folder.
///
/// A runner writes `thermo.csv` and `dump.lammpstrj` during the run, `final.data` and `summary.json` at its
/// end, and a [`Checkpoint`] at intervals. A run resumed from a checkpoint continues bit for bit: the
/// contents of these files, and of the checkpoint of a finished run, do not depend on the number or times of
/// interruptions. A scene whose last stage has more steps prolongs the run, finished or not, with the same contents as if it had been
/// as long from the start. Wall times are in `timing.json` alone.
///
/// If the physics fails, the last good state is written to `last-good.data` and as a checkpoint. That is the
/// state of the last checkpoint, thermo row or start of a stage.
pub struct Runner<'a> {
    start: Start,
    pub(super) scene: &'a Scene,
    pub(super) folder: Folder,
    _inputs: Protected,
    pub(super) course: Course,
    /// The open files; `None` if the run is finished.
    pub(super) output: Option<Output>,
    pub(super) checkpoints: Checkpoints,
    /// The present place of the run in its stages, and the totals of the stage so far.
    pub(super) position: Position,
    pub(super) sums: Sums,
    pub(super) last: Option<Thermo>,
    pub(super) before_end: Option<BeforeEnd>,
    pub(super) steps: u64,
    /// In words, how steps that need forces only are evaluated.
    evaluation: String,
    pub(super) observers: Observers,
    /// The watch over the present stage since the start of this session.
    pub(super) watch: Watch,
    pub(super) clock: Clock,
}

impl<'a> Runner<'a> {
    /// Prepares a run in the folder `out`, which is created if it is missing.
    pub fn begin(scene: &'a Scene, out: &Path, begin: Begin) -> Result<Runner<'a>, RunError> {
        let folder = Folder::open(out)?;
        let inputs = protect(scene.inputs());
        let store = Store::new(out);
        let identity = Identity::of_scene(scene);
        if begin == Begin::Resume
            && let Some(found) = store.find(|checkpoint| usable(checkpoint, &identity, scene, out))?
        {
            return Runner::resume(scene, folder, inputs, store, found, identity);
        }
        if begin == Begin::New {
            refuse_other_runs(&store, &identity, out)?;
        }
        if begin != Begin::Overwrite
            && let Some(path) = in_the_way(out)
            && !(begin == Begin::Resume && has_begun(scene, out))
        {
            return Err(RunError::InTheWay { path });
        }
        if let Some(path) = input_among(out) {
            return Err(RunError::OwnInput { path });
        }
        if let Initial::File { path, .. } = &scene.initial
            && replaces(out, path)
        {
            return Err(RunError::OwnInput { path: path.clone() });
        }
        check_memory(scene)?;
        let state = scene.initial_state();
        let simulation = scene.simulation_of_run(state.clone(), NonZeroUsize::MIN)?;
        store.clear()?;
        let output = Output::create(scene, out)?;
        let good = Checkpoint {
            program: PROGRAM.into(),
            instructions: simulation.arithmetic(),
            identity,
            finished: false,
            step: 0,
            position: Position::default(),
            forces: Vec::new(),
            held: Held::default(),
            state,
            max_move: None,
            out_of_bounds: [0; 2],
            last: None,
            sums: Sums::default(),
            before_end: None,
            files: BTreeMap::new(),
            observers: Observers::new(&scene.observe, scene.stages.iter().map(|s| s.name.as_str()))
                .to_bytes(),
        };
        let checkpoints = Checkpoints::new(store, good, None);
        Runner::of(scene, (folder, inputs), simulation, Some(output), checkpoints, Start::New)
    }

    fn resume(
        scene: &'a Scene,
        folder: Folder,
        inputs: Protected,
        store: Store,
        found: Found,
        identity: Identity,
    ) -> Result<Runner<'a>, RunError> {
        let Found { checkpoint: mut good, fallback } = found;
        let lengths = identity.lengths(&good.identity);
        if lengths.is_some() {
            good.prolong(identity);
            // Before its files change: a run that is killed before its next checkpoint can go on.
            store.write(&good)?;
        }
        let mut simulation = scene.simulation_of_run(good.state.clone(), NonZeroUsize::MIN)?;
        if let Some(stage) = scene.stages.get(good.position.stage) {
            scene.enter(stage, &mut simulation)?;
        }
        let instructions = simulation.arithmetic();
        simulation.restore(good.step, &good.state, &good.forces, good.out_of_bounds);
        simulation.hold(&good.held);
        simulation.set_max_move(good.max_move);
        if fallback.is_some() {
            store.fall_back()?;
        }
        let (start, output) = if good.finished {
            (Start::Finished, None)
        } else {
            let program = (good.program != PROGRAM).then(|| good.program.clone());
            let instructions = (good.instructions != instructions).then(|| good.instructions.clone());
            let prolonged = lengths.map(|[before, now]| scene.steps() - now + before);
            let start = Start::Resumed { step: good.step, prolonged, program, instructions, fallback };
            (start, Some(Output::reopen(scene, &folder.path, &good)?))
        };
        let good = Checkpoint { program: PROGRAM.into(), instructions, ..good };
        // `about.json` is independent of the step at which a run stopped. The folder of a finished run may be read-only.
        if lengths.is_some() || !there(&folder.path.join(About::NAME)) {
            about::about(scene)
                .write(&folder.path)
                .or_else(|error| if good.finished { Ok(()) } else { Err(error) })?;
        }
        let stored = Some(good.step);
        let checkpoints = Checkpoints::new(store, good, stored);
        Runner::of(scene, (folder, inputs), simulation, output, checkpoints, start)
    }

    fn of(
        scene: &'a Scene,
        (folder, inputs): (Folder, Protected),
        simulation: Simulation,
        output: Option<Output>,
        checkpoints: Checkpoints,
        start: Start,
    ) -> Result<Runner<'a>, RunError> {
        let good = &checkpoints.good;
        let unused = Observers::new(&scene.observe, scene.stages.iter().map(|s| s.name.as_str()));
        let observers = unused.restore(&good.observers).map_err(|error| CheckpointError::Damaged {
            path: checkpoints.store.path(),
            what: format!("its observables: {error}"),
        })?;
        let earlier =
            if matches!(start, Start::New) { Timing::default() } else { Timing::read(&folder.path) };
        Ok(Runner {
            start,
            scene,
            folder,
            _inputs: inputs,
            evaluation: simulation.evaluation(),
            course: Course::of(simulation),
            output,
            position: good.position,
            sums: good.sums,
            last: good.last,
            before_end: good.before_end.clone(),
            steps: scene.steps(),
            observers,
            watch: Watch::default(),
            clock: Clock::new(earlier, good.step),
            checkpoints,
        })
    }

    pub fn start(&self) -> &Start {
        &self.start
    }

    /// Sets the wall time between checkpoints for a scene without a step interval; the default is ten minutes.
    pub fn set_checkpoint_interval(&mut self, interval: Duration) {
        self.checkpoints.interval = interval;
    }

    /// Sets the number of threads; the default is one. The output of a run does not depend on it.
    pub fn set_threads(&mut self, threads: NonZeroUsize) -> Result<(), RunError> {
        let simulation = self.course.ended()?;
        simulation.set_settings(Settings { threads, ..simulation.settings() })?;
        self.evaluation = simulation.evaluation();
        Ok(())
    }

    pub fn evaluation(&self) -> &str {
        &self.evaluation
    }

    pub fn particles(&self) -> usize {
        self.course.particles()
    }

    /// Makes the remaining steps. The run writes a checkpoint and ends after the first step at which `stop` is not 0.
    pub fn run(
        &mut self,
        stop: &AtomicUsize,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Outcome, RunError> {
        if matches!(self.start, Start::Finished) {
            // Leftover checkpoints are harmless, and the folder may be read-only, so an error is ignored.
            let _ = self.checkpoints.store.keep_newest();
            return Ok(Outcome::Finished {
                summary: Box::new(self.summary()?),
                timing: self.clock.earlier.clone(),
                advice: None,
            });
        }
        self.go_on(stop, progress).map_err(|error| self.stop(error))
    }

    pub fn run_to_end(&mut self, progress: &mut dyn FnMut(Progress)) -> Result<Summary, RunError> {
        loop {
            if let Outcome::Finished { summary, .. } = self.run(&AtomicUsize::new(0), progress)? {
                return Ok(*summary);
            }
        }
    }
}

/// Checks that a run can continue from a checkpoint: it belongs to this scene or to one whose last stage is shorter, and the files
/// hold the bytes that it records.
fn usable(
    checkpoint: &Checkpoint,
    identity: &Identity,
    scene: &Scene,
    out: &Path,
) -> Result<(), CheckpointError> {
    let path = Store::new(out).path();
    let lengths = identity.lengths(&checkpoint.identity);
    let differences = identity.differences(&checkpoint.identity);
    match lengths {
        None if !differences.is_empty() => return Err(CheckpointError::Foreign { path, differences }),
        Some([before, now]) if now < before => return Err(CheckpointError::Shorter { path, before, now }),
        Some([before, now]) => {
            if let Some(why) = scene.fixed_length() {
                return Err(CheckpointError::Fixed { path, before, now, why });
            }
        }
        None => {}
    }
    let position = checkpoint.position;
    let before: u64 = scene.stages.iter().take(position.stage).map(|s| s.steps).sum();
    let fits = scene.stages.get(position.stage).is_some_and(|stage| position.done <= stage.steps)
        && checkpoint.step == before + position.done
        && checkpoint.forces.len() == if position.entered { checkpoint.state.len() } else { 0 };
    if !fits {
        return Err(CheckpointError::Damaged {
            path,
            what: "its step, stage and forces do not match".into(),
        });
    }
    // A finished run no longer needs its files; the user may have moved them.
    let needed = match lengths {
        Some(_) => checkpoint.files_to_prolong(),
        None if checkpoint.finished => BTreeMap::new(),
        None => checkpoint.files.clone(),
    };
    for (name, expected) in &needed {
        let file = out.join(name);
        let opened = open_inside(&file);
        let found = opened.as_ref().ok().and_then(|file| Some(file.metadata().ok()?.len()));
        // A file that cannot be read may still be writable; its length is known all the same.
        let found =
            found.or_else(|| Some(file.symlink_metadata().ok().filter(|m| m.is_file())?.len())).unwrap_or(0);
        let Written { length, .. } = *expected;
        if found < length {
            return Err(CheckpointError::File { path, file, found, expected: length });
        }
        if opened.and_then(|file| Written::of(file, length)).is_ok_and(|found| found != *expected) {
            return Err(CheckpointError::Edited { path, file, length });
        }
    }
    Ok(())
}

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
