use super::*;
use psidpd_core::document::FileError;
use psidpd_observe::{Centre, Slab};

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
    let [part] = scene.initial.parts() else { panic!("one part") };
    assert_eq!(part.count, 630);
    assert_eq!(part.composition.0, [0.25, 0.75]);
    assert_eq!(scene.output, Output { thermo: 100, dump: 7, ..Output::default() });
    assert_eq!(scene.mass, [1.0, 1.0]);
    let [one, two] = scene.stages.as_slice() else { panic!("two stages") };
    assert_eq!((one.kt, one.thermostat, one.integrator), (1.5, true, crate::run::Integrator::VelocityVerlet));
    assert_eq!((two.kt, two.thermostat, two.steps), (2.0, false, 20));
    assert_eq!(two.integrator, crate::run::Integrator::GrootWarren { lambda: 0.65 });
}

/// Each row has the text to replace, its replacement, the line of the error, and a part of its message.
#[test]
fn errors_name_line_key_and_cause() {
    let cases = [
        ("title = \"test\"", "title = 1", 1, "title: expected a string"),
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
        ("\"random\"", "\"data\"", 6, "box.lengths: the initial file gives the box"),
        ("\"random\"", "\"slab\"", 7, "initial.thickness: is missing"),
        ("\"random\"", "\"slab\"\nthickness = 8", 9, "must not exceed the box"),
        ("\"random\"", "\"random\"\nthickness = 8", 9, "initial.thickness: unknown key"),
        ("density = 3.0", "density = -1", 9, "must be positive"),
        ("density = 3.0", "density = 1e-9", 9, "gives less than one particle"),
        ("density = 3.0", "count = 200_000_000", 9, "too many"),
        ("density = 3.0", "density = 3.0\ncount = 5", 10, "give one of them"),
        ("density = 3.0", "", 7, "needs a density or a count"),
        ("A = 0.25, B", "A = 0.25, C", 10, "unknown species \"C\""),
        ("A = 0.25, B", "A = 0.5, B", 10, "add up to 1.25"),
        ("steps = 10", "steps = 0", 13, "stage[1].steps: must be at least 1"),
        ("steps = 10", "steps = 1e3", 13, "expected an integer: 1000, not 1e3"),
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
    // The ratio 2K/kT is chi-squared with 3(N - 1) degrees of freedom; five standard deviations fail by
    // chance less than once in 10^6, and the seed is fixed.
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

/// Of particles that fill the box there is no centre: profiles of layers are centred on the first liquid.
#[test]
fn slabs_have_the_centre_that_their_liquids_have() {
    let start = SCENE.find("[initial]").unwrap();
    let end = SCENE.find("[[stage]]").unwrap();
    let slab = |parts: &str| {
        let scene = parse(&format!("density = 3.0\n{}{parts}{}", &SCENE[..start], &SCENE[end..]));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        scene.initial.slab(&scene.domain, 3)
    };
    let layer = |name: &str, at: f64, species: &str| {
        format!(
            "[[part]]\nname = \"{name}\"\nshape = \"slab\"\nat = {at}\nthickness = 3.5\nspecies = \"{species}\"\n"
        )
    };
    let rest = |species: &str| format!("[[part]]\nname = \"r\"\nshape = \"rest\"\nspecies = \"{species}\"\n");
    let of = |centre| Some(Slab { axis: 2, centre });
    let liquid = layer("one", 1.75, "B");
    for (parts, expected) in [
        (liquid.clone(), of(Centre::All)),
        (format!("{liquid}{}", layer("two", 5.25, "A")), of(Centre::Species(1))),
        (format!("{liquid}{}", rest("A")), of(Centre::Species(1))),
        (format!("{liquid}{}", rest("B")), of(Centre::Box)),
        (rest("B"), None),
    ] {
        assert_eq!(slab(&parts), expected, "{parts}");
    }
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

#[test]
fn five_lines_are_a_scene() {
    let text = "model = \"mixture.toml\"\nkT = 1.5\nbox = 6.0\ndensity = 3.0\nsteps = 40\n";
    let scene = parse(text).unwrap();
    assert_eq!((scene.title.as_str(), scene.seed), ("ideal mixture", 1));
    assert_eq!(scene.domain.lengths(), [6.0; 3]);
    let state = scene.initial_state();
    assert_eq!(state.len(), 648);
    assert_eq!(state.species.iter().filter(|s| **s == 0).count(), 324);
    let [stage] = scene.stages.as_slice() else { panic!("one stage") };
    assert_eq!((stage.name.as_str(), stage.steps, stage.dt, stage.kt), ("produce", 40, 0.01, 1.5));
    let longer = text.to_owned() + "equilibrate = 5\ndt = 0.02\nintegrator = \"groot-warren\"\n";
    let scene = parse(&longer).unwrap();
    let [first, second] = scene.stages.as_slice() else { panic!("two stages") };
    assert_eq!((first.name.as_str(), first.steps), ("equilibrate", 5));
    assert_eq!((second.steps, second.dt), (40, 0.02));
    assert_eq!(second.integrator, crate::run::Integrator::GrootWarren { lambda: 0.65 });
    // `[initial]` with a sphere replaces the random start at the same density.
    let ball = text.to_owned() + "[initial]\nkind = \"sphere\"\nradius = 2.0\n";
    let scene = parse(&ball).unwrap();
    assert_eq!(
        scene.initial.parts()[0].count,
        (3.0 * 4.0 / 3.0 * std::f64::consts::PI * 8.0f64).round() as usize
    );
    assert!((scene.densities()[1] - 1.5).abs() < 0.02);
}

/// A column that hangs from a frozen disc under a reflecting lid, over a frozen floor.
const PARTS: &str = r#"title = "parts"
model = "mixture.toml"
kT = 1.5
steps = 10
[box]
lengths = [8.0, 8.0, 12.0]
boundary = ["periodic", "periodic", "reflecting"]
[[part]]
name = "support"
shape = "cylinder"
radius = 2.5
length = 1.0
center = [4.0, 4.0, 11.5]
density = 4.0
species = "A"
lattice = "fcc"
frozen = true
[[part]]
name = "column"
shape = "cylinder"
radius = 2.0
length = 5.0
center = [4.0, 4.0, 8.5]
density = 4.0
species = "A"
velocity = [0.0, 0.0, -0.5]
[[part]]
name = "floor"
shape = "layer"
face = "zlo"
thickness = 1.0
density = 4.0
species = "B"
frozen = true
[[body_force]]
acceleration = [0.0, 0.0, -0.1]
parts = ["column"]
"#;

#[test]
fn parts_fill_their_regions_and_nothing_else() {
    let scene = parse(PARTS).unwrap();
    assert_eq!(scene.domain.periodic(), [true, true, false]);
    let state = scene.initial_state();
    let counts: Vec<usize> = scene.initial.parts().iter().map(|p| p.count).collect();
    // The volumes are 2.5² π, 2² 5 π and 64, at density 4.
    assert_eq!(counts, [79, 251, 256]);
    assert_eq!(state.len(), 586);
    let mut first = 0;
    for part in scene.initial.parts() {
        let range = first..first + part.count;
        assert!(state.x[range.clone()].iter().all(|x| part.shape.contains(*x, 3)), "{}", part.name);
        assert_eq!(state.v[range.clone()].iter().all(|v| *v == [0.0; 3]), part.frozen);
        first = range.end;
    }
    assert_eq!(scene.frozen, Tags::Ranges(vec![1..=79, 331..=586]));
    let [gravity] = scene.body_forces.as_slice() else { panic!("one") };
    assert!(
        gravity.acts_on(0, 80)
            && gravity.acts_on(0, 330)
            && !gravity.acts_on(0, 79)
            && !gravity.acts_on(1, 400)
    );
    // The column moves as one body, with thermal velocities of zero total momentum.
    let drift: f64 = state.v[79..330].iter().map(|v| v[2]).sum::<f64>() / 251.0;
    assert!((drift + 0.5).abs() < 1e-12);
}

#[test]
fn errors_of_parts_name_line_key_and_cause() {
    let cases = [
        (
            "radius = 2.0\nlength = 5.0",
            "radius = 2.0\nlength = 9.0",
            20,
            "part[2].shape: reaches from 4 to 13 along z",
        ),
        ("center = [4.0, 4.0, 8.5]", "center = [4.0, 4.0, 9.0]", 20, "part[2].shape: overlaps with part 1"),
        ("center = [4.0, 4.0, 8.5]", "center = [4.0, 4.0]", 23, "expected three numbers"),
        ("thickness = 1.0", "thickness = 7.0", 29, "overlaps with part 2"),
        ("face = \"zlo\"", "face = \"top\"", 30, "unknown face \"top\""),
        ("shape = \"layer\"", "shape = \"tube\"", 29, "unknown shape \"tube\""),
        (
            "shape = \"layer\"\nface = \"zlo\"\nthickness = 1.0",
            "shape = \"sphere\"",
            27,
            "radius: is missing",
        ),
        ("name = \"floor\"", "name = \"column\"", 28, "names two parts"),
        ("lattice = \"fcc\"", "lattice = \"fcc\"\nmin_distance = 0.1", 17, "a lattice is given too"),
        ("lattice = \"fcc\"", "lattice = \"hexagonal\"", 16, "unknown lattice"),
        ("lattice = \"fcc\"", "min_distance = 0.9", 16, "of 79 particles found a place"),
        ("species = \"A\"\nvelocity", "species = \"C\"\nvelocity", 25, "unknown species \"C\""),
        ("species = \"A\"\nvelocity", "density_ = 1\nvelocity", 25, "density_: unknown key"),
        (
            "density = 4.0\nspecies = \"A\"\nvelocity",
            "density = 1e-3\nvelocity",
            24,
            "gives less than one particle",
        ),
        (
            "species = \"A\"\nvelocity",
            "species = \"A\"\nfrozen = true\nvelocity",
            27,
            "is frozen, and does not move",
        ),
        (
            "parts = [\"column\"]",
            "parts = [\"drop\"]",
            37,
            "unknown part \"drop\"; known: support, column, floor",
        ),
        ("parts = [\"column\"]", "parts = [\"floor\"]", 37, "no force moves it"),
        ("parts = [\"column\"]", "species = []", 37, "names no species"),
        ("parts = [\"column\"]", "reversed_along = \"z\"", 36, "must not be along"),
        ("\"reflecting\"]", "\"open\"]", 7, "unknown boundary \"open\""),
        ("[\"periodic\", \"periodic\", \"reflecting\"]", "[\"periodic\"]", 7, "one for each of 3 directions"),
        ("steps = 10", "steps = 10\n[initial]\nkind = \"random\"", 10, "there is an [initial] too"),
        ("steps = 10", "equilibrate = 10", 1, "steps: is missing"),
        ("steps = 10", "", 1, "the scene gives no number of steps"),
    ];
    for (from, to, line, message) in cases {
        assert!(PARTS.contains(from), "{from}");
        let error = parse(&PARTS.replacen(from, to, 1)).expect_err(to);
        let text = error.to_string();
        assert!(text.contains(message), "{from} -> {to}: {text}");
        assert_eq!(error.line(), line, "{from} -> {to}: {text}");
    }
    let frozen =
        PARTS.replace("velocity = [0.0, 0.0, -0.5]", "frozen = true").replace("parts = [\"column\"]", "");
    assert!(parse(&frozen).unwrap_err().to_string().contains("every part is frozen"));
    let nothing = "model = \"mixture.toml\"\nkT = 1.0\nbox = 6\nsteps = 3\n";
    assert!(parse(nothing).unwrap_err().to_string().contains("the scene gives no particles"));
    let rests = nothing.to_owned() + "density = 1\n[[part]]\nshape = \"rest\"\n[[part]]\nshape = \"rest\"\n";
    assert!(parse(&rests).unwrap_err().to_string().contains("part 1 is the rest already"));
    let full = nothing.to_owned() + "density = 1\n[[part]]\nshape = \"box\"\n[[part]]\nshape = \"rest\"\n";
    assert!(parse(&full).unwrap_err().to_string().contains("leave no rest"));
}

/// Two drops that fly at each other in a bath: species, places and velocities are those of the file.
#[test]
fn drops_in_a_bath() {
    let text = "model = \"mixture.toml\"\nkT = 1.0\nbox = [8, 8, 14]\ndensity = 5\nsteps = 3\n\
        [[part]]\nshape = \"sphere\"\nradius = 2\ncenter = [4, 4, 4]\nspecies = \"A\"\nvelocity = [0, 0, 2]\nvelocities = \"zero\"\n\
        [[part]]\nshape = \"sphere\"\nradius = 2\ncenter = [5, 4, 10]\nspecies = \"A\"\nvelocity = [0, 0, -2]\n\
        [[part]]\nshape = \"rest\"\nspecies = \"B\"\n";
    let scene = parse(text).unwrap();
    let state = scene.initial_state();
    assert_eq!(
        state.len(),
        168 + 168 + (5.0f64 * (896.0 - 2.0 * 32.0 / 3.0 * std::f64::consts::PI)).round() as usize
    );
    assert!(state.v[..168].iter().all(|v| *v == [0.0, 0.0, 2.0]));
    let inside = |x: &[f64; 3]| scene.initial.parts()[..2].iter().any(|p| p.shape.contains(*x, 3));
    for (x, species) in state.x.iter().zip(&state.species) {
        assert_eq!(inside(x), *species == 0);
    }
}

#[test]
fn random_particles_keep_their_distance() {
    let nearest = |text: &str| {
        let state = parse(text).unwrap().initial_state();
        let pairs = (1..state.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let square = |(a, b)| -> f64 {
            let d = state.domain.minimum_image(state.x[a], state.x[b]);
            d.iter().map(|c| c * c).sum()
        };
        pairs.map(square).fold(f64::INFINITY, f64::min).sqrt()
    };
    let apart = SCENE.replace("density = 3.0", "density = 3.0\nmin_distance = 0.5");
    assert!(nearest(SCENE) < 0.2);
    assert!(nearest(&apart) >= 0.5);
    // The documentation promises these minimum distances: 0.75 and 0.7 of the mean distance.
    let full = SCENE.replace("density = 3.0", "density = 3.0\nmin_distance = 0.52");
    assert!(nearest(&full) >= 0.52);
    let flat = SCENE
        .replace("mixture.toml", "flat.toml")
        .replace("5.0, 6.0, 7.0", "9.0, 9.0")
        .replace("composition = { A = 0.25, B = 0.75 }\n", "min_distance = 0.4\n");
    assert!(nearest(&flat) >= 0.4);
}

#[test]
fn ramps_have_levels_that_add_up() {
    let text = SCENE.replace("kT = 2.0\nthermostat = false", "kT = [2.0, 1.0]\nlevels = 3");
    let scene = parse(&text).unwrap();
    let levels: Vec<(String, u64, f64)> =
        scene.stages[1..].iter().map(|s| (s.label(), s.steps, s.kt)).collect();
    assert_eq!(levels[0], ("two (1 of 3)".to_owned(), 7, 2.0 - 1.0 / 3.0));
    assert_eq!((levels[1].1, &levels[2]), (7, &("two (3 of 3)".to_owned(), 6, 1.0)));
    assert!(scene.stages[1..].iter().all(|s| s.name == "two"));
    let cases = [
        ("kT = 2.0", "kT = [2.0, 1.0]\nlevels = 21", 21, "must be from 1 to 20"),
        ("kT = 2.0", "kT = 2.0\nlevels = 4", 21, "only a ramp has levels"),
        ("kT = 2.0", "kT = [2.0, 1.0, 3.0]", 20, "two of a ramp"),
        ("kT = 2.0", "kT = [2.0, 0.0]", 20, "must be positive"),
    ];
    for (from, to, line, message) in cases {
        let error = parse(&SCENE.replace(from, to)).expect_err(to);
        assert!(error.to_string().contains(message), "{error}");
        assert_eq!(error.line(), line, "{error}");
    }
}

#[test]
fn data_files_bring_box_and_frozen_particles() {
    let folder = folder();
    let state = parse(PARTS).unwrap().initial_state();
    state.to_data_by_tag("t").write(&folder.path().join("start.data")).unwrap();
    let text = "model = \"mixture.toml\"\nkT = 1.0\nsteps = 3\n[box]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
                [initial]\nkind = \"data\"\nfile = \"start.data\"\nfrozen_ids = [1, 79]\n";
    let scene = Scene::parse("s.toml", text, folder.path()).unwrap();
    assert_eq!(scene.domain, state.domain);
    let start = scene.initial_state();
    assert_eq!(start.x, state.x);
    assert!(start.v[..79].iter().all(|v| *v == [0.0; 3]) && start.v[100] != [0.0; 3]);
    let momentum: f64 = start.v.iter().map(|v| v[0]).sum();
    assert!(momentum.abs() < 1e-10);
    let kept = Scene::parse("s.toml", &(text.to_owned() + "velocities = \"keep\"\n"), folder.path()).unwrap();
    assert_eq!(kept.initial_state().v, state.v);
    for (from, to, message) in [
        ("[1, 79]", "[700, 900]", "no particle of the file has an id from 700 to 900"),
        ("[1, 79]", "[1, 900]", "nothing would move"),
        ("[1, 79]", "[1]", "the first and the last id"),
        ("start.data", "none.data", "none.data"),
        ("steps = 3", "steps = 3\ndensity = 2.0", "the initial file gives the particles"),
    ] {
        let error = Scene::parse("s.toml", &text.replace(from, to), folder.path()).unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
    }
}

/// A run that starts from the checkpoint of another has the same positions and velocities.
#[test]
fn checkpoints_bring_all_but_the_clock() {
    let folder = folder();
    let first = Scene::parse("s.toml", PARTS, folder.path()).unwrap();
    crate::run::run_scene(&first, &folder.path().join("run"), &mut |_| ()).unwrap();
    std::fs::write(folder.path().join("lone.toml"), MIXTURE.replace(", \"B\"", "")).unwrap();
    let last = crate::run::checkpoint::read_state(&folder.path().join("run")).unwrap();
    let text = "model = \"mixture.toml\"\nkT = 1.0\nsteps = 3\n[box]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
                [initial]\nkind = \"checkpoint\"\nfile = \"run\"\nfrozen_ids = [1, 79]\n";
    let scene = Scene::parse("s.toml", text, folder.path()).unwrap();
    assert_eq!(scene.initial_state(), last);
    let file = Scene::parse("s.toml", &text.replace("\"run\"", "\"run/checkpoint\""), folder.path()).unwrap();
    assert_eq!(file.initial_state(), last);
    // Walls keep their places unless the scene gives others.
    let box_of = "[box]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n";
    let plain = Scene::parse("s.toml", &text.replace(box_of, ""), folder.path()).unwrap();
    assert_eq!(plain.domain, last.domain);
    for (from, to, message) in [
        ("\"run\"", "\"nowhere\"", "nowhere"),
        ("\"run\"", "\"mixture.toml\"", "mixture.toml"),
        ("mixture.toml", "lone.toml", "is not a state of this model"),
        ("\"reflecting\"", "\"periodic\"", ""),
    ] {
        match Scene::parse("s.toml", &text.replace(from, to), folder.path()) {
            Err(error) => assert!(!message.is_empty() && error.to_string().contains(message), "{error}"),
            Ok(scene) => assert!(message.is_empty() && scene.domain.periodic()[2], "{to}"),
        }
    }
}

/// Frozen particles, walls, body forces and a ramp continue bit for bit from any step.
#[test]
fn an_interrupted_run_of_parts_goes_on_to_the_same_bytes() {
    use crate::run::{Begin, Runner};
    use std::sync::atomic::{AtomicUsize, Ordering};
    let folder = folder();
    let stages = "[[stage]]\nname = \"ramp\"\nsteps = 12\nkT = [1.5, 1.0]\nlevels = 3\n\
                  [[stage]]\nname = \"free\"\nsteps = 6\nbody_forces = false\n";
    let text = PARTS.replace("steps = 10\n", "") + stages + "[output]\nthermo = 1\ndump = 5\n";
    let scene = Scene::parse("s.toml", &text, folder.path()).unwrap();
    let whole = folder.path().join("whole");
    crate::run::run_scene(&scene, &whole, &mut |_| ()).unwrap();
    let parts = folder.path().join("parts");
    for stop_at in [3, 7, 12, 15, 100] {
        let stop = AtomicUsize::new(0);
        let mut runner = Runner::begin(&scene, &parts, Begin::Resume).unwrap();
        let mut watch = |p: crate::run::Progress| stop.store((p.step >= stop_at) as usize, Ordering::Relaxed);
        runner.run(&stop, &mut watch).unwrap();
    }
    for file in ["thermo.csv", "dump.lammpstrj", "final.data", "summary.json"] {
        let [a, b] = [&whole, &parts].map(|f| std::fs::read(f.join(file)).unwrap());
        assert!(a == b, "{file}");
    }
}
