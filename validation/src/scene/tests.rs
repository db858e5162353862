use super::*;
use psidpd_core::document::FileError;

const MIXTURE: &str = r#"
title = "ideal mixture"
species = ["A", "B"]
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

const FLAT: &str = r#"
title = "flat"
dimensions = 2
species = ["A"]
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

const SCENE: &str = r#"title = "test"
model = "mixture.toml"
kT = 1.5
seed = 3
[box]
lengths = [5.0, 6.0, 7.0]
[initial]
kind = "random"
density = 3.0
composition = { A = 0.25, B = 0.75 }
[[stage]]
name = "one"
steps = 10
dt = 0.01
[[stage]]
name = "two"
steps = 20
dt = 0.02
integrator = "groot-warren"
kT = 2.0
thermostat = false
[output]
dump = 7
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mixture.toml"), MIXTURE).unwrap();
    std::fs::write(folder.path().join("flat.toml"), FLAT).unwrap();
    folder
}

fn parse(text: &str) -> Result<Scene, FileError> {
    let folder = folder();
    Scene::parse("s.toml", text, folder.path())
}

#[test]
fn reads_the_schema() {
    let scene = parse(SCENE).unwrap();
    let Initial::Filling(filling) = &scene.initial else { panic!("not a file") };
    assert_eq!(filling.count, 630);
    assert_eq!(filling.composition.fractions(), [0.25, 0.75]);
    assert_eq!(scene.output, Output { thermo: 100, dump: 7, ..Output::default() });
    assert_eq!(scene.mass, [1.0, 1.0]);
    let [one, two] = scene.stages.as_slice() else { panic!("two stages") };
    assert_eq!((one.kt, one.thermostat, one.integrator), (1.5, true, crate::run::Integrator::VelocityVerlet));
    assert_eq!((two.kt, two.thermostat, two.steps), (2.0, false, 20));
    assert_eq!(two.integrator, crate::run::Integrator::GrootWarren { lambda: 0.65 });
}

/// What is replaced, by what, on which line the error is, and a part of its message.
#[test]
fn errors_name_line_key_and_cause() {
    let cases = [
        ("title = \"test\"", "", 1, "title: is missing"),
        ("mixture.toml", "nothing.toml", 2, "nothing.toml cannot be read"),
        ("kT = 1.5", "kT = 0", 3, "kT: must be positive, is 0"),
        ("kT = 1.5", "kT = nan", 3, "not a finite number"),
        ("seed = 3", "seed = -1", 4, "whole number from 0"),
        ("seed = 3", "seed = 3\nbox_ = 1", 5, "box_: unknown key"),
        ("5.0, 6.0, 7.0", "5.0, 6.0", 6, "expected three lengths"),
        ("5.0, 6.0, 7.0", "5.0, 6.0, 0", 6, "box.lengths: must be positive"),
        ("5.0, 6.0, 7.0", "5.0, 1.9, 7.0", 6, "share their noise"),
        ("5.0, 6.0, 7.0", "5.0, 1e308, 1e308", 6, "span no volume"),
        ("\"random\"", "\"dat\"", 8, "unknown kind \"dat\""),
        ("\"random\"", "\"data\"", 5, "the box is that of the data file"),
        ("\"random\"", "\"slab\"", 7, "initial.thickness: is missing"),
        ("\"random\"", "\"slab\"\nthickness = 8", 9, "must not exceed the box"),
        ("\"random\"", "\"random\"\nthickness = 8", 9, "initial.thickness: unknown key"),
        ("density = 3.0", "density = -1", 9, "must be positive"),
        ("density = 3.0", "density = 1e-9", 9, "without a particle"),
        ("density = 3.0", "count = 200_000_000", 9, "too many"),
        ("density = 3.0", "density = 3.0\ncount = 5", 10, "give one of them"),
        ("density = 3.0", "", 7, "needs a density or a count"),
        ("A = 0.25, B", "A = 0.25, C", 10, "unknown species \"C\""),
        ("A = 0.25, B", "A = 0.5, B", 10, "add up to 1.25"),
        ("steps = 10", "steps = 0", 13, "stage[1].steps: must be at least 1"),
        ("steps = 10", "steps = 1e3", 13, "expected a whole number"),
        ("steps = 20", "steps = 9_100_000_000_000_000", 17, "steps in all"),
        ("dt = 0.02", "dt = 0", 18, "stage[2].dt: must be positive"),
        ("dt = 0.02", "dt = 0.02\nlamda = 1", 19, "stage[2].lamda: unknown key"),
        ("dt = 0.01", "dt = 0.01\nlambda = 0.5", 15, "has no lambda"),
        ("kT = 2.0", "kT = -2.0", 20, "must be positive"),
        ("kT = 2.0", "lambda = 1.5", 20, "must be from 0 to 1"),
        ("name = \"two\"", "name = \"one\"", 16, "names two stages"),
        ("dump = 7", "dump = 7\nthermos = 1", 24, "output.thermos: unknown key"),
        ("dump = 7", "dump = 7\ncheckpoint = -1", 24, "whole number from 0"),
        ("[output]", "[masses]\nA = 0\n[output]", 23, "masses.A: must be positive"),
        ("[output]", "[masses]\nD = 1\n[output]", 23, "unknown species \"D\""),
    ];
    for (from, to, line, message) in cases {
        assert!(SCENE.contains(from), "{from}");
        let error = parse(&SCENE.replacen(from, to, 1)).expect_err(to);
        let text = error.to_string();
        assert!(text.contains(message), "{from} -> {to}: {text}");
        assert_eq!(error.line(), line, "{from} -> {to}: {text}");
        assert!(text.starts_with("s.toml:"), "{text}");
    }
}

#[test]
fn a_narrow_box_is_fine_without_noise() {
    let narrow = SCENE.replace("5.0, 6.0, 7.0", "5.0, 1.9, 7.0").replacen(
        "dt = 0.01",
        "dt = 0.01\nthermostat = false",
        1,
    );
    parse(&narrow).unwrap();
}

#[test]
fn a_wrong_model_file_is_reported_in_that_file() {
    let folder = folder();
    std::fs::write(folder.path().join("mixture.toml"), "title = \"x\"\n").unwrap();
    let error = Scene::parse("s.toml", SCENE, folder.path()).unwrap_err();
    assert!(error.to_string().contains("mixture.toml:1: species: is missing"), "{error}");
}

#[test]
fn thermal_velocities_have_no_momentum_and_about_the_temperature() {
    let text = SCENE.replace("[output]", "[masses]\nA = 3\n[output]");
    let scene = parse(&text).unwrap();
    let state = scene.initial_state();
    assert_eq!(state, scene.initial_state());
    assert_ne!(state, parse(&text.replace("seed = 3", "seed = 4")).unwrap().initial_state());
    assert_eq!(state.species.iter().filter(|s| **s == 0).count(), 158);
    let mass = |k: usize| state.mass[state.species[k] as usize];
    for c in 0..3 {
        let momentum: f64 = (0..state.len()).map(|k| mass(k) * state.v[k][c]).sum();
        assert!(momentum.abs() < 1e-10);
    }
    // 2K/kT is chi-squared with 3(N - 1) degrees of freedom; five standard deviations fail by chance
    // less than once in 10^6, and the seed is fixed.
    let freedom = 3.0 * (state.len() - 1) as f64;
    let twice_kinetic: f64 =
        (0..state.len()).map(|k| mass(k) * state.v[k].iter().map(|v| v * v).sum::<f64>()).sum();
    let z = (twice_kinetic / 1.5 - freedom) / (2.0 * freedom).sqrt();
    assert!(z.abs() < 5.0, "{z}");
}

#[test]
fn slabs_and_lattices_are_where_they_should_be() {
    let slab = SCENE.replace("\"random\"", "\"slab\"\naxis = \"x\"\nthickness = 2.0");
    let state = parse(&slab).unwrap().initial_state();
    assert_eq!(state.len(), 252);
    assert!(state.x.iter().all(|x| (1.5..=3.5).contains(&x[0])));
    let lattice = SCENE.replace("\"random\"", "\"lattice\"").replace("density = 3.0", "count = 500");
    let state = parse(&lattice).unwrap().initial_state();
    let nearest = (1..state.len())
        .flat_map(|a| (0..a).map(move |b| (a, b)))
        .map(|(a, b)| {
            let d = state.domain.minimum_image(state.x[a], state.x[b]);
            d.iter().map(|c| c * c).sum::<f64>().sqrt()
        })
        .fold(f64::INFINITY, f64::min);
    let ideal = (210.0f64 / 500.0).cbrt();
    assert!(nearest > 0.85 * ideal, "{nearest} against {ideal}");
}

#[test]
fn flat_scenes_stay_flat() {
    let text = SCENE
        .replace("mixture.toml", "flat.toml")
        .replace("5.0, 6.0, 7.0", "5.0, 6.0")
        .replace("composition = { A = 0.25, B = 0.75 }\n", "");
    let state = parse(&text).unwrap().initial_state();
    assert_eq!(state.len(), 90);
    assert!(state.x.iter().all(|x| x[2] == 0.0) && state.v.iter().all(|v| v[2] == 0.0));
    let slab = text.replace("\"random\"", "\"slab\"\nthickness = 3\naxis = \"z\"");
    assert!(parse(&slab).unwrap_err().to_string().contains("unknown axis \"z\""));
}

/// Every scene that ships can be read.
#[test]
fn shipped_scenes_are_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            Scene::open(&path).unwrap_or_else(|e| panic!("{e}"));
            count += 1;
        }
    }
    assert!(count >= 5);
}
