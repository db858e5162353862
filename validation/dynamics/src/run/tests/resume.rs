//! Interrupted runs end like runs without interruption.

use super::*;
use crate::run::checkpoint::{Checkpoint, CheckpointError, Store, read_state};
use crate::tests::support::SOFT;
use psidpd_core::engine::Precision;
use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

const STAGES: &str = "\
    [[stage]]\nname = \"warm\"\nsteps = 7\ndt = 0.01\nkT = 1.5\nintegrator = \"groot-warren\"\n\
    [[stage]]\nname = \"alone\"\nsteps = 5\ndt = 0.005\nthermostat = false\n\
    [[stage]]\nname = \"run\"\nsteps = 9\ndt = 0.01\n\
    [output]\nthermo = 2\ndump = 3\n";
const STEPS: u64 = 21;

/// Set 6 with density bounds that the liquid exceeds, so that the counts are not zero.
fn bounded() -> String {
    SET6.replace("range  = \"rd\"", "range  = \"rd\"\nbounds = [0.5, 4.5]")
}

/// A frozen floor, a body force, a ramp and every kind of output.
const EVERYTHING: &str = "title = \"all\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 6.05\nprecision = \"double\"\n\
    [box]\nlengths = [3.0, 3.0, 5.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
    [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 0.8\nlattice = \"fcc\"\nfrozen = true\n\
    [[part]]\nshape = \"rest\"\n\
    [[body_force]]\nacceleration = [0.1, 0.0, -0.2]\n\
    [[stage]]\nname = \"cool\"\nsteps = 7\nkT = [1.5, 1.0]\nlevels = 3\nintegrator = \"groot-warren\"\n\
    [[stage]]\nname = \"alone\"\nsteps = 5\ndt = 0.005\nbody_forces = false\n\
    [[stage]]\nname = \"run\"\nsteps = 9\nintegrator = \"two-stage\"\nthermostat_every = 3\n\
    [output]\nthermo = 2\ndump = 3\nxyz = 4\ngsd = 2\nvtk = 7\nsnapshot = 10\ncheckpoint = 4\n\
    [observe]\nevery = 2\nstages = [\"cool\", \"run\"]\nrdf = true\ntemperature = true\nstress_profile = true\n\
    velocity_profile = true\npressure = true\nmsd = { every = 1, length = 4 }\nclusters = { skip = 3 }\n";

/// Stages with one integrator after the other.
const INTEGRATORS: &str = "\
    [[stage]]\nname = \"a\"\nsteps = 5\ndt = 0.02\nintegrator = \"aboba\"\nthermostat_every = 2\n\
    [[stage]]\nname = \"b\"\nsteps = 4\ndt = 0.03\nintegrator = \"two-stage\"\nthermostat_every = 3\n\
    [[stage]]\nname = \"c\"\nsteps = 3\nintegrator = \"peters\"\n\
    [[stage]]\nname = \"d\"\nsteps = 3\nintegrator = \"dpd-vv\"\n\
    [[stage]]\nname = \"e\"\nsteps = 3\nintegrator = \"baoab\"\nthermostat_step = \"pairwise\"\n\
    [[stage]]\nname = \"f\"\nsteps = 3\nintegrator = \"shardlow-s2\"\nnoise = \"uniform\"\n\
    [output]\nthermo = 2\ndump = 3\ncheckpoint = 4\n";

/// Trial moves before and after a stage with time steps; the first stage tunes their length.
const TRIALS: &str = "title = \"trials\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 6.05\n\
    [box]\nlengths = [3.0, 3.0, 5.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
    [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 0.8\nlattice = \"fcc\"\nfrozen = true\n\
    [[part]]\nshape = \"rest\"\n\
    [[stage]]\nname = \"rest\"\nsteps = 7\nintegrator = \"monte-carlo\"\nkT = [1.5, 1.0]\nlevels = 3\n\
    [[stage]]\nname = \"move\"\nsteps = 5\nintegrator = \"two-stage\"\ndt = 0.02\n\
    [[stage]]\nname = \"run\"\nsteps = 9\nintegrator = \"monte-carlo\"\nsweeps = 3\n\
    [output]\nthermo = 2\ndump = 3\nxyz = 4\ngsd = 2\nvtk = 7\nsnapshot = 10\ncheckpoint = 4\n\
    [observe]\nevery = 2\nstages = [\"rest\", \"run\"]\nrdf = true\ntemperature = true\nstress_profile = true\n\
    pressure = true\nsurface_tension = true\n";

fn scenes() -> [Scene; 5] {
    let solid = scene_of(&bounded(), "[3.0, 3.0, 3.0]", 6.05, &format!("{STAGES}checkpoint = 4\n")).unwrap();
    let flat = scene_of(VAN_DER_WAALS, "[5.0, 5.0]", 12.0, STAGES).unwrap();
    let all = support::scene(SET6, EVERYTHING).unwrap();
    let trials = support::scene(SET6, TRIALS).unwrap();
    [solid, flat, trials, scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, INTEGRATORS).unwrap(), all]
}

/// Every file of a folder and of its subfolders, except the one with wall times.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            files.extend(contents(&path).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else if name != "timing.json" {
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
    files
}

pub fn assert_same(a: &Path, b: &Path, when: &str) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{when}");
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{when}: {name} differs");
    }
}

/// Runs to step `at`, requests a stop there, and returns the outcome.
pub fn until(scene: &Scene, out: &Path, begin: Begin, at: u64) -> Result<Outcome, RunError> {
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

pub fn finished(scene: &Scene, out: &Path, begin: Begin) -> Summary {
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
        let names: Vec<_> = contents(&whole).into_keys().filter(|n| !n.starts_with("observables/")).collect();
        let all = [
            "about.json",
            "checkpoint",
            "dump.lammpstrj",
            "final.data",
            "observables.json",
            "snapshots/particles-0000000000.png",
            "snapshots/particles-0000000010.png",
            "snapshots/particles-0000000020.png",
            "summary.json",
            "thermo.csv",
            "trajectory.gsd",
            "trajectory.xyz",
            "vtk/density-0000000000.vti",
            "vtk/density-0000000007.vti",
            "vtk/density-0000000014.vti",
            "vtk/density-0000000021.vti",
            "vtk/particles-0000000000.vtp",
            "vtk/particles-0000000007.vtp",
            "vtk/particles-0000000014.vtp",
            "vtk/particles-0000000021.vtp",
        ];
        let observed = |n: &&str| {
            !["observables.json", "trajectory.gsd", "trajectory.xyz"].contains(n) && !n.contains('/')
        };
        let expected: Vec<_> = if scene.observe.requests.is_empty() {
            all.into_iter().filter(observed).collect()
        } else {
            all.to_vec()
        };
        assert_eq!(names, expected);
        // With many particles the first forces take long: the stop requests include step 0.
        for step in 0..STEPS {
            let out = folder.path().join(format!("{step}"));
            interrupted(&scene, &out, Begin::New, step);
            assert_eq!(finished(&scene, &out, Begin::Resume), summary, "step {step}");
            assert_same(&whole, &out, &format!("step {step}"));
        }
        // The run stops after every step in turn.
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

/// A killed run loses the steps since its last checkpoint, and their output. Here a panic kills the run after
/// every step, and the folder stays as it was at that moment.
#[test]
fn a_run_killed_after_any_step_ends_in_the_same_bytes() {
    let [plain, _, trials, many, everything] = scenes();
    for scene in [plain, trials, many, everything] {
        killed_after_any_step(&scene);
    }
}

fn killed_after_any_step(scene: &Scene) {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    let mut step = 0;
    run_scene(scene, &whole, &mut |_| {
        step += 1;
        let copy = folder.path().join(format!("{step}"));
        std::fs::create_dir(&copy).unwrap();
        for (name, bytes) in contents(&whole) {
            let path = copy.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
    })
    .unwrap();
    assert_eq!(step, STEPS + 1);
    let mut from = Vec::new();
    for step in 1..=STEPS + 1 {
        let out = folder.path().join(format!("{step}"));
        let runner = Runner::begin(scene, &out, Begin::Resume).unwrap();
        from.push(match runner.start() {
            Start::Resumed { prolonged: None, step, fallback: None, program: None, instructions: None } => {
                *step
            }
            Start::New => 0,
            other => panic!("{other:?}"),
        });
        drop(runner);
        finished(scene, &out, Begin::Resume);
        assert_same(&whole, &out, &format!("killed after {step} reports"));
    }
    // Progress reports precede the checkpoint of their step.
    assert_eq!(from, [0, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12, 16, 16, 16, 16, 20]);
}

#[test]
fn a_finished_run_is_left_as_it_is() {
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let summary = run_scene(&scene, out, &mut |_| ()).unwrap();
    let before = contents(out);
    let mut runner = Runner::begin(&scene, out, Begin::Resume).unwrap();
    assert!(matches!(runner.start(), Start::Finished));
    let outcome = runner.run(&AtomicUsize::new(0), &mut |_| panic!("no step is left")).unwrap();
    let Outcome::Finished { summary: again, timing, .. } = outcome else { panic!("{outcome:?}") };
    assert_eq!((&*again, timing.sessions.len()), (&summary, 1));
    assert!(contents(out) == before);
    drop(runner);
    // A finished run stays finished without its largest file.
    std::fs::remove_file(out.join("dump.lammpstrj")).unwrap();
    assert_eq!(finished(&scene, out, Begin::Resume), summary);
    // A new run, even of another scene, replaces a finished one on request only.
    let left = contents(out);
    let [first, second, ..] = scenes();
    for (other, expected) in [(&first, false), (&second, true)] {
        match Runner::begin(other, out, Begin::New).map(|_| ()) {
            Err(RunError::Finished { other, .. }) => assert_eq!(other, expected),
            found => panic!("{found:?}"),
        }
        assert!(contents(out) == left);
    }
    finished(&scene, out, Begin::Overwrite);
    assert!(contents(out) == before);
}

#[test]
fn an_unfinished_run_is_not_overwritten_by_mistake() {
    let [scene, ..] = scenes();
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

/// A scene without a step interval gets checkpoints by the clock; one with the interval 0 gets none before the end.
#[test]
fn checkpoints_come_when_they_are_due() {
    let [often, by_the_clock, ..] = scenes();
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
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let first = Runner::begin(&scene, folder.path(), Begin::New).unwrap();
    let second = Runner::begin(&scene, folder.path(), Begin::Overwrite).map(|_| ());
    assert!(matches!(second, Err(RunError::Busy { .. })), "{second:?}");
    drop(first);
    finished(&scene, folder.path(), Begin::Resume);
}

/// If files lost bytes that a checkpoint records, the run continues from the previous checkpoint; if that
/// fails too, no file changes.
#[test]
fn files_that_became_shorter_are_noticed() {
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    // The run has checkpoints of steps 8 and 9, with a frame between them.
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
    interrupted(&scene, &out, Begin::Overwrite, 9);
    cut(length - 10);
    let before = contents(&out);
    let error = Runner::begin(&scene, &out, Begin::Resume).map(|_| ()).unwrap_err();
    assert!(matches!(&error, RunError::Checkpoint(CheckpointError::File { found: 10, .. })), "{error}");
    assert!(contents(&out) == before);
}

/// Files of the same length with other bytes, within the recorded part or behind it.
#[test]
fn files_that_were_edited_are_noticed() {
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    for name in ["dump.lammpstrj", "thermo.csv"] {
        interrupted(&scene, &out, Begin::Overwrite, 9);
        let path = out.join(name);
        let bytes = std::fs::read(&path).unwrap();
        let mut edited = bytes.clone();
        edited[5] ^= 1;
        std::fs::write(&path, &edited).unwrap();
        let before = contents(&out);
        let error = Runner::begin(&scene, &out, Begin::Resume).map(|_| ()).unwrap_err();
        assert!(matches!(&error, RunError::Checkpoint(CheckpointError::Edited { .. })), "{error}");
        assert!(error.to_string().contains(name), "{error}");
        assert!(contents(&out) == before);
        // The file has its recorded bytes, and some that steps after the checkpoint may have left.
        std::fs::write(&path, [&bytes[..], b"more"].concat()).unwrap();
        finished(&scene, &out, Begin::Resume);
        assert_same(&whole, &out, name);
    }
}

/// A missing `about.json` is written again.
#[test]
fn a_description_that_is_gone_comes_back() {
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    interrupted(&scene, &out, Begin::New, 9);
    std::fs::remove_file(out.join("about.json")).unwrap();
    finished(&scene, &out, Begin::Resume);
    assert_same(&whole, &out, "without about.json");
    // A missing `about.json` of a finished run is written again too.
    std::fs::remove_file(out.join("about.json")).unwrap();
    finished(&scene, &out, Begin::Resume);
    assert_same(&whole, &out, "finished, without about.json");
}

#[test]
fn other_scenes_do_not_go_on_from_a_checkpoint() {
    let [scene, flat, ..] = scenes();
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
    let longer = STAGES.replace("steps = 5", "steps = 10");
    refused(&scene_of(&bounded(), "[3.0, 3.0, 3.0]", 6.05, &longer).unwrap(), "stage[2].steps is 10, was 5");
    let softer = bounded().replace("25.0", "20.0");
    refused(
        &scene_of(&softer, "[3.0, 3.0, 3.0]", 6.05, STAGES).unwrap(),
        "the model's parameters.B is 20, was 25",
    );
}

/// A scene with another number of steps in its last stage.
fn with_last_steps(scene: &Scene, steps: u64) -> Scene {
    let (before, rest) = scene.source.text().rsplit_once("steps = ").unwrap();
    let rest = rest.trim_start_matches(|c: char| c.is_ascii_digit());
    support::scene(scene.model.source().text(), &format!("{before}steps = {steps}{rest}")).unwrap()
}

/// A run that goes on to more steps, once it is finished or on its way, ends in the bytes of one that was as long from the start.
#[test]
fn a_prolonged_run_ends_in_the_same_bytes() {
    let without_rows = INTEGRATORS.replace("thermo = 2", "thermo = 0");
    let without_rows = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &without_rows).unwrap();
    for scene in scenes().into_iter().chain([without_rows]) {
        let folder = tempfile::tempdir().unwrap();
        let whole = folder.path().join("whole");
        let summary = run_scene(&scene, &whole, &mut |_| ()).unwrap();
        let last = scene.stages.last().unwrap().steps;
        // Ends between rows, frames and actions of the thermostat.
        for steps in BTreeSet::from([1, last - 2]) {
            let out = folder.path().join(steps.to_string());
            let longer = with_last_steps(&scene, steps + 1);
            finished(&with_last_steps(&scene, steps), &out, Begin::New);
            finished(&longer, &out, Begin::Resume);
            // Killed before its next checkpoint, once its files have changed.
            let killed = std::panic::AssertUnwindSafe(|| {
                let mut runner = Runner::begin(&scene, &out, Begin::Resume).unwrap();
                runner.run(&AtomicUsize::new(0), &mut |_| panic!("killed"))
            });
            assert!(std::panic::catch_unwind(killed).is_err());
            // What is left is no longer the finished run that it was.
            assert!(matches!(
                Runner::begin(&longer, &out, Begin::Resume),
                Err(RunError::Checkpoint(CheckpointError::Shorter { .. }))
            ));
            if steps == 1 {
                std::fs::write(out.join("checkpoint"), "damaged").unwrap();
            }
            assert_eq!(finished(&scene, &out, Begin::Resume), summary, "{steps}");
            assert_same(&whole, &out, &format!("{steps} steps"));
        }
        let out = folder.path().join("underway");
        until(&with_last_steps(&scene, last - 1), &out, Begin::New, STEPS - 2).unwrap();
        let runner = Runner::begin(&scene, &out, Begin::Resume).unwrap();
        assert!(matches!(runner.start(), Start::Resumed { step, prolonged: Some(before), .. }
            if (*step, *before) == (STEPS - 2, STEPS - 1)));
        drop(runner);
        assert_eq!(finished(&scene, &out, Begin::Resume), summary);
        assert_same(&whole, &out, "underway");
    }
}

/// What depends on the length of a run forbids another, and no run becomes shorter.
#[test]
fn runs_that_cannot_be_prolonged_say_why() {
    let ramp = "[[stage]]\nname = \"cool\"\nsteps = 6\nkT = [1.5, 1.0]\nlevels = 3\n";
    let trials = "[[stage]]\nname = \"trials\"\nsteps = 6\nintegrator = \"monte-carlo\"\n";
    let plain = "[[stage]]\nname = \"run\"\nsteps = 6\n";
    for (rest, steps, part) in [
        (ramp, 9, "from 6 to 9 steps in its last stage: the levels"),
        (trials, 9, "its first quarter"),
        (plain, 5, "has 6 steps in its last stage, more than the 5"),
    ] {
        let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, rest).unwrap();
        let folder = tempfile::tempdir().unwrap();
        finished(&scene, folder.path(), Begin::New);
        let before = contents(folder.path());
        let error = Runner::begin(&with_last_steps(&scene, steps), folder.path(), Begin::Resume).map(|_| ());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
        assert!(contents(folder.path()) == before);
    }
}

#[test]
fn a_length_is_counted_from_the_run() {
    let text = "model = \"m.toml\"\nkT = 1.0\nbox = 3.0\ndensity = 6.05\nsteps = 6\n";
    let scene = support::scene(SET6, text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(Length::More(4).steps(&scene, folder.path()), 10);
    finished(&with_last_steps(&scene, 8), folder.path(), Begin::New);
    assert_eq!(Length::More(4).steps(&scene, folder.path()), 12);
    assert_eq!(Length::Steps(4).steps(&scene, folder.path()), 4);
    assert_eq!(Length::edit(12, &scene).to_string(), "steps=12");
    let [.., stages] = scenes();
    assert_eq!(Length::edit(12, &stages).to_string(), "stage[3].steps=12");
}

/// The identity of a run includes the precision, and excludes the number of threads.
#[test]
fn threads_change_no_byte_and_precision_is_part_of_a_run() {
    for scene in scenes() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] = [1, 2].map(|threads| {
            let out = folder.path().join(format!("{threads}"));
            let mut runner = Runner::begin(&scene, &out, Begin::New).unwrap();
            runner.set_threads(NonZeroUsize::new(threads).unwrap()).unwrap();
            runner.run(&AtomicUsize::new(0), &mut |_| ()).unwrap();
            out
        });
        assert_same(&one, &two, "threads");
        // A checkpoint with another number of threads also works.
        let three = folder.path().join("3");
        interrupted(&scene, &three, Begin::New, 10);
        let mut runner = Runner::begin(&scene, &three, Begin::Resume).unwrap();
        runner.set_threads(NonZeroUsize::new(3).unwrap()).unwrap();
        runner.run(&AtomicUsize::new(0), &mut |_| ()).unwrap();
        drop(runner);
        assert_same(&one, &three, "resumed by other threads");

        let other = if scene.precision() == Precision::Double { Precision::Mixed } else { Precision::Double };
        let other = Scene { precision: Some(other), ..scene.clone() };
        let out = folder.path().join("other");
        interrupted(&scene, &out, Begin::New, 10);
        let error = Runner::begin(&other, &out, Begin::Resume).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("precision is "), "{error}");
        finished(&other, &out, Begin::Overwrite);
        assert!(contents(&out)["thermo.csv"] != contents(&one)["thermo.csv"]);
        // Stating the default precision changes nothing.
        let out = folder.path().join("said");
        interrupted(&scene, &out, Begin::New, 10);
        let said = Scene { precision: Some(scene.precision()), ..scene.clone() };
        finished(&said, &out, Begin::Resume);
        assert_same(&one, &out, "said");
    }
}

/// The checkpoint of a diverged run holds the last good state, and resuming it leads to the same error.
#[test]
fn a_blow_up_leaves_a_checkpoint() {
    let rest = "[[stage]]\nname = \"fine\"\nsteps = 25\ndt = 0.01\n\
                [[stage]]\nname = \"mad\"\nsteps = 500\ndt = 5.0\n[output]\nthermo = 10\ndump = 1\ncheckpoint = 0\n";
    let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, rest).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = run_scene(&scene, folder.path(), &mut |_| ()).unwrap_err();
    let RunError::Stopped { good: 25, saved, checkpoint: true, .. } = &error else { panic!("{error}") };
    let data = psidpd_formats::data::DataFile::read(saved).unwrap();
    let state = read_state(&folder.path().join("checkpoint")).unwrap();
    assert_eq!(state.to_data_by_tag(&data.title), data);
    let again = until(&scene, folder.path(), Begin::Resume, u64::MAX).unwrap_err();
    assert_eq!(again.to_string(), error.to_string());
    // With a smaller step the run continues.
    let mut run = simulation(SET6, state);
    advance(&mut run, 20, 0.01, Integrator::VelocityVerlet);
    assert!((0.5..2.0).contains(&run.temperature()), "{}", run.temperature());
}

/// If the first forces fail, the checkpoint holds the initial state.
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

/// `final.data` of a box with walls names them. A scene that starts from the file has these walls, and so
/// does a map of the density, where a particle at one wall does not appear at the other.
#[test]
fn a_data_file_keeps_walls() {
    use psidpd_formats::Configuration;
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\ndensity = 3.0\ndt = 0.01\nsteps = 2\n[box]\nlengths = [4.0, 4.0, 5.0]\n\
                boundary = [\"periodic\", \"periodic\", \"reflecting\"]\n";
    let folder = tempfile::tempdir().unwrap();
    run_scene(&support::scene(SOFT, text).unwrap(), folder.path(), &mut |_| ()).unwrap();
    let file = folder.path().join("final.data");
    let again = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\ndt = 0.01\nsteps = 2\n[initial]\nkind = \"data\"\nfile = '{}'\n",
        file.display()
    );
    let walls = [true, true, false];
    let scene = support::scene(SOFT, &again).unwrap();
    assert_eq!(scene.initial_state().domain.periodic(), walls);
    assert_eq!(Configuration::open(&file, None).unwrap().domain.periodic(), walls);
    let open = format!("{again}[box]\nboundary = [\"periodic\", \"periodic\", \"periodic\"]\n");
    assert_eq!(support::scene(SOFT, &open).unwrap().initial_state().domain.periodic(), [true; 3]);
    // A box without walls has no entry for them, nor does a plane.
    for (model, lengths) in [(SOFT, "[4.0, 4.0, 5.0]"), (VAN_DER_WAALS, "[6.0, 6.0]")] {
        let data = scene_of(model, lengths, 3.0, ONE_STAGE).unwrap().initial_state().to_data("t");
        assert_eq!((data.title.as_str(), data.boundary()), ("t", None));
    }
}

/// A run resumed with another instruction set reports that; one resumed with the same set does not.
#[test]
fn another_instruction_set_is_told() {
    let [scene, ..] = scenes();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    interrupted(&scene, out, Begin::New, 9);
    let store = Store::new(out);
    let found = store.find(|_| Ok(())).unwrap().unwrap().checkpoint;
    for (named, told) in
        [(found.instructions.clone(), None), ("an abacus".into(), Some("an abacus".to_owned()))]
    {
        store.write(&Checkpoint { instructions: named, ..found.clone() }).unwrap();
        let runner = Runner::begin(&scene, out, Begin::Resume).unwrap();
        let Start::Resumed { instructions, .. } = runner.start() else { panic!("{:?}", runner.start()) };
        assert_eq!(*instructions, told);
    }
}

/// The means of a run are those of the rows of its last stage, without the start; its time is that of all stages.
#[test]
fn means_are_those_of_the_rows_of_the_last_stage() {
    for (stages, steps, time) in [
        ("[[stage]]\nname = \"only\"\nsteps = 12\ndt = 0.01\n", 12, 0.12),
        (
            "[[stage]]\nname = \"first\"\nsteps = 6\ndt = 0.02\n[[stage]]\nname = \"last\"\nsteps = 9\ndt = 0.01\n",
            15,
            0.21,
        ),
    ] {
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 0.7\nseed = 1\nbox = 4.0\ndensity = 3.0\n{stages}[output]\nthermo = 3\n"
        );
        let scene = support::scene(support::SOFT, &text).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut runner = Runner::begin(&scene, folder.path(), Begin::New).unwrap();
        let mut rows = Vec::new();
        let first = steps - scene.stages.last().unwrap().steps;
        let summary = runner
            .run_to_end(&mut |p| rows.extend(p.thermo.filter(|row| row.step > first).copied()))
            .unwrap();
        let (last, means) = (summary.last, summary.means.unwrap());
        assert!((last.time - time).abs() < 1e-12 && last.step == steps, "{last:?}");
        assert_eq!((means.rows, rows.len() as u64), ((steps - first) / 3, (steps - first) / 3));
        let mean =
            |of: fn(&crate::checkpoint::Thermo) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
        for (found, expected) in [
            (means.temperature, mean(|row| row.temperature)),
            (means.potential, mean(|row| row.potential)),
            (means.pressure, mean(|row| row.pressure)),
            (means.conservative_pressure, mean(|row| row.conservative_pressure)),
        ] {
            assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} {expected}");
        }
        assert!((means.pressure - means.conservative_pressure).abs() > 1e-3, "{means:?}");
    }
}
