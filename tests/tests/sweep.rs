//! Values set on the command line, and sweeps over several values.

use psidpd_tests::{psidpd, root, said};
use std::path::Path;

const STEPS: u64 = 40;

fn scene(folder: &Path) -> String {
    let model = root().join("validation/models/warren2003-set6.toml");
    let text = format!(
        "model = \"{}\"\nkT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = {STEPS}\n[output]\nthermo = 2\n",
        model.display()
    );
    std::fs::write(folder.join("s.toml"), text).unwrap();
    "s.toml".into()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[track_caller]
fn good(folder: &Path, arguments: &[&str]) -> String {
    let output = psidpd(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", said(&output));
    said(&output)
}

#[test]
fn set_reaches_scene_and_model_in_every_verb() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let s = scene(here);
    let model = root().join("validation/models/warren2003-set6.toml").display().to_string();
    // The results of a run are those of the other temperature, and --resume detects the difference.
    good(here, &["run", &s, "--out", "a", "--set", "kT=2", "--set", "steps=20", "--json", "a.json"]);
    let a = json(&here.join("a.json"));
    assert_eq!((&a["steps"], &json(&here.join("a/about.json"))["kT"]), (&20.into(), &2.0.into()));
    let temperature =
        a["headline"]["values"].as_array().unwrap().iter().find(|v| v["name"] == "temperature").unwrap();
    assert!(temperature["value"].as_f64().unwrap() > 1.4, "{temperature}");
    let other = psidpd(here, &["run", &s, "--out", "a", "--resume"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(
        said(&other).contains("kT is 1.0, was 2") || said(&other).contains("kT is 1, was 2"),
        "{}",
        said(&other)
    );
    // A parameter of the model, by its short and its full name, changes the mean-field pressure.
    let pressure = |arguments: &[&str]| {
        good(here, &[&["check"], arguments, &["--json", "c.json"]].concat());
        json(&here.join("c.json"))["pressure"].as_f64().unwrap()
    };
    let (plain, stronger) = (pressure(&[&s]), pressure(&[&s, "--set", "B=30"]));
    let full = pressure(&[&s, "--set", "model.parameters.B=30"]);
    let alone = pressure(&[&model, "--density", "6.05", "--set", "B=30"]);
    assert!(stronger > plain + 10.0 && full == stronger, "{plain} {stronger} {full}");
    assert!((alone - stronger).abs() < 0.05 * stronger, "{alone} {stronger}");
    good(here, &["export", "lammps", &s, "--out", "deck", "--set", "kT=0.7", "--set", "B=30"]);
    assert!(std::fs::read_to_string(here.join("deck/in.lammps")).unwrap().contains("0.7"));
    assert!(std::fs::read_to_string(here.join("deck/model.toml")).unwrap().contains("30"));
    good(here, &["theory", &model, "--set", "kT=0.5", "--json", "t.json"]);
    assert_eq!(json(&here.join("t.json"))["kT"], 0.5);
    for (edit, message) in [
        ("densty=3", "densty: unknown key"),
        ("kT=-1", "--set:1:1"),
        ("output.thermoo=3", "output.thermoo: unknown key"),
        ("stage.x.dt=1", "stage"),
        ("kT", "expected KEY=VALUE"),
    ] {
        let output = psidpd(here, &["check", &s, "--set", edit]);
        assert_eq!(output.status.code(), Some(2), "{edit}: {}", said(&output));
        assert!(said(&output).contains(message), "{edit}: {}", said(&output));
    }
}

#[test]
fn a_sweep_leaves_a_table_and_a_page_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let s = scene(here);
    let sweep =
        ["sweep", &s, "--over", "kT=0.8:1.2:3", "--over", "density=5,6", "--out", "w", "--json", "w.json"];
    let words = good(here, &sweep);
    assert!(words.contains("6 of 6"), "{words}");
    let csv = std::fs::read_to_string(here.join("w/sweep.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), 7, "{csv}");
    let column = |name: &str| rows[0].iter().position(|n| *n == name).unwrap_or_else(|| panic!("{csv}"));
    let number = |row: usize, name: &str| rows[row][column(name)].parse::<f64>().unwrap();
    for (row, (kt, density)) in
        [(0.8, 5.0), (0.8, 6.0), (1.0, 5.0), (1.0, 6.0), (1.2, 5.0), (1.2, 6.0)].iter().enumerate()
    {
        assert_eq!((number(row + 1, "kT"), rows[row + 1][column("finished")]), (*kt, "true"));
        assert!((number(row + 1, "density") - density).abs() < 0.01);
        assert!(number(row + 1, "pressure_error") > 0.0);
    }
    // A run of one point equals that point of the sweep.
    good(here, &["run", &s, "--out", "one", "--set", "kT=1", "--set", "density=6"]);
    let bytes = |name: &str| std::fs::read(here.join(name).join("thermo.csv")).unwrap();
    assert!(bytes("one") == bytes("w/kT=1,density=6"));
    let page = std::fs::read_to_string(here.join("w/report.html")).unwrap();
    for text in ["pressure", "density=5", "<svg", "6 of 6 finished"] {
        assert!(page.contains(text), "{text}");
    }
    // A finished point is not run again; a lost one is run again, with the same bytes.
    let stamp =
        |name: &str| here.join("w").join(name).join("final.data").metadata().unwrap().modified().unwrap();
    let before = stamp("kT=0.8,density=5");
    let lost = bytes("w/kT=1.2,density=6");
    std::fs::remove_dir_all(here.join("w/kT=1.2,density=6")).unwrap();
    good(here, &sweep);
    assert_eq!(stamp("kT=0.8,density=5"), before);
    assert!(bytes("w/kT=1.2,density=6") == lost);
    assert_eq!(std::fs::read_to_string(here.join("w/sweep.csv")).unwrap(), csv);
    // A failed run is reported, and does not stop the others.
    let output = psidpd(here, &["sweep", &s, "--over", "dt=0.01,50", "--set", "steps=500", "--out", "f"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("dt=50: ") && said(&output).contains("failed"), "{}", said(&output));
    let csv = std::fs::read_to_string(here.join("f/sweep.csv")).unwrap();
    assert!(csv.contains("true") && csv.contains("false"), "{csv}");
    for bad in ["kT=1:2", "nothing"] {
        let output = psidpd(here, &["sweep", &s, "--over", bad, "--out", "b"]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    }
}
