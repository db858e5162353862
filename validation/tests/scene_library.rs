//! The shipped scenes: all can be read, the quick ones run, the full ones have the sizes of the papers.

use psidpd::run::run_scene;
use psidpd::scene::Scene;
use std::path::PathBuf;

fn scenes(folder: &str) -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    found.sort();
    found
}

/// Runs a few steps of every stage of every quick scene and template, with a sample of all observables at each step.
#[test]
fn quick_scenes_run() {
    let paths = [scenes("scenes"), scenes("dynamics/src/scene/templates")].concat();
    assert!(paths.len() > 35, "{}", paths.len());
    let mut sampled = 0;
    for path in paths {
        let mut scene = open(&path);
        let cost: f64 = scene.stages.iter().map(|s| s.steps as f64).sum::<f64>()
            * scene.initial.parts().iter().map(|p| p.count as f64).sum::<f64>();
        // A minute allows this many particle-steps on one core.
        assert!(cost < 2e7, "{}: {cost:e} particle-steps are not quick", path.display());
        for stage in &mut scene.stages {
            stage.steps = 2;
        }
        for request in &mut scene.observe.requests {
            (request.every, request.skip) = (1, 0);
        }
        let out = tempfile::tempdir().unwrap();
        let summary =
            run_scene(&scene, out.path(), &mut |_| ()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(summary.last.temperature.is_finite() && summary.last.pressure.is_finite());
        if scene.observe.requests.is_empty() {
            continue;
        }
        let text = std::fs::read_to_string(out.path().join("observables.json")).unwrap();
        let observed: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
        assert!(observed.len() >= scene.observe.requests.len(), "{}: {text}", path.display());
        for observation in &observed {
            // The note of an observable says if it needs more than two steps.
            let (name, samples) = (&observation["name"], observation["samples"].as_u64().unwrap());
            sampled += usize::from(samples > 0);
            let told = observation["note"].as_str().is_some_and(|note| !note.is_empty());
            assert!(
                samples > 0 || told || LATE.contains(&name.as_str().unwrap()),
                "{}: {name}",
                path.display()
            );
        }
    }
    assert!(sampled > 150, "{sampled}");
}

/// These observables have no sample after two steps.
const LATE: [&str; 4] = ["diffusion", "msd", "viscosity", "stress_correlation"];

/// Templates name their model as `psidpd new` writes it; their models are among the shipped ones.
fn open(path: &PathBuf) -> Scene {
    if !path.display().to_string().contains("templates") {
        return Scene::open(path).unwrap_or_else(|e| panic!("{e}"));
    }
    let text = std::fs::read_to_string(path).unwrap();
    let models = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("models");
    Scene::parse(&path.display().to_string(), &text, &models).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn full_scenes_have_the_sizes_of_the_papers() {
    let counts = [
        ("huggins", 16384),
        ("spline-drop-5960", 5960),
        ("groot-warren-linear-density3", 648),
        ("van-der-waals-2d", 1470),
        ("power-law-k3", 4000),
        ("warren-set6-bulk", 6050),
    ];
    let mut found = 0;
    for path in scenes("scenes/full") {
        let scene = Scene::open(&path).unwrap_or_else(|e| panic!("{e}"));
        let count: usize = scene.initial.count();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if let Some((_, expected)) = counts.iter().find(|(n, _)| *n == name) {
            assert_eq!(count, *expected, "{name}");
            found += 1;
        }
        if name.starts_with("pendant-drop") {
            let drop = scene.initial.parts().iter().find(|p| !p.frozen).unwrap();
            assert!((2950..3050).contains(&drop.count), "{name}: {}", drop.count);
        }
        if name.starts_with("drop-collision") {
            assert!((3_749_900..3_750_100).contains(&count), "{name}: {count}");
        }
    }
    assert_eq!(found, counts.len());
}

/// The largest scene, 3.75 million particles as in the papers, fits into memory.
#[test]
fn the_largest_scene_can_be_filled() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/full/drop-collision.toml");
    let state = Scene::open(&path).unwrap().initial_state();
    assert!(state.len() > 3_749_900);
    let drops = state.species.iter().filter(|s| **s == 0).count() as f64;
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 15.0f64.powi(3);
    assert!((drops - 20.0 * ball).abs() < 2.0, "{drops}");
}
