//! A run: a scene in a folder, and what it observed.

pub mod bulk;

use crate::jobs;
use psidpd_core::model::Model;
use psidpd_dynamics::run::{Begin, RunError, Runner, Start, run_scene};
use psidpd_dynamics::scene::{Edit, Scene, edit_model};
use psidpd_formats::PathError;
use psidpd_formats::files::{read_if_there, read_inside, read_json_if_there, replace_inside};
use psidpd_observe::{Measured, Observation};
use psidpd_report::Progress;
use std::fmt::Debug;
use std::num::NonZeroUsize;
use std::path::Path;

/// A homogeneous fluid, and a slab of it beside its vapour.
pub const HOMOGENEOUS: &str = include_str!("homogeneous.toml");
pub const SLAB: &str = include_str!("slab.toml");

/// Another value of a key.
pub fn set(key: &str, value: impl Debug) -> Edit {
    Edit::new(key, format!("{value:?}"))
}

/// A scene of a model with other values of its keys. The model may differ from its file, beside which tables are found.
pub fn scene(text: &str, (model, file): (&Model, &Path), edits: &[Edit]) -> Result<Scene, RunError> {
    let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let named = Edit::new("model", toml::Value::from(file.display().to_string()));
    let text = edit_model(text, &[edits, &[named]].concat())?;
    Ok(Scene { model: model.clone(), ..Scene::parse("scene", &text, Path::new(""))? })
}

const OBSERVABLES: &str = "observables.json";

/// Who made the run of a folder; at its end also the checksum of what is read of it.
const MADE_BY: &str = "made-by";

/// Runs a scene, in the place of any run that is in `folder`, and reads what it observed.
pub fn anew(scene: &Scene, folder: &Path, threads: NonZeroUsize) -> Result<Observed, RunError> {
    finish(Runner::begin(scene, folder, Begin::Overwrite)?, scene, folder, threads)
}

fn finish(
    mut runner: Runner,
    scene: &Scene,
    folder: &Path,
    threads: NonZeroUsize,
) -> Result<Observed, RunError> {
    runner.set_threads(threads)?;
    let bar = Progress::new().steps(&scene.title, scene.steps(), 0, runner.particles());
    runner.run_to_end(&mut |p| bar.set(p.step))?;
    Observed::read(folder)
}

/// Reads what a scene observed in `folder` if `program` has run it there; goes on if that was interrupted; and begins it as `instead` says
/// if the folder has a run of another scene, model or program, or one that has been changed.
pub fn once(
    scene: &Scene,
    (folder, instead): (&Path, Begin),
    program: &str,
    threads: NonZeroUsize,
) -> Result<Observed, RunError> {
    let mark = folder.join(MADE_BY);
    let found = read_if_there(&mark).ok().flatten().unwrap_or_default();
    let counts = |runner: &Runner| match runner.start() {
        Start::New => true,
        Start::Resumed { prolonged, .. } => prolonged.is_none(),
        Start::Finished => found == made_by(program, folder),
    };
    let is_ours = found.lines().next() == Some(program);
    let earlier = is_ours.then(|| Runner::begin(scene, folder, Begin::Resume).ok()).flatten().filter(counts);
    let runner = match earlier {
        Some(runner) => runner,
        None => {
            let runner = Runner::begin(scene, folder, instead)?;
            replace_inside(&mark, format!("{program}\n").as_bytes(), false)?;
            runner
        }
    };
    let observed = finish(runner, scene, folder, threads)?;
    replace_inside(&mark, made_by(program, folder).as_bytes(), false)?;
    Ok(observed)
}

fn made_by(program: &str, folder: &Path) -> String {
    let mut sum = crc32fast::Hasher::new();
    for name in [OBSERVABLES, "thermo.csv"] {
        sum.update(&read_inside(&folder.join(name)).unwrap_or_default());
    }
    format!("{program}\n{:08x}\n", sum.finalize())
}

/// Runs scenes side by side, each in a folder within `folder`, and reads what they observed; the last is the longest.
pub fn side_by_side(scenes: Vec<Scene>, folder: &Path) -> Result<Vec<Observed>, RunError> {
    let one = |(number, scene): (usize, Scene)| {
        let folder = folder.join(format!("run-{number}"));
        run_scene(&scene, &folder, &mut |_| ())?;
        Observed::read(&folder)
    };
    jobs::each(scenes.into_iter().enumerate().collect(), one).into_iter().collect()
}

#[derive(Debug, Clone)]
pub struct Observed(pub Vec<Observation>);

impl Observed {
    pub fn read(folder: &Path) -> Result<Observed, RunError> {
        let path = folder.join(OBSERVABLES);
        let missing = || PathError::at("read", &path)(std::io::ErrorKind::NotFound.into());
        Ok(Observed(read_json_if_there(&path)?.ok_or_else(missing)?))
    }

    pub fn get(&self, name: &str) -> Option<&Observation> {
        self.0.iter().find(|o| o.name == name)
    }

    /// A number by the names of its observation and column; nothing known where there is none.
    pub fn scalar(&self, name: &str, column: &str) -> Measured {
        self.get(name).and_then(|o| o.scalar(column)).unwrap_or(Measured::NONE)
    }

    /// A column of an observation against its abscissa; nothing where it was not observed.
    pub fn profile(&self, name: &str, column: &str) -> Vec<(f64, Measured)> {
        let Some(observation) = self.get(name) else { return Vec::new() };
        let (Some(x), Some(y)) = (&observation.x, observation.get(column)) else { return Vec::new() };
        let values = y.values.iter().zip(&y.errors).map(|(value, error)| [*value, *error].into());
        x.values.iter().copied().zip(values).collect()
    }

    pub fn temperature(&self) -> Measured {
        self.scalar("temperature", "kinetic")
    }

    pub fn pressure(&self) -> Measured {
        self.scalar("pressure", "conservative")
    }

    /// Pressure of the configurations, without the scatter of velocities.
    pub fn configurational_pressure(&self) -> Measured {
        self.scalar("pressure", "configurational")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::SOFT;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const THREADS: NonZeroUsize = NonZeroUsize::MIN;

    fn fluid(model: &str, edits: &[&str]) -> Scene {
        let of = ["box=4.0", "equilibrate=5", "steps=15", "observe.every=5", "output.thermo=5"];
        let edits: Vec<Edit> = of.iter().chain(edits).map(|edit| edit.parse().unwrap()).collect();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("m.toml");
        std::fs::write(&file, model).unwrap();
        scene(HOMOGENEOUS, (&Model::open(&file).unwrap(), &file), &edits).unwrap()
    }

    /// The first steps of each part of a run, of which none is there that is not of this program and these inputs.
    fn sessions(folder: &Path) -> Vec<u64> {
        let text = std::fs::read_to_string(folder.join("timing.json")).unwrap();
        let timing: serde_json::Value = serde_json::from_str(&text).unwrap();
        timing["sessions"].as_array().unwrap().iter().map(|s| s["from_step"].as_u64().unwrap()).collect()
    }

    /// Whether a run is made where there is one, and gives what it would alone.
    fn is_made_again(scene: &Scene, folder: &Path, program: &str) -> bool {
        // What a run writes and `once` does not read.
        let end = folder.join("final.data");
        std::fs::remove_file(&end).unwrap();
        let observed = once(scene, (folder, Begin::Overwrite), program, THREADS).unwrap();
        let alone = tempfile::tempdir().unwrap();
        assert_eq!(observed.0, anew(scene, alone.path(), THREADS).unwrap().0);
        assert_eq!(sessions(folder), [0]);
        end.exists() || std::fs::write(&end, "").is_err()
    }

    #[test]
    fn a_run_is_read_only_where_its_inputs_made_it() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path();
        let first = fluid(SOFT, &[]);
        once(&first, (out, Begin::New), "psidpd 1", THREADS).unwrap();
        let again = |scene: &Scene, program| is_made_again(scene, out, program);
        // Nothing is replaced without leave.
        let refused = once(&first, (out, Begin::New), "psidpd 2", THREADS).unwrap_err();
        assert!(matches!(refused, RunError::Finished { .. }), "{refused}");
        assert!(!again(&first, "psidpd 1"));
        // A character of the program, the scene or the model, and back; a title is no input.
        assert!(again(&first, "psidpd 2") && !again(&first, "psidpd 2"));
        assert!(!again(&fluid(&SOFT.replacen("soft", "SOFT", 1), &[]), "psidpd 2"));
        for other in [
            fluid(SOFT, &["seed=2"]),
            fluid(SOFT, &["steps=16"]),
            fluid(SOFT, &["observe.every=6"]),
            fluid(&SOFT.replace("gamma = 4.5", "gamma = 4.6"), &[]),
        ] {
            assert!(again(&other, "psidpd 2") && !again(&other, "psidpd 2"));
            assert!(again(&first, "psidpd 2"));
        }
        // Files that are read, and the checkpoint, which tells of the inputs.
        for name in [OBSERVABLES, "thermo.csv", "checkpoint", MADE_BY] {
            let path = out.join(name);
            let whole = std::fs::read(&path).unwrap();
            for part in [Some(&whole[..whole.len() / 2]), None] {
                match part {
                    Some(half) => std::fs::write(&path, half).unwrap(),
                    None => std::fs::remove_file(&path).unwrap(),
                }
                assert!(again(&first, "psidpd 2") && !again(&first, "psidpd 2"), "{name}");
            }
        }
    }

    #[test]
    fn what_was_interrupted_goes_on_if_it_is_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let scene = fluid(SOFT, &["output.thermo=1"]);
        let whole = anew(&scene, &folder.path().join("whole"), THREADS).unwrap();
        for (program, seed, begins) in
            [("psidpd 1", 1, &[0, 7][..]), ("psidpd 2", 1, &[0]), ("psidpd 1", 2, &[0])]
        {
            let out = folder.path().join(format!("{program} {seed}"));
            let stop = AtomicUsize::new(0);
            let mut runner = Runner::begin(&scene, &out, Begin::New).unwrap();
            runner.run(&stop, &mut |p| stop.store(usize::from(p.step >= 7), Ordering::Relaxed)).unwrap();
            drop(runner);
            std::fs::write(out.join(MADE_BY), "psidpd 1\n").unwrap();
            let scene = fluid(SOFT, &["output.thermo=1", &format!("seed={seed}")]);
            let observed = once(&scene, (&out, Begin::Overwrite), program, THREADS).unwrap();
            assert_eq!(observed.0 == whole.0, seed == 1);
            assert_eq!(sessions(&out), begins, "{program} {seed}");
        }
    }
}
