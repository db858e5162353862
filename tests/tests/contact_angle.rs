//! Contact angles obey Young's law, with the files of the recipe of wetting.

use psidpd_tests::{parts, psidpd, said};
use serde_json::Value;
use std::path::Path;

/// The tension of the liquid's surface, from the source of the model.
const TENSION: f64 = 7.45;

/// Runs a scene at one strength of the attraction between fluid and wall, and returns a number of an observable with its error.
fn run(folder: &Path, scene: &str, strength: f64, observable: &str, column: &str) -> [f64; 2] {
    let out = format!("{scene}{strength}");
    let set = format!("model.parameters.A_FW={strength}");
    let mut arguments = vec!["run", scene, "--set", &set, "--out", &out];
    if scene == "wetting.toml" {
        arguments.extend(["--set", "stage.measure.steps=12000"]);
    }
    let output = psidpd(folder, &arguments);
    assert!(output.status.success(), "{}", said(&output));
    let text = std::fs::read_to_string(folder.join(out).join("observables.json")).unwrap();
    let all: Value = serde_json::from_str(&text).unwrap();
    let named = |list: &Value, name: &str| {
        list.as_array().unwrap().iter().find(|o| o["name"] == name).unwrap().clone()
    };
    let found = named(&named(&all, observable)["columns"], column);
    ["values", "errors"].map(|key| found[key][0].as_f64().unwrap())
}

/// dγ_WL/dA = ⟨U_FW⟩/(A S), so that its integral over the strength A is the change of γ cos θ. Four errors of the angles, which
/// chance exceeds once in 16 000 runs, are a third of that change. Half a minute of computing.
#[test]
#[ignore = "half a minute; run it when observables or walls change"]
fn youngs_law_gives_the_change_of_a_contact_angle() {
    let folder = tempfile::tempdir().unwrap();
    for block in parts("docs/recipes.md").iter().filter(|block| block.language == "toml") {
        let name = block.text.lines().next().unwrap().trim_start_matches("# ");
        std::fs::write(folder.path().join(name), &block.text).unwrap();
    }
    let slopes = [-20.0, -23.0, -26.0].map(|strength| {
        let [per_particle, _] = run(folder.path(), "film.toml", strength, "energy", "phi_2_F_W");
        per_particle * 1600.0 / (strength * 49.0)
    });
    let change = (slopes[0] + 4.0 * slopes[1] + slopes[2]) * 6.0 / 6.0;
    let [low, high] = [-20.0, -26.0].map(|strength| {
        let [angle, error] =
            run(folder.path(), "wetting.toml", strength, "contact_angle", "angle").map(f64::to_radians);
        [TENSION * angle.cos(), TENSION * angle.sin() * error]
    });
    let measured = high[0] - low[0];
    assert!((measured - change).abs() < 4.0 * low[1].hypot(high[1]), "{measured} {change}: {low:?} {high:?}");
    assert!(4.0 * low[1].hypot(high[1]) < 0.5 * change, "{low:?} {high:?}");
}
