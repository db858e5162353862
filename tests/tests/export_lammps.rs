//! The decks of `export lammps` give the trajectory of the scene, step by step.

use psidpd::formats::{DataFile, dump};
use psidpd_core::maximum::largest;
use psidpd_tests::{lammps, program, root, said};
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

const ONE_SPECIES: &str = r#"
title = 'one """ species'
model = "MODELS/warren2003-set6.toml"
kT    = 1.0
seed  = 11
precision = "double"
[box]
lengths = [5.0, 6.0, 7.0]
[initial]
kind    = "random"
density = 6.0
[[stage]]
name  = 'all """ of it'
steps = 50
dt    = 0.005
[output]
thermo = 10
dump   = 25
"#;

const TWO_SPECIES: &str = r#"
title = "two species & stages"
model = "mixture.toml"
kT    = 1.0
seed  = 12
precision = "double"
[box]
lengths = [5.0, 5.0, 5.0]
[masses]
B = 2.0
[initial]
kind    = "lattice"
density = 3.0
composition = { A = 0.7, B = 0.3 }
[[stage]]
name  = "warm"
steps = 20
dt    = 0.02
[[stage]]
name  = "hot"
steps = 10
dt    = 0.01
kT    = 2.0
integrator = "groot-warren"
lambda = 0.5
[[stage]]
name  = "alone"
steps = 10
dt    = 0.01
thermostat = false
[[stage]]
name  = "warm again"
steps = 10
dt    = 0.02
[output]
thermo = 5
dump   = 10
"#;

/// A mixture with kT in ψ, partial densities, and a table in the model's folder.
const MIXTURE: &str = r#"
title   = "mixture"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range  = 1.0
[excess_free_energy]
A = "kT*0.1*n + 0.8*n_B + 0.05*n_A^2"
B = "2.0*n_A + 0.3*n_B"
[[thermostat]]
between = ["A", "B"]
gamma = 3.0
range = 0.8
[[thermostat]]
between = ["A", "A"]
gamma = 4.5
range = 1.0
[[thermostat]]
between = ["B", "B"]
gamma = 6.0
range = 1.0
[[pair]]
between = ["A", "B"]
form    = "table"
file    = "../ab.csv"
range   = 1.0
"#;

const FLAT: &str = r#"
title = "two dimensions"
model = "flat.toml"
kT    = 0.75
seed  = 13
precision = "double"
[box]
lengths = [7.0, 9.0]
[initial]
kind    = "lattice"
density = 12.0
[[stage]]
name  = "all"
steps = 50
dt    = 0.005
[output]
thermo = 10
dump   = 10
"#;

const FLAT_MODEL: &str = r#"
title = "van der Waals in two dimensions"
dimensions = 2
species = ["F"]
[density.n]
kernel = "quadratic"
range  = 1.0
[excess_free_energy]
F = "-kT*ln(1 - 0.016*n) - 0.0304*n - 0.0012*n^2"
[[thermostat]]
gamma = 1.0
range = 1.0
"#;

/// A box of walls with a frozen floor and a frozen block, gravity on one part, a uniform force on one species
/// of the other, a ramp, and stages with and without thermostat and body forces. A single particle meets two faces. Nothing else
/// does: under a force the native run bounces on the exact path, and LAMMPS mirrors.
const WALLS: &str = r#"
title = "walls"
model = "mixture.toml"
kT    = 3.0
seed  = 14
precision = "double"
dt    = 0.01
[box]
lengths  = [24.0, 6.0, 26.0]
boundary = ["reflecting", "periodic", "reflecting"]
[masses]
B = 2.0
[[part]]
shape     = "layer"
face      = "zlo"
thickness = 1.0
density   = 3.0
lattice   = "fcc"
frozen    = true
[[part]]
name    = "lower"
shape   = "box"
low     = [10.0, 0.0, 10.0]
high    = [14.0, 6.0, 12.5]
density = 3.0
[[part]]
shape   = "sphere"
radius  = 0.5
center  = [12.0, 3.0, 13.0]
count   = 5
frozen  = true
[[part]]
name    = "upper"
shape   = "box"
low     = [10.0, 0.0, 13.5]
high    = [14.0, 6.0, 15.5]
density = 3.0
min_distance = 0.3
velocity = [1.0, 0.0, 0.5]
[[part]]
shape    = "sphere"
radius   = 0.2
center   = [2.0, 3.0, 20.0]
count    = 1
velocity = [-15.0, 0.0, 20.0]
[[body_force]]
acceleration = [0.3, -0.2, -0.5]
parts        = ["upper"]
[[body_force]]
acceleration = [0.0, 0.7, 0.0]
reversed_along = "z"
parts        = ["lower", "upper"]
species      = ["B"]
[[stage]]
name  = "free"
steps = 10
body_forces = false
[[stage]]
name  = "ramp"
steps = 25
kT    = [3.0, 5.0]
levels = 3
[[stage]]
name  = "alone"
steps = 15
thermostat = false
[[stage]]
name  = "again"
steps = 15
body_forces = false
[[stage]]
name  = "and again"
steps = 20
integrator = "groot-warren"
lambda = 0.5
[output]
thermo = 5
dump   = 5
"#;

/// Two species between walls of matter, one of them moving, in stages with and without drag and noise. Nothing reaches the faces, where
/// the native run bounces on the exact path.
const MATTER: &str = r#"
title = "matter"
model = "mixture.toml"
kT    = 1.0
seed  = 16
precision = "double"
dt    = 0.005
[box]
lengths  = [5.0, 5.0, 6.0]
boundary = ["periodic", "periodic", "reflecting"]
[masses]
B = 2.0
[[part]]
shape   = "box"
low     = [0.0, 0.0, 0.5]
high    = [5.0, 5.0, 5.5]
density = 3.0
[[wall]]
kind     = "continuum"
faces    = ["zhi"]
species  = "B"
density  = 4.0
strength = 0.7
velocity = [1.5, -0.7, 0.0]
[[wall]]
kind          = "continuum"
faces         = ["zlo"]
species       = "A"
density       = 3.0
local_density = 2.5
drag          = 20.0
drag_range    = 0.9
[[stage]]
name  = "warm"
steps = 15
[[stage]]
name  = "alone"
steps = 5
thermostat = false
[[stage]]
name  = "hot"
steps = 15
kT    = 2.0
[output]
thermo = 5
dump   = 5
"#;

/// Opposite flows in a slab between two walls in two dimensions.
const CHANNELS: &str = r#"
title = "channels"
model = "flat.toml"
kT    = 2.5
seed  = 15
precision = "double"
steps = 60
dt    = 0.01
[box]
lengths  = [7.0, 17.0]
boundary = ["periodic", "reflecting"]
[initial]
kind      = "slab"
thickness = 4.5
density   = 12.0
[[body_force]]
acceleration   = [0.5, 0.0]
reversed_along = "y"
[output]
thermo = 10
dump   = 10
"#;

/// A folder with a scene in `scenes/`, its model and a table.
fn folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().join("scenes");
    std::fs::create_dir(&scenes).unwrap();
    let models = root().join("validation/models").display().to_string();
    std::fs::write(scenes.join("scene.toml"), scene.replace("MODELS", &models)).unwrap();
    std::fs::write(scenes.join("mixture.toml"), MIXTURE).unwrap();
    std::fs::write(scenes.join("flat.toml"), FLAT_MODEL).unwrap();
    let rows: String = (0..=50)
        .map(|k| {
            let r = 0.02 * f64::from(k);
            format!("{r}, {}\n", 8.0 * (1.0 - r).powi(3))
        })
        .collect();
    std::fs::write(folder.path().join("ab.csv"), format!("r, phi\n{rows}")).unwrap();
    folder
}

/// Runs the program with permission to read the table outside the folder of scene and model.
fn psidpd(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program())
        .args(arguments)
        .current_dir(folder)
        .env("PSIDPD_TABLES_ANYWHERE", "1")
        .output()
        .expect("the program starts")
}

/// Writes the deck of the scene in `folder`.
fn export(folder: &Path) -> Output {
    psidpd(folder, &["export", "lammps", "scenes/scene.toml", "--out", "deck", "--json", "deck.json"])
}

/// The message of a refused export on one line; long messages are wrapped and framed.
fn refusal(folder: &Path) -> String {
    let export = export(folder);
    let text = said(&export).replace('│', " ");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(export.status.code(), Some(2), "{text}");
    text
}

/// Runs `scene` natively and as a deck, on one rank and on two, and compares every row and frame.
fn compare(scene: &str) {
    let largest = 1e-10;
    let folder = folder(scene);
    let at = folder.path();
    let run = psidpd(at, &["run", "scenes/scene.toml", "--out", "native"]);
    assert!(run.status.success(), "{}", said(&run));
    let export = export(at);
    assert!(export.status.success(), "{}", said(&export));
    let deck = at.join("deck");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(at.join("deck.json")).unwrap()).unwrap();
    for file in json["files"].as_array().unwrap() {
        assert!(deck.join(file.as_str().unwrap()).is_file(), "{file}");
    }
    let (host, plugin) = lammps();
    // LAMMPS does not expand variables within quotes, so the value has quotes for paths with a space.
    let plugin = format!("\"{}\"", plugin.display());
    let arguments = ["-var", "plugin", &plugin];
    for ranks in [1, 2] {
        host.run_script(ranks, &deck, Path::new("in.lammps"), &arguments, Duration::from_secs(120)).unwrap();
        compare_frames(at, largest);
        compare_rows(at, 10.0 * largest);
        compare_ends(at, largest);
    }
}

/// A deck has the settings of its scene; in mixed precision both trajectories agree until rounding has grown.
#[test]
fn precision_is_that_of_the_scene() {
    let style = |scene: &str| {
        let folder = folder(scene);
        assert!(export(folder.path()).status.success());
        let script = std::fs::read_to_string(folder.path().join("deck/in.lammps")).unwrap();
        let line = script.lines().find(|l| l.starts_with("pair_style")).unwrap().to_owned();
        (folder, line)
    };
    assert!(style(ONE_SPECIES).1.ends_with("dpd/psi 1.0 11 precision double"));
    assert!(style(&ONE_SPECIES.replace("precision = \"double\"\n", "")).1.ends_with("11 precision mixed"));
    let (folder, line) =
        style(&ONE_SPECIES.replace("\"double\"", "\"mixed\"").replace("dump   = 25", "dump   = 5"));
    assert!(line.ends_with("dpd/psi 1.0 11 precision mixed"));
    let at = folder.path();
    let run = psidpd(at, &["run", "scenes/scene.toml", "--out", "native"]);
    assert!(run.status.success(), "{}", said(&run));
    let (host, plugin) = lammps();
    let plugin = format!("\"{}\"", plugin.display());
    let (deck, arguments) = (at.join("deck"), ["-var", "plugin", &plugin]);
    host.run_script(1, &deck, Path::new("in.lammps"), &arguments, Duration::from_secs(120)).unwrap();
    let read = |folder: &str| {
        let mut frames = dump::read(&at.join(folder).join("dump.lammpstrj")).unwrap();
        assert!(frames[1].sort_by_id() && frames[1].step == 5);
        frames[1].vectors(["x", "y", "z"]).unwrap()
    };
    let most = |a: Vec<[f64; 3]>, b: Vec<[f64; 3]>| {
        largest(a.iter().zip(&b).map(|(a, b)| distance(*a, *b, [5.0, 6.0, 7.0])))
    };
    let off = most(read("native"), read("deck"));
    assert!(off < 1e-6, "{off:e}");
}

/// The largest component of the difference, modulo the box lengths.
fn distance(a: [f64; 3], b: [f64; 3], length: [f64; 3]) -> f64 {
    largest((0..3).map(|c| {
        let d = a[c] - b[c];
        (d - length[c] * (d / length[c]).round()).abs()
    }))
}

fn compare_frames(at: &Path, bound: f64) {
    let read = |folder: &str| {
        let mut frames = dump::read(&at.join(folder).join("dump.lammpstrj")).unwrap();
        frames.iter_mut().for_each(|f| assert!(f.sort_by_id()));
        frames
    };
    let (ours, theirs) = (read("native"), read("deck"));
    assert_eq!(ours.len(), theirs.len());
    assert!(ours.len() > 2);
    for (a, b) in ours.iter().zip(&theirs) {
        assert_eq!(a.step, b.step);
        assert_eq!(a.get("type"), b.get("type"));
        let length: [f64; 3] = std::array::from_fn(|c| a.boxhi[c] - a.boxlo[c]);
        for (names, length) in [(["x", "y", "z"], length), (["vx", "vy", "vz"], [f64::MAX; 3])] {
            let (a, b) = (a.vectors(names).unwrap(), b.vectors(names).unwrap());
            assert_eq!(a.len(), b.len());
            let most = largest(a.iter().zip(&b).map(|(a, b)| distance(*a, *b, length)));
            assert!(most < bound, "{names:?} differ by {most:e}");
        }
    }
}

/// Compares thermo.csv with the rows of the log.
fn compare_rows(at: &Path, bound: f64) {
    let numbers = |line: &str, separator: char| -> Option<Vec<f64>> {
        let fields = line.split(separator).filter(|f| !f.trim().is_empty());
        fields.map(|f| f.trim().parse().ok()).collect()
    };
    let csv = std::fs::read_to_string(at.join("native/thermo.csv")).unwrap();
    let log = std::fs::read_to_string(at.join("deck/log.lammps")).unwrap();
    let theirs: Vec<Vec<f64>> =
        log.lines().filter_map(|l| numbers(l, ' ')).filter(|row| row.len() == 12).collect();
    let ours: Vec<Vec<f64>> = csv.lines().skip(1).map(|l| numbers(l, ',').unwrap()).collect();
    assert!(ours.len() > 4);
    for row in &ours {
        // The log has a row for the end of a stage and one for the start of the next; the first has the
        // forces of the native row.
        let other = theirs.iter().find(|r| r[0] == row[0]).unwrap_or_else(|| panic!("no row {}", row[0]));
        for (a, b) in row.iter().zip(other) {
            assert!((a - b).abs() <= bound * (1.0 + a.abs()), "{row:?}\n{other:?}");
        }
    }
}

fn compare_ends(at: &Path, bound: f64) {
    let [ours, theirs] = ["native", "deck"].map(|folder| {
        let mut data = DataFile::read(&at.join(folder).join("final.data")).unwrap();
        data.sort_by_id();
        data
    });
    assert_eq!(ours.masses, theirs.masses);
    assert_eq!(ours.atoms.len(), theirs.atoms.len());
    let length: [f64; 3] = std::array::from_fn(|c| ours.boxhi[c] - ours.boxlo[c]);
    for (a, b) in ours.atoms.iter().zip(&theirs.atoms) {
        let unwrapped = |x: [f64; 3], image: [i32; 3]| -> [f64; 3] {
            std::array::from_fn(|c| x[c] + f64::from(image[c]) * length[c])
        };
        let most = distance(unwrapped(a.x, a.image), unwrapped(b.x, b.image), [f64::MAX; 3]);
        assert!(a.id == b.id && most < bound, "{a:?} {b:?}");
    }
}

#[test]
fn one_species_in_three_dimensions() {
    compare(ONE_SPECIES);
}

#[test]
fn two_species_stages_and_a_table() {
    compare(TWO_SPECIES);
}

#[test]
fn two_dimensions() {
    compare(FLAT);
}

#[test]
fn walls_frozen_particles_body_forces_and_a_ramp() {
    compare(WALLS);
}

/// Sets an integrator with its keys in all stages of a scene.
fn with_integrator(scene: &str, lines: &str) -> String {
    let scene = scene.replace("integrator = \"groot-warren\"\nlambda = 0.5\n", "");
    let scene: String = scene
        .lines()
        .map(
            |line| if line.starts_with("steps") { format!("{line}\n{lines}\n") } else { format!("{line}\n") },
        )
        .collect();
    assert!(scene.contains(lines));
    scene
}

#[test]
fn two_stages_with_one_thermostat() {
    compare(&with_integrator(ONE_SPECIES, "integrator = \"two-stage\""));
}

#[test]
fn forces_at_displaced_positions() {
    compare(&with_integrator(ONE_SPECIES, "integrator = \"force-gradient\""));
}

/// Two masses, displacements larger than necessary, and a thermostat at every second step.
#[test]
fn displaced_masses() {
    let lines = "integrator = \"force-gradient\"\nlambda = 0.17\ngradient = 0.2\nthermostat_every = 2";
    compare(&with_integrator(TWO_SPECIES, lines));
}

#[test]
fn forces_in_the_middle() {
    compare(&with_integrator(ONE_SPECIES, "integrator = \"aboba\""));
}

/// Stages differ in temperature, step and integrator; one has no thermostat.
#[test]
fn a_thermostat_at_every_third_step() {
    let lines = "integrator = \"two-stage\"\nlambda = 0.2\nthermostat_every = 3\nnoise = \"uniform\"";
    let scene = with_integrator(TWO_SPECIES, lines);
    let last = scene.rfind(lines).unwrap();
    let other = "integrator = \"aboba\"\nthermostat_every = 2";
    compare(&format!("{}{other}{}", &scene[..last], &scene[last + lines.len()..]));
}

#[test]
fn a_splitting_in_two_dimensions() {
    for integrator in ["two-stage", "force-gradient"] {
        compare(&with_integrator(FLAT, &format!("integrator = \"{integrator}\"")));
    }
}

/// A particle is reflected after each drift, and frozen particles exert drag.
#[test]
fn splittings_between_walls() {
    // The test has few steps, because rounding grows fast among fast particles. A lost pair would change forces by 10⁻².
    let short = [("steps = 25", "steps = 10"), ("steps = 15", "steps = 5"), ("steps = 20", "steps = 10")];
    let scene = short.iter().fold(WALLS.to_owned(), |scene, (long, short)| scene.replace(long, short));
    for integrator in ["two-stage", "force-gradient", "aboba"] {
        compare(&with_integrator(&scene, &format!("integrator = \"{integrator}\"")));
    }
}

/// Forces, energies, pressures, drag and noise of walls, with velocity Verlet and with drag and noise of pairs apart.
#[test]
fn walls_of_matter() {
    compare(MATTER);
    for integrator in ["two-stage", "force-gradient", "aboba"] {
        compare(&with_integrator(MATTER, &format!("integrator = \"{integrator}\"")));
    }
}

/// Walls around one species whose local density theory knows, with the drag on which a flow does not slip, in space and in the plane.
#[test]
fn walls_of_one_species() {
    let wall = |faces: &str| {
        format!("[[wall]]\nkind = \"continuum\"\nfaces = {faces}\ndensity = 5.0\nviscosity = 7.0\n[[stage]]")
    };
    let part = |low: &str, high: &str, rest: &str| {
        format!("[[part]]\nshape = \"box\"\nlow = {low}\nhigh = {high}\n{rest}\n")
    };
    let space = ONE_SPECIES
        .replace(
            "lengths = [5.0, 6.0, 7.0]",
            "lengths = [5.0, 6.0, 7.0]\nboundary = [\"periodic\", \"reflecting\", \"periodic\"]",
        )
        .replace("[initial]\nkind    = \"random\"\n", &part("[0.0, 0.6, 0.0]", "[5.0, 5.4, 7.0]", ""))
        .replace("steps = 50", "steps = 15")
        .replace("dump   = 25", "dump   = 5")
        .replace("thermo = 10", "thermo = 3")
        .replace("[[stage]]", &wall("[\"ylo\", \"yhi\"]"));
    compare(&space);
    let plane = FLAT
        .replace("lengths = [7.0, 9.0]", "lengths = [7.0, 9.0]\nboundary = [\"reflecting\", \"periodic\"]")
        .replace(
            "[initial]\nkind    = \"lattice\"\n",
            &part("[0.6, 0.0]", "[6.4, 9.0]", "lattice = \"square\""),
        )
        .replace("steps = 50", "steps = 15")
        .replace("dump   = 10", "dump   = 5")
        .replace("thermo = 10", "thermo = 3")
        .replace("[[stage]]", &wall("[\"xhi\"]"));
    compare(&plane);
}

/// [`MATTER`] with other walls, in a box with these edges, and the fluid up to their surfaces.
fn beside_rounds(edges: &str, walls: &str) -> String {
    let at = |text: &str| MATTER.find(text).unwrap();
    let (head, masses) = (&MATTER[..at("[box]")], &MATTER[at("[masses]")..at("[[part]]")]);
    let (head, stages) = (head.replace("dt    = 0.005", "dt    = 0.01"), &MATTER[at("[[stage]]")..]);
    format!("{head}[box]\n{edges}{masses}[[part]]\nshape = \"rest\"\ndensity = 3.0\n{walls}{stages}")
}

/// Walls of matter that are cylinders and spheres. Particles are at their surfaces from the start, and bounce on the exact path in both
/// programs, with every integrator: in a capillary that moves, in a cavity, around a fibre and a ball.
#[test]
fn cylinders_and_spheres_of_matter() {
    let wall = |shape: &str, more: &str| {
        format!("[[wall]]\nkind = \"continuum\"\nspecies = \"B\"\ndensity = 4.0\nshape = \"{shape}\"\n{more}")
    };
    let capillary = wall(
        "cylinder",
        "radius = 2.2\nfluid = \"inside\"\nvelocity = [0.0, 0.0, 1.5]\ndrag = 20.0\nstrength = 0.7\n",
    );
    let fibre = wall("cylinder", "axis = \"x\"\ncenter = [1.4, 1.6]\nradius = 1.1\nfluid = \"outside\"\n");
    let ball =
        wall("sphere", "center = [3.5, 4.6, 4.7]\nradius = 1.2\nfluid = \"outside\"\nlocal_density = 2.5\n");
    let cavity = wall("sphere", "radius = 2.3\nfluid = \"inside\"\nviscosity = 2.0\n");
    let closed = "lengths = [5.0, 5.0, 5.0]\nboundary = \"reflecting\"\n";
    let scenes = [
        beside_rounds("lengths = [5.6, 5.5, 5.0]\n", &capillary),
        beside_rounds("lengths = [5.0, 6.0, 6.0]\n", &(fibre + &ball)),
        beside_rounds(closed, &cavity),
    ];
    scenes.iter().for_each(|scene| compare(scene));
    for integrator in ["two-stage", "force-gradient", "aboba"] {
        for scene in &scenes[..2] {
            compare(&with_integrator(scene, &format!("integrator = \"{integrator}\"")));
        }
    }
}

/// A circle of matter in two dimensions.
#[test]
fn circles_of_matter() {
    let circle = "[[part]]\nshape = \"rest\"\ndensity = 12.0\n[[wall]]\nkind = \"continuum\"\nshape = \"sphere\"\nradius = 1.8\n\
        center = [3.5, 4.5]\nfluid = \"outside\"\ndensity = 12.0\nviscosity = 5.0\n[[stage]]";
    let scene = FLAT.replace("[initial]\nkind    = \"lattice\"\ndensity = 12.0\n[[stage]]", circle);
    assert!(scene.contains(circle));
    compare(
        &scene
            .replace("steps = 50", "steps = 20")
            .replace("dump   = 10", "dump   = 5")
            .replace("thermo = 10", "thermo = 4"),
    );
}

#[test]
fn opposite_flows_between_walls_in_two_dimensions() {
    compare(CHANNELS);
}

#[test]
fn what_has_no_counterpart_is_refused() {
    let cases = [
        (
            ONE_SPECIES.replace("dt    = 0.005", "dt    = 0.005\nintegrator = \"groot-warren\""),
            "(groot-warren, lambda = 0.65) has no counterpart",
        ),
        (
            ONE_SPECIES.replace("dt    = 0.005", "dt    = 0.005\nintegrator = \"baoab\""),
            "(baoab, thermostat_step = midpoint) has no counterpart",
        ),
        (
            ONE_SPECIES.replace(
                "dt    = 0.005",
                "dt    = 0.005\nintegrator = \"two-stage\"\nthermostat_step = \"pairwise\"",
            ),
            "thermostat_step = pairwise) has no counterpart",
        ),
        (ONE_SPECIES.replace("seed  = 11", "seed  = 0"), "the seed must be at least 1"),
        (
            ONE_SPECIES.to_owned() + &"[[body_force]]\nacceleration = [0.0, 0.0, 1.0]\n".repeat(10),
            "more groups than LAMMPS has",
        ),
        (ONE_SPECIES.replace("steps = 50", "steps = 3000000000"), "more than one run of LAMMPS takes"),
    ];
    for (scene, message) in cases {
        let text = refusal(folder(&scene).path());
        assert!(text.contains(message), "{message}\n{text}");
    }
}

/// The export cannot remove a thermostat that is not written in sections of its own.
#[test]
fn an_inline_thermostat_is_refused_where_it_must_go() {
    let folder = folder(&FLAT.replace("dt    = 0.005", "dt    = 0.005\nthermostat = false"));
    let inline = FLAT_MODEL
        .replace("[[thermostat]]\ngamma = 1.0\nrange = 1.0\n", "")
        .replace("species = [\"F\"]", "species = [\"F\"]\nthermostat = [{ gamma = 1.0, range = 1.0 }]");
    std::fs::write(folder.path().join("scenes/flat.toml"), inline).unwrap();
    let text = refusal(folder.path());
    assert!(text.contains("cannot remove the thermostat"), "{text}");
}
