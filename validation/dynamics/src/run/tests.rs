use super::*;
use crate::scene::Scene;
use crate::tests::support::{self, IDEAL, IDEAL_MIXTURE, SET6};
use psidpd_core::document::FileError;
use psidpd_core::engine::Want;
use psidpd_core::model::Model;
use std::path::Path;

mod continuum;
mod device;
mod faces;
mod force_gradient;
#[cfg(feature = "gpu")]
mod gpu;
mod held;
mod hot;
mod integrators;
mod live;
mod matter;
mod monte_carlo;
mod order;
mod rates;
mod resume;
mod round;
mod steps;

const VAN_DER_WAALS: &str = r#"
title = "flat van der Waals"
dimensions = 2
species = ["A"]
[parameters]
b = 0.016
a = "1.9*b"
[density.n]
kernel = "quadratic"
range = 1.0
[excess_free_energy]
A = "-kT*ln(1 - b*n) - a*n - 2.5*a*b*n^2"
[[thermostat]]
gamma = 1.0
range = 1.0
"#;

/// A scene of `model` in a box of `lengths`, with the given stages and output.
fn scene_of(model: &str, lengths: &str, density: f64, rest: &str) -> Result<Scene, FileError> {
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\n[box]\nlengths = {lengths}\n\
         [initial]\nkind = \"random\"\ndensity = {density}\n{rest}"
    );
    support::scene(model, &text)
}

const ONE_STAGE: &str =
    "[[stage]]\nname = \"run\"\nsteps = 40\ndt = 0.01\n[output]\nthermo = 10\ndump = 20\n";

fn state_of(model: &str, lengths: &str, density: f64) -> State {
    scene_of(model, lengths, density, ONE_STAGE).unwrap().initial_state()
}

fn simulation(model: &str, state: State) -> Simulation {
    Simulation::new(&Model::parse("m.toml", model).unwrap(), 1.0, state, 7).unwrap()
}

fn advance(simulation: &mut Simulation, steps: u64, dt: f64, integrator: Integrator) {
    simulation.prepare(dt, Want::FORCES).unwrap();
    simulation.advance(steps, dt, integrator).unwrap();
}

fn momentum(run: &Simulation) -> [f64; 3] {
    let State { v, species, mass, .. } = run.state();
    let mut sum = [0.0; 3];
    for (v, s) in v.iter().zip(species) {
        (0..3).for_each(|c| sum[c] += mass[*s as usize] * v[c]);
    }
    sum
}

/// An equilibrated state of set 6 in a small box.
fn settled() -> State {
    let mut simulation = simulation(SET6, state_of(SET6, "[4.0, 4.0, 4.0]", 6.05));
    advance(&mut simulation, 300, 0.01, Integrator::VelocityVerlet);
    simulation.state().clone()
}

/// Deviations of the energy over half a time unit, over several starts: forces have kinks, at their ranges
/// and where particles pass through each other, which make single deviations scatter about the trend.
#[test]
fn energy_is_conserved_to_second_order() {
    let mut run = simulation(SET6, settled());
    let starts: Vec<State> = (0..6)
        .map(|_| {
            advance(&mut run, 50, 0.01, Integrator::VelocityVerlet);
            run.state().clone()
        })
        .collect();
    let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
    let deviation = |dt: f64| {
        let (mut squares, mut count) = (0.0, 0.0);
        for start in &starts {
            let mut run = simulation(SET6, start.clone());
            run.set_thermostat(false);
            run.prepare(dt, Want::TOTALS).unwrap();
            let first = energy(&run);
            for _ in 0..(0.5 / dt).round() as usize {
                run.step(dt, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
                squares += (energy(&run) - first).powi(2);
                count += 1.0;
            }
            assert_eq!(run.engine().statistics().counts.noise, 0);
        }
        (squares / count).sqrt() / run.len() as f64
    };
    let [coarse, fine] = [0.01, 0.00125].map(deviation);
    assert!(coarse < 2e-3, "{coarse} per particle");
    let order = (coarse / fine).log2() / 3.0;
    assert!((1.7..2.3).contains(&order), "order {order}: {coarse} and {fine}");
}

#[test]
fn momentum_is_conserved() {
    for integrator in [Integrator::VelocityVerlet, Integrator::GrootWarren { lambda: 0.65 }] {
        let mut run = simulation(SET6, settled());
        advance(&mut run, 200, 0.01, integrator);
        assert!(momentum(&run).iter().all(|p| p.abs() < 1e-10), "{:?}", momentum(&run));
        assert!(run.engine().statistics().counts.noise > 0);
    }
}

/// Largest difference of positions and velocities; particles are matched by tag.
fn difference(a: &Simulation, b: &Simulation) -> f64 {
    let mut at = vec![0; b.len() + 1];
    for (k, tag) in b.state().tag.iter().enumerate() {
        at[*tag as usize] = k;
    }
    let mut largest = 0.0f64;
    for (k, tag) in a.state().tag.iter().enumerate() {
        let other = at[*tag as usize];
        let d = a.state().domain.minimum_image(a.state().x[k], b.state().x[other]);
        for (d, (v, w)) in d.iter().zip(a.state().v[k].iter().zip(&b.state().v[other])) {
            largest = largest.max(d.abs()).max((v - w).abs());
        }
    }
    largest
}

#[test]
fn groot_warren_with_one_half_is_velocity_verlet() {
    let start = settled();
    let mut verlet = simulation(SET6, start.clone());
    let mut half = simulation(SET6, start.clone());
    let mut other = simulation(SET6, start);
    advance(&mut verlet, 20, 0.01, Integrator::VelocityVerlet);
    advance(&mut half, 20, 0.01, Integrator::GrootWarren { lambda: 0.5 });
    advance(&mut other, 20, 0.01, Integrator::GrootWarren { lambda: 0.65 });
    let d = difference(&verlet, &half);
    assert!(d < 1e-10, "{d}");
    assert!(difference(&verlet, &other) > 1e-4);
}

#[test]
fn the_order_of_particles_does_not_matter() {
    let start = settled();
    let n = start.len();
    // The factor 211 is prime and does not divide the number of particles, so this is a permutation.
    assert_ne!(n % 211, 0);
    let order: Vec<usize> = (0..n).map(|k| (k * 211 + 5) % n).collect();
    let shuffled = State {
        x: order.iter().map(|k| start.x[*k]).collect(),
        v: order.iter().map(|k| start.v[*k]).collect(),
        species: order.iter().map(|k| start.species[*k]).collect(),
        tag: order.iter().map(|k| start.tag[*k]).collect(),
        image: order.iter().map(|k| start.image[*k]).collect(),
        ..start.clone()
    };
    let (mut a, mut b) = (simulation(SET6, start), simulation(SET6, shuffled));
    advance(&mut a, 20, 0.01, Integrator::VelocityVerlet);
    advance(&mut b, 20, 0.01, Integrator::VelocityVerlet);
    let d = difference(&a, &b);
    assert!(d < 1e-10, "{d}");
}

/// Unwrapped positions are continuous when particles cross the faces of the box.
#[test]
fn image_flags_count_boxes() {
    let start = state_of(IDEAL, "[3.0, 3.0, 3.0]", 3.0);
    let mut run = simulation(IDEAL, start.clone());
    run.set_thermostat(false);
    advance(&mut run, 200, 0.05, Integrator::VelocityVerlet);
    assert!(run.state().image.iter().flatten().any(|i| *i != 0));
    for k in 0..run.len() {
        for c in 0..3 {
            let x = run.state().x[k][c];
            assert!((0.0..=3.0).contains(&x));
            let far = x + 3.0 * run.state().image[k][c] as f64;
            assert!((far - start.x[k][c] - 10.0 * start.v[k][c]).abs() < 1e-10);
        }
    }
}

/// The run stops at the limit of box counts instead of counting wrong.
#[test]
fn boxes_that_cannot_be_counted_stop_a_run() {
    for (at, velocity) in [(i32::MAX - 1, 10.0), (i32::MIN + 1, -10.0)] {
        let mut start = state_of(IDEAL, "[3.0, 3.0, 3.0]", 3.0);
        start.v.fill([0.0; 3]);
        (start.image[5][1], start.v[5][1]) = (at, velocity);
        let tag = start.tag[5];
        let mut run = simulation(IDEAL, start);
        run.set_thermostat(false);
        run.prepare(0.1, Want::FORCES).unwrap();
        let error = run.advance(4, 0.1, Integrator::VelocityVerlet).unwrap_err();
        assert!(matches!(error, RunError::Uncounted { tag: named, .. } if named == tag), "{error}");
    }
}

/// The error names the fastest of several runaway particles, whatever their order.
#[test]
fn the_culprit_of_a_blow_up_is_named() {
    for fastest in [3, 20, 77] {
        let mut start = state_of(IDEAL, "[3.0, 3.0, 3.0]", 3.0);
        start.v[1] = [200.0, 0.0, 0.0];
        start.v[50] = [0.0, 300.0, 0.0];
        start.v[fastest] = [0.0, 0.0, -1e9];
        let tag = start.tag[fastest];
        let mut run = simulation(IDEAL, start);
        run.set_thermostat(false);
        run.prepare(0.1, Want::FORCES).unwrap();
        let error = run.step(0.1, Integrator::VelocityVerlet, Want::FORCES).unwrap_err();
        assert!(matches!(error, RunError::Runaway { tag: named, .. } if named == tag), "{error}");
    }
}

/// Mean temperature of a run in blocks, with its standard error.
fn mean_temperature(run: &mut Simulation, blocks: usize, steps: usize, dt: f64) -> (f64, f64) {
    run.prepare(dt, Want::FORCES).unwrap();
    let means: Vec<f64> = (0..blocks)
        .map(|_| {
            let mut sum = 0.0;
            for _ in 0..steps {
                run.step(dt, Integrator::VelocityVerlet, Want::FORCES).unwrap();
                sum += run.temperature();
            }
            sum / steps as f64
        })
        .collect();
    let n = blocks as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Student's t with 19 degrees of freedom exceeds 6 less than once in 10^5 seeds; the seed is fixed. The
/// limit includes the bias of the time step, a few thousandths here.
#[test]
fn thermostat_holds_the_temperature_of_the_liquid() {
    let mut run = simulation(SET6, settled());
    let (mean, error) = mean_temperature(&mut run, 20, 100, 0.005);
    assert!((mean - 1.0).abs() < 6.0 * error + 0.005, "{mean} +- {error}");
    assert!(error < 0.01, "{error}");
}

/// Without conservative forces the thermostat must leave particles uncorrelated. The limits of the
/// temperature are those of the previous test. The numbers of pairs in four shells are Poisson counts summed
/// over snapshots far apart; one of the four exceeds five standard deviations less than once in 10^5 seeds.
/// The seed is fixed.
#[test]
fn ideal_gas_stays_ideal() {
    let (length, dt) = (5.0f64, 0.02);
    let mut run = simulation(IDEAL, state_of(IDEAL, "[5.0, 5.0, 5.0]", 4.0));
    let (mean, error) = mean_temperature(&mut run, 20, 50, dt);
    assert!((mean - 1.0).abs() < 6.0 * error + 0.005, "{mean} +- {error}");
    assert!(error < 0.01, "{error}");
    let edges = [0.0, 0.3, 0.6, 0.8, 1.0f64];
    let mut found = [0.0; 4];
    let snapshots = 10;
    for _ in 0..snapshots {
        advance(&mut run, 50, dt, Integrator::VelocityVerlet);
        let x = &run.state().x;
        for i in 0..x.len() {
            for j in 0..i {
                let d = run.state().domain.minimum_image(x[i], x[j]);
                let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
                if let Some(shell) = (0..4).find(|s| (edges[*s]..edges[*s + 1]).contains(&r)) {
                    found[shell] += 1.0;
                }
            }
        }
    }
    let pairs = 0.5 * (run.len() * (run.len() - 1)) as f64 * snapshots as f64;
    for shell in 0..4 {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * (edges[shell + 1].powi(3) - edges[shell].powi(3));
        let expected = pairs * volume / length.powi(3);
        let z = (found[shell] - expected) / expected.sqrt();
        assert!(z.abs() < 5.0, "shell {shell}: {} pairs, expected {expected}", found[shell]);
    }
}

#[test]
fn two_dimensions_stay_flat_and_warm() {
    let mut run = simulation(VAN_DER_WAALS, state_of(VAN_DER_WAALS, "[6.0, 6.0]", 12.0));
    advance(&mut run, 200, 0.01, Integrator::VelocityVerlet);
    let (mean, error) = mean_temperature(&mut run, 20, 50, 0.01);
    assert!((mean - 1.0).abs() < 6.0 * error + 0.01, "{mean} +- {error}");
    assert!(error < 0.01, "{error}");
    assert!(run.state().x.iter().all(|x| x[2] == 0.0));
    assert!(run.state().v.iter().all(|v| v[2] == 0.0));
    run.prepare(0.01, Want::TOTALS).unwrap();
    let p = run.pressure_tensor();
    assert_eq!((p[2], p[4], p[5]), (0.0, 0.0, 0.0));
    assert_eq!(run.scalar_pressure(p), 0.5 * (p[0] + p[1]));
}

fn files(folder: &Path) -> Vec<Vec<u8>> {
    ["thermo.csv", "dump.lammpstrj", "final.data"]
        .iter()
        .map(|name| std::fs::read(folder.join(name)).unwrap())
        .collect()
}

#[test]
fn the_same_scene_writes_the_same_bytes() {
    let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, ONE_STAGE).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut seen = 0;
    let [a, b] = ["a", "deep/b"].map(|name| {
        let out = folder.path().join(name);
        let summary = run_scene(&scene, &out, &mut |p| seen = p.step).unwrap();
        assert_eq!((summary.steps, summary.particles, summary.last.step), (40, 387, 40));
        assert_eq!(summary.means.unwrap().rows, 4);
        (files(&out), out)
    });
    assert_eq!(seen, 40);
    assert!(a.0 == b.0);
    let text = String::from_utf8(a.0[0].clone()).unwrap();
    assert_eq!(text.lines().count(), 6);
    assert!(text.starts_with("step,time,temperature,potential,kinetic,pressure,pxx"));
    // A new run removes all files of the previous run.
    std::fs::write(a.1.join("last-good.data"), "old").unwrap();
    run_scene(&scene, &a.1, &mut |_| ()).unwrap();
    assert!(!a.1.join("last-good.data").exists());
    let json = std::fs::read_to_string(b.1.join("summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["steps"], 40);
    let dump = String::from_utf8(a.0[1].clone()).unwrap();
    assert_eq!(dump.matches("ITEM: TIMESTEP").count(), 3);
    assert!(dump.contains("ITEM: ATOMS id type x y z vx vy vz\n1 1 "));
    let data = String::from_utf8(a.0[2].clone()).unwrap();
    assert!(data.contains("387 atoms\n1 atom types\n"), "{data}");
    assert!(data.contains("\nAtoms # atomic\n\n1 1 "));
}

/// Two stages at the same settings equal one stage: the noise of a step is keyed by its number, and the
/// forces at the start of a stage differ only by the velocities in the drag.
#[test]
fn stages_without_thermostat_continue_each_other() {
    let stage = |name: &str, steps: u64| {
        format!("[[stage]]\nname = \"{name}\"\nsteps = {steps}\ndt = 0.001\nthermostat = false\n")
    };
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, rest: String| {
        let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, &format!("{rest}[output]\ndump = 20\n")).unwrap();
        run_scene(&scene, &folder.path().join(name), &mut |_| ()).unwrap();
        std::fs::read_to_string(folder.path().join(name).join("dump.lammpstrj")).unwrap()
    };
    let whole = run("whole", stage("a", 20));
    let parts = run("parts", stage("a", 12) + &stage("b", 8));
    assert!(whole == parts);
}

#[test]
fn a_blow_up_stops_with_the_cause_and_leaves_the_last_good_state() {
    let rest = "[[stage]]\nname = \"fine\"\nsteps = 20\ndt = 0.01\n\
                [[stage]]\nname = \"mad\"\nsteps = 500\ndt = 5.0\n[output]\nthermo = 10\n";
    let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, rest).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = run_scene(&scene, folder.path(), &mut |_| ()).unwrap_err();
    let text = error.to_string();
    let RunError::Stopped { stage, good, saved, .. } = error else { panic!("{text}") };
    assert_eq!((stage.as_str(), good), ("mad", 20));
    assert!(text.contains("particle ") && text.contains("time step"), "{text}");
    let data = std::fs::read_to_string(saved).unwrap();
    assert!(data.starts_with("psidpd: t, step 20\n") && !data.contains("NaN"), "{data}");
    assert!(!folder.path().join("final.data").exists());
}

#[test]
fn folders_that_cannot_be_made_are_named() {
    let scene = scene_of(SET6, "[4.0, 4.0, 4.0]", 6.05, ONE_STAGE).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = run_scene(&scene, &file.join("out"), &mut |_| ()).unwrap_err();
    assert!(matches!(&error, RunError::Output(why) if why.path.ends_with("file/out")), "{error}");
}

#[test]
fn states_that_are_none_are_refused() {
    let good = state_of(IDEAL, "[4.0, 4.0, 4.0]", 3.0);
    let model = Model::parse("m.toml", IDEAL).unwrap();
    let refuse = |change: fn(&mut State), message: &str| {
        let mut state = good.clone();
        change(&mut state);
        let error = Simulation::new(&model, 1.0, state, 1).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    };
    refuse(|s| s.x[3][1] = f64::NAN, "particle 4 is not finite");
    refuse(|s| s.tag[3] = 3, "tag 3 is given twice");
    refuse(|s| s.tag[3] = 0, "must be positive");
    refuse(|s| s.species[5] = 1, "particle 6 has species 1");
    refuse(|s| s.mass[0] = 0.0, "masses must be positive");
    refuse(|s| s.v.truncate(4), "different lengths");
    let mut run = Simulation::new(&model, 1.0, good, 1).unwrap();
    assert!(matches!(run.prepare(0.0, Want::FORCES), Err(RunError::TimeStep(_))));
}

/// A box narrower than twice the range of the noise is refused, but only while there is noise.
#[test]
fn narrow_boxes_are_refused_with_noise_alone() {
    let mut narrow = simulation(IDEAL, state_of_narrow());
    assert!(matches!(narrow.prepare(0.01, Want::FORCES), Err(RunError::BoxTooNarrow { .. })));
    narrow.set_thermostat(false);
    narrow.prepare(0.01, Want::FORCES).unwrap();
}

fn state_of_narrow() -> State {
    let rest = ONE_STAGE.replace("dt = 0.01", "dt = 0.01\nthermostat = false");
    scene_of(IDEAL, "[4.0, 4.0, 1.5]", 3.0, &rest).unwrap().initial_state()
}

/// Particles move by the mass of their species: both species have the same temperature.
#[test]
fn masses_count() {
    let model = IDEAL_MIXTURE;
    let rest = ONE_STAGE.to_owned() + "[masses]\nB = 5.0\n";
    let state = scene_of(model, "[4.0, 4.0, 4.0]", 4.0, &rest).unwrap().initial_state();
    let mut run = simulation(model, state);
    advance(&mut run, 200, 0.02, Integrator::VelocityVerlet);
    let (mean, error) = mean_temperature(&mut run, 20, 50, 0.02);
    assert!((mean - 1.0).abs() < 6.0 * error + 0.005, "{mean} +- {error}");
    assert!(error < 0.01, "{error}");
    assert!(momentum(&run).iter().all(|p| p.abs() < 1e-10));
}
