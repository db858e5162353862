use psidpd::run::{RunError, Simulation};
use psidpd::scene::Scene;
use std::path::Path;
use std::sync::OnceLock;
use toml::Value;

/// The largest allowed length or density. Larger scenes take too long, which is not an error.
const LONGEST: f64 = 20.0;
const MOST: f64 = 2000.0;

/// The model of the scene, in the file `model.toml`.
const MODEL: &str = "title = \"m\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                     [excess_free_energy]\nA = \"n^2\"\nB = \"n\"\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// Any text is a scene or an error. A small scene has particles.
pub fn scene(text: &str) {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("model.toml"), MODEL).expect("a model");
        folder
    });
    let Ok(table) = text.parse::<toml::Table>() else {
        let _ = Scene::parse("fuzz.toml", text, folder.path());
        return;
    };
    // Scenes that name other files than the model are skipped, because such files may have any content.
    if !is_small(&Value::Table(table.clone()), "")
        || table.get("model").is_some_and(|m| m.as_str() != Some("model.toml"))
    {
        return;
    }
    if let Ok(scene) = Scene::parse("fuzz.toml", text, Path::new(folder.path())) {
        let state = scene.initial_state();
        let simulation = Simulation::new(&scene.model, scene.kt, state, scene.seed);
        assert!(!matches!(simulation, Err(RunError::State(_))), "{:?}\n{text}", simulation.err());
    }
}

fn is_small(value: &Value, key: &str) -> bool {
    let most = match key {
        "seed" | "steps" | "dt" | "every" | "kT" | "thermo" | "dump" | "checkpoint" | "bins" => f64::INFINITY,
        "count" => MOST,
        "file" => return false,
        _ => LONGEST,
    };
    match value {
        Value::Table(table) => table.iter().all(|(key, value)| is_small(value, key)),
        Value::Array(items) => items.iter().all(|value| is_small(value, key)),
        Value::Integer(number) => (*number as f64).abs() <= most,
        Value::Float(number) => number.is_nan() || number.abs() <= most,
        _ => true,
    }
}
