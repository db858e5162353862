//! The JSON schema and the reference of the scene file are written from the table of keys, are current, and
//! agree with the reader.

#[path = "../../rust-core/tests/tables_of_keys/mod.rs"]
mod tables_of_keys;

use psidpd::observe;
use psidpd::scene::Scene;
use psidpd::scene::keys::TABLES;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::process::Command;
use tables_of_keys::{Tables, assert_current, examples, put};

/// The schema of `[observe]`.
fn observe() -> Value {
    let named = |keys: &[observe::keys::Key]| -> Map<String, Value> {
        let schema = |k: &observe::keys::Key| {
            let mut schema = Tables(TABLES).schema_of_value(&k.value);
            let words = k.value.describe();
            schema["description"] =
                format!("{} {}; {} if left out.", k.about, capital(&words), k.default()).into();
            schema
        };
        keys.iter().map(|k| (k.name.to_owned(), schema(k))).collect()
    };
    let mut properties = named(observe::keys::COMMON);
    for table in observe::request::tables() {
        let mut keys = named(observe::keys::COMMON);
        keys.extend(named(table.keys));
        let own = json!({ "type": "object", "properties": keys, "additionalProperties": false });
        let schema = json!({ "description": table.about, "anyOf": [{ "type": "boolean" }, own] });
        properties.insert(table.path.into(), schema);
    }
    json!({
        "type": "object", "description": "What is measured as the run goes.", "properties": properties,
        "additionalProperties": false
    })
}

fn schema() -> Value {
    let mut schema = Tables(TABLES).schema("psidpd scene file");
    schema["properties"]["observe"] = observe();
    schema
}

const INTRODUCTION: &str = "# The scene file\n\n\
    This page lists the keys of the scene file. A scene file is TOML; it states the fluid, the box, the initial\n\
    state and the number of steps. Unknown keys are errors that name line and key. Editors that know JSON\n\
    schemas (taplo, Even Better TOML) complete and check scene files with `#:schema scene.schema.json` in the\n\
    first line; the schema is `validation/schema/scene.schema.json`.\n\n\
    A scene needs five keys:\n\n\
    ```toml\n\
    model   = \"fluid.toml\"\n\
    kT      = 1.0\n\
    box     = 6.0\n\
    density = 3.0\n\
    steps   = 1000\n\
    ```\n\n\
    `psidpd new NAME --template …` writes a scene as a starting point, `psidpd check SCENE` says what a scene\n\
    will do, and `validation/scenes/` has a scene for every system of the papers: small ones that take seconds\n\
    and, in `full/`, those of the papers' own size.\n\n\
    The examples below leave out what every scene needs. Their model has two species, `A` and `B`, in three\n\
    dimensions. In two dimensions every array with a number for each direction has two numbers, and cylinders\n\
    do not exist. The keys of `[observe]`, which set what is measured, have [their own page](observables.md).\n\n\
    This page is written from the tables of keys in `validation/dynamics/src/scene/keys/`.\n";

fn reference() -> String {
    Tables(TABLES).page(INTRODUCTION)
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_uppercase().collect::<String>() + chars.as_str())
}

const MIXTURE: &str =
    "title = \"ideal mixture\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

const DATA: &str = "three\n\n3 atoms\n2 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # atomic\n\n\
                    1 1 1 1 1\n2 2 2 2 2\n3 1 3 3 3\n";

/// A folder with the files that the examples name.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("fluid.toml"), MIXTURE).unwrap();
    std::fs::write(folder.path().join("start.data"), DATA).unwrap();
    let short = "model = \"fluid.toml\"\nkT = 1.0\nbox = 6.0\ndensity = 3.0\nsteps = 2\n";
    let scene = Scene::parse("s.toml", short, folder.path()).unwrap();
    psidpd::run::run_scene(&scene, &folder.path().join("run"), &mut |_| ()).unwrap();
    folder
}

/// Completes an example to a whole scene.
fn completed(example: &str) -> String {
    let has = |start: &str| example.lines().any(|l| l.starts_with(start));
    let mut text = String::new();
    for (given, line) in [("model", "model = \"fluid.toml\"\n"), ("kT", "kT = 1.0\n")] {
        // A stage has a kT of its own.
        if !has(given) || has("[[stage]]") {
            text += line;
        }
    }
    if has("[[wall]]") {
        text += "box = { lengths = 6.0, boundary = [\"periodic\", \"periodic\", \"reflecting\"] }\n";
    } else if !has("box") && !has("[box]") && !has("file") {
        text += "box = 6.0\n";
    }
    // A wall has a density of its own.
    if has("[[wall]]") || !["density", "[initial]", "[[part]]"].iter().any(|k| has(k)) {
        text += "density = 3.0\n";
    }
    if !has("steps") {
        text += "steps = 10\n";
    }
    text + example
}

fn root() -> PathBuf {
    psidpd_tests::root().join("validation")
}

#[test]
fn schema_and_reference_are_current() {
    let schema = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    assert_current(&root().join("schema/scene.schema.json"), &schema);
    assert_current(&root().join("../docs/scene-file.md"), &reference());
}

/// Every scene that ships, quick and full-sized, and every template.
fn scenes() -> Vec<PathBuf> {
    let folders = ["scenes", "scenes/full", "dynamics/src/scene/templates"].map(|f| root().join(f));
    let mut found: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    found.sort();
    assert!(found.len() > 50, "{}", found.len());
    found
}

/// The complaints of Python's `jsonschema` about each scene; empty for a valid one.
fn complaints(scenes: &[String]) -> Vec<String> {
    let scenes: Vec<Value> = scenes.iter().map(|text| toml::from_str(text).unwrap()).collect();
    let folder = tempfile::tempdir().unwrap();
    let question = folder.path().join("question.json");
    std::fs::write(&question, json!({ "schema": schema(), "scenes": scenes }).to_string()).unwrap();
    let script = psidpd_tests::root().join("tests/python/validate_scenes.py");
    let output = Command::new(psidpd_tests::python()).arg(script).arg(&question).output().unwrap();
    assert!(output.status.success(), "{}", psidpd_tests::said(&output));
    let found: Vec<String> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found.len(), scenes.len());
    found
}

#[test]
fn every_scene_is_valid_by_the_schema() {
    let paths = scenes();
    let texts: Vec<String> = paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    for (path, complaint) in paths.iter().zip(complaints(&texts)) {
        assert!(complaint.is_empty(), "{}: {complaint}", path.display());
    }
}

/// The reader and the schema accept the examples.
#[test]
fn every_example_of_the_reference_loads() {
    let page = reference();
    let folder = folder();
    let texts: Vec<String> = examples(&page).into_iter().map(completed).collect();
    for text in &texts {
        let scene =
            Scene::parse("example.toml", text, folder.path()).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let state = scene.initial_state();
        assert!(scene.simulation(state).is_ok(), "{text}");
    }
    for (text, complaint) in texts.iter().zip(complaints(&texts)) {
        assert!(complaint.is_empty(), "{complaint}\n{text}");
    }
    assert_eq!(texts.len(), 1 + TABLES.iter().map(|t| t.keys.len()).sum::<usize>());
}

/// The schema rejects unknown, missing and mistyped keys.
#[test]
fn the_schema_refuses_unknown_and_missing_keys() {
    let bad = [
        "kTT = 1.0",
        "kT = 0",
        "kT = \"warm\"",
        "seed = -1",
        "[box]\nlength = 3",
        "[box]\nlengths = 3\nboundary = \"open\"",
        "[initial]\ndensity = 3",
        "[initial]\nkind = \"slab\"",
        "[initial]\nkind = \"random\"\nthickness = 3",
        "[[part]]\nshape = \"sphere\"\nradius = 0",
        "[[part]]\nshape = \"rest\"\nradius = 1",
        "[[body_force]]\nspecies = [\"A\"]",
        "[[stage]]\nsteps = 3",
        "[[wall]]\nfaces = [\"zlo\"]",
        "[[stage]]\nname = \"a\"\nsteps = 3\nkT = [1, 2, 3]",
        "[output]\nthermo = 1.5",
        "[observe]\nrfd = true",
        "[observe.rdf]\nbin = 50",
        "[observe.rdf]\nbins = 0",
        "[observe]\nevery = 1.5",
        "[observe.pendant]\napex = \"top\"",
    ];
    for (text, complaint) in bad.iter().zip(complaints(&bad.map(completed))) {
        assert!(!complaint.is_empty(), "{text}");
    }
}

#[test]
fn every_key_is_read() {
    let folder = folder();
    Tables(TABLES).assert_all_are_read(completed, |text| Scene::parse("s.toml", text, folder.path()));
}

/// A key of another form is unknown, and the error lists the keys of this form.
#[test]
fn each_form_has_its_own_keys() {
    let text = completed("[initial]\nkind = \"data\"\nfile = \"start.data\"\nradius = 2.0");
    let error = Scene::parse("s.toml", &text, folder().path()).unwrap_err().to_string();
    assert!(
        error.contains("radius") && error.ends_with("known here: file, frozen_ids, kind, velocities"),
        "{error}"
    );
}

/// A number, a flag or a name in words.
fn literal(word: &str) -> Option<toml::Value> {
    let word = word.trim_end_matches(',');
    let value = match word.strip_prefix('`').and_then(|w| w.strip_suffix('`')) {
        Some(name) => format!("{:?}", name.trim_matches('"')),
        None => word.to_owned(),
    };
    toml::from_str::<toml::Table>(&format!("x = {value}")).ok()?.remove("x")
}

/// A key that is left out has the value that its description states.
#[test]
fn keys_that_are_left_out_have_the_values_that_are_stated() {
    let folder = folder();
    let parse = |text: &str| Scene::parse("s.toml", text, folder.path());
    let mut checked = Vec::new();
    for (table, key) in TABLES.iter().flat_map(|table| table.keys.iter().map(move |key| (table, key))) {
        let Some((before, _)) = key.about.split_once(" if left out") else { continue };
        // As in "Number of steps between frames; 0, no frames, if left out", or "Factor, 1 if left out".
        let first = before.rsplit_once("; ").and_then(|(_, words)| words.split(' ').next());
        let words = [first, before.split(' ').next_back()];
        let Some(value) = words.into_iter().flatten().find_map(literal) else { continue };
        let of = |change: &dyn Fn(&mut toml::Value) -> bool| {
            let mut scene: toml::Value = toml::from_str(&completed(key.example)).unwrap();
            assert!(change(&mut scene), "{}", key.example);
            let text = toml::to_string(&scene).unwrap();
            let s = parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            let walls = s.model.at(s.kt).unwrap().walls;
            let precision = s.precision.unwrap_or_default();
            format!("{:?}", (s.seed, precision, s.device, s.domain, s.initial, s.stages, s.output, walls))
        };
        let left_out = of(&|scene| put(scene, table.path, key.name, None));
        let stated = of(&|scene| put(scene, table.path, key.name, Some(&value)));
        assert_eq!(left_out, stated, "{}: {value}", key.name);
        assert_ne!(left_out, of(&|_| true), "the example has the value that is stated: {}", key.example);
        checked.push(key.name);
    }
    for table in observe::request::tables() {
        let read = |line: &str| parse(&completed(&format!("[observe.{}]\n{line}\n", table.path)));
        // Some observables need a flow, or a drop.
        let Ok(left_out) = read("").map(|scene| scene.observe) else { continue };
        for key in table.keys {
            let Some(value) = literal(key.default()) else { continue };
            let of = |value: &str| read(&format!("{} = {value}", key.name)).unwrap().observe;
            assert_eq!(of(&value.to_string()), left_out, "{}.{}", table.path, key.name);
            assert_ne!(of(key.example), left_out, "{}.{}", table.path, key.name);
            checked.push(key.name);
        }
    }
    assert!(checked.len() > 25, "{checked:?}");
}
