//! Runs that are interrupted end as those that are not.

use super::*;
use crate::run::checkpoint::{CheckpointError, Store, read_state};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

const STAGES: &str = "\
    [[stage]]\nname = \"warm\"\nsteps = 7\ndt = 0.01\nkT = 1.5\nintegrator = \"groot-warren\"\n\
    [[stage]]\nname = \"alone\"\nsteps = 5\ndt = 0.005\nthermostat = false\n\
    [[stage]]\nname = \"run\"\nsteps = 9\ndt = 0.01\n\
    [output]\nthermo = 2\ndump = 3\n";
const STEPS: u64 = 21;

/// Set 6 with densities that the liquid goes beyond, so that there is something to count.
fn bounded() -> String {
    SET6.replace("range  = \"rd\"", "range  = \"rd\"\nbounds = [0.5, 4.5]")
}

fn scenes() -> [Scene; 2] {
    let solid = scene_of(&bounded(), "[3.0, 3.0, 3.0]", 6.05, &format!("{STAGES}checkpoint = 4\n")).unwrap();
    let flat = scene_of(VAN_DER_WAALS, "[5.0, 5.0]", 12.0, STAGES).unwrap();
    [solid, flat]
}

/// Every file of a folder but the one that tells times.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .filter(|(name, _)| name != "timing.json")
        .collect()
}

fn assert_same(a: &Path, b: &Path, when: &str) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{when}");
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{when}: {name} differs");
    }
}

/// Runs until `at`, asks to stop there, and gives the outcome.
fn until(scene: &Scene, out: &Path, begin: Begin, at: u64) -> Result<Outcome, RunError> {
    let stop = AtomicUsize::new(0);
    Runner::begin(scene, out, begin)?.run(&stop, &mut |p| {
        if p.step == at {
            stop.store(15, Ordering::Relaxed);
        }
    })
}

fn interrupted(scene: &Scene, out: &Path, begin: Begin, at: u64) {
    let outcome = until(scene, out, begin, at).unwrap();
    assert_eq!(outcome, Outcome::Interrupted { stop: 15, step: at, steps: STEPS });
}

fn finished(scene: &Scene, out: &Path, begin: Begin) -> Summary {
    match until(scene, out, begin, u64::MAX).unwrap() {
        Outcome::Finished { summary, .. } => *summary,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_stopped_after_any_step_ends_in_the_same_bytes() {
    for scene in scenes() {
        let folder = tempfile::tempdir().unwrap();
        let whole = folder.path().join("whole");
        let summary = run_scene(&scene, &whole, &mut |_| ()).unwrap();
        assert!(
            contents(&whole).keys().eq([
                "checkpoint",
                "dump.lammpstrj",
                "final.data",
                "summary.json",
                "thermo.csv"
            ]
            .iter())
        );
        for step in 1..STEPS {
            let out = folder.path().join(format!("{step}"));
            interrupted(&scene, &out, Begin::New, step);
            assert_eq!(finished(&scene, &out, Begin::Resume), summary, "step {step}");
            assert_same(&whole, &out, &format!("step {step}"));
        }
        // After each of them, one after the other
        let out = folder.path().join("often");
        for step in 1..STEPS {
            interrupted(&scene, &out, Begin::Resume, step);
        }
        assert_eq!(finished(&scene, &out, Begin::Resume), summary);
        assert_same(&whole, &out, "every step");
        let timing: Timing =
            serde_json::from_slice(&std::fs::read(out.join("timing.json")).unwrap()).unwrap();
        let steps: Vec<_> = timing.sessions.iter().map(|s| (s.from_step, s.to_step)).collect();
        assert_eq!(steps, (0..STEPS).map(|k| (k, k + 1)).collect::<Vec<_>>());
    }
}

/// A run that is killed loses the steps since its last checkpoint, and what it wrote in them: here killed
/// by a panic after every step, with its folder as it was at that moment.
#[test]
fn a_run_killed_after_any_step_ends_in_the_same_bytes() {
    let [scene, _] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let mut step = 0;
    run_scene(&scene, &whole, &mut |_| {
        step += 1;
        let copy = folder.path().join(format!("{step}"));
        std::fs::create_dir(&copy).unwrap();
        for (name, bytes) in contents(&whole) {
            std::fs::write(copy.join(name), bytes).unwrap();
        }
    })
    .unwrap();
    assert_eq!(step, STEPS + 1);
    let mut from = Vec::new();
    for step in 1..=STEPS + 1 {
        let out = folder.path().join(format!("{step}"));
        let runner = Runner::begin(&scene, &out, Begin::Resume).unwrap();
        from.push(match runner.start() {
            Start::Resumed { step, fallback: None, program: None } => *step,
            Start::New => 0,
            other => panic!("{other:?}"),
        });
        drop(runner);
        finished(&scene, &out, Begin::Resume);
        assert_same(&whole, &out, &format!("killed after {step} reports"));
    }
    // A step is reported before its checkpoint is written.
    assert_eq!(from, [0, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12, 16, 16, 16, 16, 20]);
}

#[test]
fn a_finished_run_is_left_as_it_is() {
    let [scene, _] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let summary = run_scene(&scene, out, &mut |_| ()).unwrap();
    let before = contents(out);
    let mut runner = Runner::begin(&scene, out, Begin::Resume).unwrap();
    assert!(matches!(runner.start(), Start::Finished));
    let outcome = runner.run(&AtomicUsize::new(0), &mut |_| panic!("no step is left")).unwrap();
    let Outcome::Finished { summary: again, timing } = outcome else { panic!("{outcome:?}") };
    assert_eq!((&*again, timing.sessions.len()), (&summary, 1));
    assert!(contents(out) == before);
    drop(runner);
    // Even where its largest file was taken away.
    std::fs::remove_file(out.join("dump.lammpstrj")).unwrap();
    assert_eq!(finished(&scene, out, Begin::Resume), summary);
    // It may be made anew.
    finished(&scene, out, Begin::New);
    assert!(contents(out) == before);
}

#[test]
fn an_unfinished_run_is_not_overwritten_by_mistake() {
    let [scene, _] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    interrupted(&scene, out, Begin::New, 9);
    let before = contents(out);
    let refused = |step: Option<u64>| match Runner::begin(&scene, out, Begin::New).map(|_| ()) {
        Err(RunError::Unfinished { step: found, .. }) => assert_eq!(found, step),
        other => panic!("{other:?}"),
    };
    refused(Some(9));
    assert!(contents(out) == before);
    for name in ["checkpoint", "checkpoint.old"] {
        std::fs::write(out.join(name), "no checkpoint").unwrap();
    }
    refused(None);
    assert!(matches!(
        Runner::begin(&scene, out, Begin::Resume).map(|_| ()),
        Err(RunError::Checkpoint(CheckpointError::Other { .. }))
    ));
    finished(&scene, out, Begin::Overwrite);
    let whole = folder.path().join("whole");
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    std::fs::rename(&whole, folder.path().with_extension("whole")).unwrap();
    assert_same(out, &folder.path().with_extension("whole"), "overwritten");
    std::fs::remove_dir_all(folder.path().with_extension("whole")).unwrap();
}

/// A scene that does not say gets checkpoints by the clock; one that says 0 gets none on the way.
#[test]
fn checkpoints_come_when_they_are_due() {
    let [often, by_the_clock] = scenes();
    let never = scene_of(VAN_DER_WAALS, "[5.0, 5.0]", 12.0, &format!("{STAGES}checkpoint = 0\n")).unwrap();
    let seen = |scene: &Scene, interval: Duration| {
        let folder = tempfile::tempdir().unwrap();
        let mut runner = Runner::begin(scene, folder.path(), Begin::New).unwrap();
        runner.set_checkpoint_interval(interval);
        let mut seen = Vec::new();
        let step = || Store::new(folder.path()).find(|_| Ok(())).unwrap().map(|f| f.checkpoint.step);
        runner.run(&AtomicUsize::new(0), &mut |_| seen.push(step())).unwrap();
        assert_eq!(step(), Some(STEPS));
        seen.dedup();
        seen
    };
    let hour = Duration::from_secs(3600);
    assert_eq!(seen(&never, Duration::ZERO), [None]);
    assert_eq!(seen(&often, Duration::ZERO), [None, Some(0), Some(4), Some(8), Some(12), Some(16), Some(20)]);
    assert_eq!(seen(&by_the_clock, hour), [None, Some(0)]);
    let all: Vec<_> = std::iter::once(None).chain((0..STEPS).map(Some)).collect();
    assert_eq!(seen(&by_the_clock, Duration::ZERO), all);
}

#[test]
fn one_folder_holds_one_run_at_a_time() {
    let [scene, _] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let first = Runner::begin(&scene, folder.path(), Begin::New).unwrap();
    let second = Runner::begin(&scene, folder.path(), Begin::Overwrite).map(|_| ());
    assert!(matches!(second, Err(RunError::Busy { .. })), "{second:?}");
    drop(first);
    finished(&scene, folder.path(), Begin::New);
}

/// Files that lost what a checkpoint counts on: the one before will do if it can, else nothing is touched.
#[test]
fn files_that_became_shorter_are_noticed() {
    let [scene, _] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    // Checkpoints of steps 8 and 9, with a frame between them.
    interrupted(&scene, &out, Begin::New, 9);
    let dump = out.join("dump.lammpstrj");
    let length = dump.metadata().unwrap().len();
    let cut =
        |by: u64| std::fs::File::options().write(true).open(&dump).unwrap().set_len(length - by).unwrap();
    cut(1);
    let runner = Runner::begin(&scene, &out, Begin::Resume).unwrap();
    let Start::Resumed { step: 8, fallback: Some(why), .. } = runner.start() else {
        panic!("{:?}", runner.start())
    };
    assert!(why.to_string().contains("dump.lammpstrj has"), "{why}");
    drop(runner);
    finished(&scene, &out, Begin::Resume);
    assert_same(&whole, &out, "the dump was cut");
    interrupted(&scene, &out, Begin::New, 9);
    cut(length - 10);
    let before = contents(&out);
    let error = Runner::begin(&scene, &out, Begin::Resume).map(|_| ()).unwrap_err();
    assert!(matches!(&error, RunError::Checkpoint(CheckpointError::File { found: 10, .. })), "{error}");
    assert!(contents(&out) == before);
}

#[test]
fn other_scenes_do_not_go_on_from_a_checkpoint() {
    let [scene, flat] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    interrupted(&scene, out, Begin::New, 9);
    let before = contents(out);
    let refused = |scene: &Scene, part: &str| {
        let error = Runner::begin(scene, out, Begin::Resume).map(|_| ()).unwrap_err();
        assert!(matches!(error, RunError::Checkpoint(CheckpointError::Foreign { .. })), "{error}");
        assert!(error.to_string().contains(part), "{error}");
        assert!(contents(out) == before);
    };
    refused(&flat, "box.lengths is [5, 5], was [3, 3, 3]");
    let longer = STAGES.replace("steps = 9", "steps = 10");
    refused(&scene_of(&bounded(), "[3.0, 3.0, 3.0]", 6.05, &longer).unwrap(), "stage[3].steps is 10, was 9");
    let softer = bounded().replace("25.0", "20.0");
    refused(
        &scene_of(&softer, "[3.0, 3.0, 3.0]", 6.05, STAGES).unwrap(),
        "the model's parameters.B is 20, was 25",
    );
}

/// The checkpoint of a run that blew up is of the last good state, and leads to the same end again.
#[test]
fn a_blow_up_leaves_a_checkpoint() {
    let rest = "[[stage]]\nname = \"fine\"\nsteps = 25\ndt = 0.01\n\
                [[stage]]\nname = \"mad\"\nsteps = 500\ndt = 5.0\n[output]\nthermo = 10\ndump = 1\ncheckpoint = 0\n";
    let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, rest).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = run_scene(&scene, folder.path(), &mut |_| ()).unwrap_err();
    let RunError::Stopped { good: 25, saved, checkpoint: true, .. } = &error else { panic!("{error}") };
    let data = crate::lammps::DataFile::read(saved).unwrap();
    let state = read_state(&folder.path().join("checkpoint")).unwrap();
    assert_eq!(state.to_data(&data.title), data);
    let again = until(&scene, folder.path(), Begin::Resume, u64::MAX).unwrap_err();
    assert_eq!(again.to_string(), error.to_string());
    // With a smaller step it goes on.
    let mut run = simulation(SET6, state);
    advance(&mut run, 20, 0.01, Integrator::VelocityVerlet);
    assert!((0.5..2.0).contains(&run.temperature()), "{}", run.temperature());
}

/// If the very first forces cannot be had, the checkpoint is of the initial state.
#[test]
fn a_start_that_fails_leaves_what_it_started_from() {
    let rest = "[[stage]]\nname = \"one\"\nsteps = 5\ndt = 0.01\n[output]\nthermo = 1\ndump = 1\n";
    // The pole of ψ is far below the density.
    let model = VAN_DER_WAALS.replace("b = 0.016", "b = 0.1");
    let scene = scene_of(&model, "[5.0, 5.0]", 40.0, rest).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = run_scene(&scene, folder.path(), &mut |_| ()).unwrap_err();
    assert!(matches!(error, RunError::Stopped { good: 0, checkpoint: true, .. }), "{error}");
    assert_eq!(read_state(folder.path()).unwrap(), scene.initial_state());
    let again = until(&scene, folder.path(), Begin::Resume, u64::MAX).unwrap_err();
    assert_eq!(again.to_string(), error.to_string());
}
