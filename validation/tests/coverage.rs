//! Error bars compared with the spread of results over seeds. Every observable with errors is in one of the scenes.
//!
//! The ratio of a column is the standard deviation of its results over the root mean square of its errors. It
//! should be within [`BOUNDS`], and a check fails if it is farther outside than chance explains: for n seeds, (n
//! − 1) times the square of the quotient of measured and true ratio is χ² with n − 1 degrees of freedom. Bins of
//! a profile count as one column: the mean of their squares, which varies no more than that of a single bin.

use psidpd::observe::{Column, Kind, Observation};
use psidpd::run::run_scene;
use psidpd::scene::Scene;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bounds of the ratio of spread to error.
const BOUNDS: [f64; 2] = [0.85, 1.15];

/// Probability of a false alarm of a check if all true ratios are at one of the bounds; it is far less if they are near 1.
const FALSE_ALARMS: f64 = 0.01;

/// Observables that are the root mean square of a quantity whose true value is 0. Their derivatives are taken
/// at the measured means instead of the true means, where they vanish, which makes errors √2 too large: the
/// sum of squares of K numbers of unit variance has the variance 2K, and these derivatives give 4K.
const NOISE: [&str; 2] = ["flow poiseuille.deviation", "pendant pendant.residual"];

/// A scene whose runs differ in their seeds alone.
struct Case {
    name: &'static str,
    model: &'static str,
    /// The scene without title, model and seed; its last table is `[observe]`.
    text: &'static str,
}

const WARREN: &str = include_str!("../models/warren2003-set6.toml");
const STANDARD: &str = include_str!("../models/standard-dpd.toml");

/// Two liquids that mix.
const MIXTURE: &str = r#"
title = "mixture"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 1.0
[excess_free_energy]
A = "0.1*n^2"
B = "0.1*n^2"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 20
range = 1
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 21
range = 1
[[pair]]
between = ["B", "B"]
form = "soft"
strength = 20
range = 1
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

const LIQUID: Case = Case {
    name: "liquid",
    model: WARREN,
    text: r#"
box = 3.0
density = 6.05
equilibrate = 500
steps = 3000
dt = 0.01
[observe]
temperature = true
pressure = true
energy = true
rdf = { bins = 30 }
structure_factor = { range = 12.0, bins = 6 }
msd = { length = 20, spacing = 5 }
viscosity = { length = 40 }
local_density = { bins = 30, range = 30.0 }
density_profile = { bins = 10 }
temperature_profile = { bins = 10 }
velocity_profile = { bins = 10 }
"#,
};

const MIXED: Case = Case {
    name: "mixture",
    model: MIXTURE,
    text: r#"
box = 4.0
density = 3.0
equilibrate = 500
steps = 3000
dt = 0.02
[observe]
temperature = true
pressure = true
energy = true
rdf = { bins = 30 }
structure_factor = { range = 8.0, bins = 5 }
msd = { length = 20, spacing = 5 }
composition_profile = { bins = 10 }
density_field = { bins = [8, 8] }
clusters = { species = "A", distance = 0.7, smallest = 2 }
"#,
};

const SLAB: Case = Case {
    name: "slab",
    model: WARREN,
    text: r#"
box = [3.0, 3.0, 8.0]
equilibrate = 500
steps = 3000
dt = 0.01
[initial]
kind = "slab"
thickness = 4.0
density = 6.05
[observe]
pressure = true
surface_tension = true
stress_profile = { bins = 40 }
interface_width = true
density_profile = { bins = 40 }
temperature_profile = { bins = 20 }
"#,
};

const DROP: Case = Case {
    name: "drop",
    model: WARREN,
    text: r#"
box = 8.0
equilibrate = 800
steps = 3000
dt = 0.01
[initial]
kind = "sphere"
radius = 2.1
density = 6.05
[observe]
drop = { distance = 0.8, bins = 40 }
"#,
};

/// The slowest mode of the flow's velocities has the relaxation time ρL²/(4π²η) = 3.3, which is 1/24 of the run.
const FLOW: Case = Case {
    name: "flow",
    model: STANDARD,
    text: r#"
box = [4.0, 4.0, 6.0]
density = 3.0
equilibrate = 1500
steps = 4000
dt = 0.02
[[body_force]]
acceleration = [0.15, 0.0, 0.0]
reversed_along = "z"
[observe]
poiseuille = { bins = 12 }
velocity_profile = { bins = 12 }
temperature_profile = { bins = 12 }
"#,
};

/// The support of the drop is a lattice: random positions would differ from run to run, and so would the drop.
const PENDANT: Case = Case {
    name: "pendant",
    model: WARREN,
    text: r#"
density = 6.05
[box]
lengths = [8.0, 8.0, 10.0]
boundary = ["periodic", "periodic", "reflecting"]
[[part]]
name = "support"
shape = "cylinder"
radius = 2.2
length = 1.0
center = [4.0, 4.0, 9.0]
lattice = "fcc"
frozen = true
[[part]]
name = "drop"
shape = "cylinder"
radius = 2.2
length = 5.0
center = [4.0, 4.0, 6.0]
[[body_force]]
acceleration = [0.0, 0.0, -0.15]
[[stage]]
name = "settle"
steps = 300
body_forces = false
[[stage]]
name = "hang"
steps = 9000
[observe]
pendant = { skip = 4000, weight = 0.15, bins = [8, 20] }
"#,
};

/// A ridge of liquid on a wall, whose shape changes slowly. The wall is a lattice, as the support above.
const RIDGE: Case = Case {
    name: "ridge",
    model: include_str!("wall-fluid.toml"),
    text: r#"
density = 6.05
[box]
lengths = [3.0, 14.0, 8.0]
boundary = ["periodic", "periodic", "reflecting"]
[[part]]
name = "wall"
shape = "layer"
face = "zlo"
thickness = 1.0
species = "W"
lattice = "fcc"
frozen = true
[[part]]
name = "drop"
shape = "cylinder"
axis = "x"
center = [1.5, 7.0, 3.4]
radius = 2.4
length = 3.0
species = "F"
min_distance = 0.42
[[stage]]
name = "settle"
steps = 2000
dt = 0.01
[[stage]]
name = "measure"
steps = 5000
dt = 0.01
[observe]
contact_angle = { wall = "zlo", axis = "x", stages = ["measure"] }
"#,
};

/// The observations of a scene's runs, by seed; `steps` replaces the steps of the last stage.
fn runs(case: &Case, seeds: usize, steps: Option<u64>) -> Vec<Vec<Observation>> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), case.model).unwrap();
    let text = format!("title = \"{}\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 1\n{}", case.name, case.text);
    let mut scene = Scene::parse("s.toml", &text, folder.path()).unwrap_or_else(|e| panic!("{e}"));
    let last = scene.stages.last_mut().unwrap();
    last.steps = steps.unwrap_or(last.steps);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds {
                return found;
            }
            let scene = Scene { seed: 1000 + seed as u64, ..scene.clone() };
            let out = folder.path().join(format!("{seed}"));
            run_scene(&scene, &out, &mut |_| ()).unwrap_or_else(|e| panic!("{e}"));
            let text = std::fs::read_to_string(out.join("observables.json")).unwrap();
            found.push((seed, serde_json::from_str::<Vec<Observation>>(&text).unwrap()));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut all = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect::<Vec<_>>()
    });
    all.sort_by_key(|(seed, _)| *seed);
    all.into_iter().map(|(_, observed)| observed).collect()
}

/// The ratio of spread to error of a column.
struct Ratio {
    name: String,
    /// The root of the mean square over bins.
    ratio: f64,
    /// The smallest and the largest ratio of single bins.
    range: [f64; 2],
    bins: usize,
}

/// Computes the ratio; `None` if no value of the column has an error in every run.
fn ratio(name: String, columns: &[&Column]) -> Option<Ratio> {
    let n = columns.len() as f64;
    let bins = columns.iter().map(|c| c.values.len()).min().unwrap_or(0);
    let squares: Vec<f64> = (0..bins)
        .filter(|k| columns.iter().all(|c| c.values[*k].is_finite() && c.errors[*k] > 0.0))
        .map(|k| {
            let mean = columns.iter().map(|c| c.values[k]).sum::<f64>() / n;
            let variance = columns.iter().map(|c| (c.values[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
            variance / (columns.iter().map(|c| c.errors[k].powi(2)).sum::<f64>() / n)
        })
        .collect();
    let range = [f64::min as fn(f64, f64) -> f64, f64::max]
        .map(|choose| squares.iter().copied().reduce(choose).map_or(f64::NAN, f64::sqrt));
    let ratio = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    (!squares.is_empty()).then_some(Ratio { name, ratio, range, bins: squares.len() })
}

fn ratios(case: &Case, seeds: usize, steps: Option<u64>) -> Vec<Ratio> {
    let all = runs(case, seeds, steps);
    let mut found = Vec::new();
    for (k, observation) in all[0].iter().enumerate().filter(|(_, o)| o.kind != Kind::Series) {
        // The heights at which a hanging drop has a surface differ between runs.
        let place = |run: &Vec<Observation>| run[k].x.as_ref().map(|x| x.values.clone());
        if all.iter().any(|run| place(run) != place(&all[0])) {
            println!("{} {}: values are at other places in each run", case.name, observation.name);
            continue;
        }
        for (c, column) in observation.columns.iter().enumerate() {
            let columns: Vec<&Column> = all.iter().map(|run| &run[k].columns[c]).collect();
            found.extend(ratio(format!("{} {}.{}", case.name, observation.name, column.name), &columns));
        }
    }
    found
}

/// Prints the ratios, and fails if one exceeds the bounds by more than chance explains.
fn check(found: &[Ratio], seeds: usize) {
    let free = (seeds - 1) as f64;
    let chi = ChiSquared::new(free).unwrap();
    let tail = 0.5 * FALSE_ALARMS / found.len() as f64;
    let chance = [tail, 1.0 - tail].map(|p| (chi.inverse_cdf(p) / free).sqrt());
    let limits = [BOUNDS[0] * chance[0], BOUNDS[1] * chance[1]];
    println!(
        "spread over {seeds} seeds / error, single bins; fails below {:.2} or above {:.2}",
        limits[0], limits[1]
    );
    let mut outside = Vec::new();
    for r in found {
        let bins = if r.bins > 1 {
            format!("{:.2} to {:.2} of {}", r.range[0], r.range[1], r.bins)
        } else {
            String::new()
        };
        println!("{:46} {:5.2}  {bins}", r.name, r.ratio);
        let expected = if NOISE.contains(&r.name.as_str()) { FRAC_1_SQRT_2 } else { 1.0 };
        if !(limits[0]..limits[1]).contains(&(r.ratio / expected)) {
            outside.push(format!("{} {:.2}", r.name, r.ratio));
        }
    }
    let within = found.iter().filter(|r| (BOUNDS[0]..BOUNDS[1]).contains(&r.ratio)).count();
    println!("{within} of {} are within {BOUNDS:?}", found.len());
    assert!(outside.is_empty(), "{outside:?}");
}

/// Quantities with short and with long correlation times: errors for independent samples would be half as
/// large as they should be.
#[test]
fn errors_of_short_runs_are_the_spread_over_seeds() {
    let cases = [(LIQUID, 800), (FLOW, 2500)];
    let found: Vec<Ratio> = cases.iter().flat_map(|(case, steps)| ratios(case, 24, Some(*steps))).collect();
    assert!(found.len() > 50);
    check(&found, 24);
}

#[test]
#[ignore = "five minutes of CPU: cargo test --release -p psidpd --test coverage -- --ignored --nocapture"]
fn errors_are_the_spread_over_seeds() {
    let cases = [LIQUID, MIXED, SLAB, DROP, FLOW, PENDANT, RIDGE];
    let found: Vec<Ratio> = cases.iter().flat_map(|case| ratios(case, 64, None)).collect();
    check(&found, 64);
}
