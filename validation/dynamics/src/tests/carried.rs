//! The lines of momentum transport against what they must add up to, for every integrator.

use super::find;
use crate::integrator::Integrator;
use crate::particles::State;
use crate::run::Simulation;
use crate::scene::Scene;
use crate::tests::support::{self, IDEAL_MIXTURE, SET6};
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{PeriodicBox, Want};
use psidpd_core::model::Model;
use psidpd_formats::data::DataFile;
use psidpd_observe::frame::Frame;
use psidpd_observe::{Observers, Recorded};

/// Two species with a many-body and a pair force, and drag.
const PAIR: &str = "title = \"pair\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
    [excess_free_energy]\nA = \"1.5*n^2\"\nB = \"0.5*n^2 + 0.2*n^3\"\n";

/// The pair force, of range 1, and drag between each two of the species.
fn mixture(dimensions: usize, gamma: f64, reach: f64) -> String {
    let mut text = PAIR.replace("species", &format!("dimensions = {dimensions}\nspecies"));
    for [a, b] in [["A", "A"], ["A", "B"], ["B", "B"]] {
        text += &format!(
            "[[pair]]\nbetween = [\"{a}\", \"{b}\"]\nform = \"soft\"\nstrength = -8.0\nrange = 1.0\n\
             [[thermostat]]\nbetween = [\"{a}\", \"{b}\"]\ngamma = {gamma}\nrange = {reach}\n"
        );
    }
    text
}

/// The steps of a scene that names `integrator`, with the thermostat at every third step where it is apart from the forces.
fn steps(name: &str, mut integrator: Integrator) -> String {
    let mut text = format!("integrator = \"{name}\"\n");
    if integrator.settings().coupling.is_some() {
        text += "thermostat_every = 3\n";
    }
    if name == "groot-warren" {
        text += "lambda = 0.65\n";
    }
    text
}

/// A folder with the model, whose drag has the range `reach`, and a liquid of 150 particles as a data file.
fn folder(dimensions: usize, domain: PeriodicBox, reach: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), mixture(dimensions, 6.0, reach)).unwrap();
    // Fractional parts of multiples of irrational numbers give points without a pattern.
    let irrational = [2f64.sqrt(), 3f64.sqrt(), 5f64.sqrt()];
    let part = |k: usize, c: usize| if c < dimensions { (k as f64 * irrational[c]).fract() } else { 0.0 };
    let x = (0..150).map(|k| domain.point(std::array::from_fn(|c| part(k, c)))).collect();
    let mut state = State::at_rest(domain, vec![1.0, 3.0], x);
    state.species = (0..150).map(|k| k % 2).collect();
    let data = state.to_data_by_tag("liquid");
    let data = DataFile { names: vec!["A".into(), "B".into()], ..data };
    data.write(&folder.path().join("start.data")).unwrap();
    folder
}

/// The mean of the normal pressure over all slices is the momentum flux of the step, to rounding: with two species and masses, a
/// temperature that is not 1, in a tilted box, a plane and between faces, for every direction, and for a liquid that moves
/// across the faces of the box.
#[test]
fn slices_of_stress_add_up_to_the_momentum_flux() {
    let edges = nalgebra::Matrix3::new(4.0, 1.0, -0.7, 0.0, 3.5, 0.9, 0.0, 0.0, 4.5);
    let straight = |lengths, periodic| PeriodicBox::orthogonal([-1.0, 0.5, 2.0], lengths, periodic).unwrap();
    let boxes = [
        (3, PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true; 3]).unwrap(), ""),
        (
            3,
            straight([3.5, 4.0, 4.5], [true, false, false]),
            "[\"periodic\", \"reflecting\", \"reflecting\"]",
        ),
        (2, straight([7.0, 8.0, 1.0], [true; 3]), ""),
        (2, straight([7.0, 8.0, 1.0], [true, false, true]), "[\"periodic\", \"reflecting\"]"),
    ];
    for (dimensions, domain, boundary) in boxes {
        // Drag that reaches farther than the forces has lines of its own.
        let folder = folder(dimensions, domain.clone(), if boundary.is_empty() { 1.0 } else { 1.2 });
        let boundary =
            if boundary.is_empty() { String::new() } else { format!("[box]\nboundary = {boundary}\n") };
        for (name, integrator) in Integrator::ALL {
            let table = |axis: &&str| format!("stress_profile = {{ axis = \"{axis}\", bins = 7 }}");
            let axes = &["x", "y", "z"][..dimensions];
            for (place, table) in axes.iter().map(table).enumerate() {
                let text = format!(
                    "model = \"m.toml\"\nkT = 0.7\nseed = 3\n{}dt = 0.04\nsteps = 3\n{boundary}[initial]\n\
                     kind = \"data\"\nfile = \"start.data\"\nvelocities = \"thermal\"\n[observe]\nevery = 1\n{table}\n",
                    steps(name, integrator)
                );
                let scene = Scene::parse("s.toml", &text, folder.path()).unwrap();
                let stage = &scene.stages[0];
                let mut simulation = scene.simulation(scene.initial_state()).unwrap();
                scene.enter(stage, &mut simulation).unwrap();
                simulation.prepare_for(stage.integrator, stage.dt, Want::FORCES).unwrap();
                let evaluator = Evaluator::new(scene.model.at(scene.kt).unwrap()).unwrap();
                simulation.record_flux(Recorded::Lines);
                for _ in 0..3 {
                    simulation.step(stage.dt, stage.integrator, Want::TOTALS).unwrap();
                    let mut observers = Observers::new(&scene.observe, [stage.name.as_str()]);
                    observers.sample(simulation.view(0.0), &stage.name);
                    let out = observers.finish();
                    let normal = &find(&out, "stress_profile").get("normal").unwrap().values;
                    let mean = normal.iter().sum::<f64>() / normal.len() as f64;
                    let carried = Frame::new(simulation.view(0.0), &evaluator).carried_pressure().unwrap();
                    // The normal of a face is along a row of the inverse of the edges.
                    let row = domain.inverse()[place];
                    let [x, y, z] = row.map(|c| c / row.iter().map(|c| c * c).sum::<f64>().sqrt());
                    let weights = [x * x, y * y, z * z, 2.0 * x * y, 2.0 * x * z, 2.0 * y * z];
                    let expected: f64 = carried.iter().zip(weights).map(|(p, w)| p * w).sum();
                    let scale = carried.iter().fold(1.0f64, |most, p| most.max(p.abs()));
                    let off = (mean - expected).abs() / scale;
                    assert!(off < 1e-12, "{name} {table} {boundary}: {mean} {expected}");
                }
            }
        }
    }
}

/// Where only sums are recorded they are those of the lines, also of drag, for which lines need a search of its own.
#[test]
fn recorded_sums_are_those_of_lines() {
    let domain = PeriodicBox::orthogonal([-1.0, 0.5, 2.0], [3.5, 4.0, 4.5], [true, true, false]).unwrap();
    let folder = folder(3, domain, 1.2);
    for (name, integrator) in Integrator::ALL {
        let text = format!(
            "model = \"m.toml\"\nkT = 0.7\nseed = 3\nprecision = \"double\"\n{}dt = 0.04\nsteps = 3\n[box]\n\
             boundary = [\"periodic\", \"periodic\", \"reflecting\"]\n[initial]\nkind = \"data\"\nfile = \"start.data\"\n\
             velocities = \"thermal\"\n",
            steps(name, integrator)
        );
        let scene = Scene::parse("s.toml", &text, folder.path()).unwrap();
        let stage = &scene.stages[0];
        let evaluator = &Evaluator::new(scene.model.at(scene.kt).unwrap()).unwrap();
        let [sums, lines] = [Recorded::Sum, Recorded::Lines].map(|what| {
            let mut simulation = scene.simulation(scene.initial_state()).unwrap();
            scene.enter(stage, &mut simulation).unwrap();
            simulation.prepare_for(stage.integrator, stage.dt, Want::FORCES).unwrap();
            simulation.record_flux(what);
            (0..3).map(move |_| {
                simulation.step(stage.dt, stage.integrator, Want::TOTALS).unwrap();
                Frame::new(simulation.view(0.0), evaluator).carried_pressure().unwrap()
            })
        });
        for (sum, line) in sums.zip(lines) {
            let scale = line.iter().fold(1.0f64, |most, p| most.max(p.abs()));
            for (a, b) in sum.iter().zip(line) {
                assert!((a - b).abs() < 1e-11 * scale, "{name}: {sum:?} {line:?}");
            }
        }
    }
}

/// Slices add up where a layer of frozen particles and a reflecting face confine a driven flow, in means over steps with and without an
/// action of the thermostat.
#[test]
fn slices_beside_a_wall_add_up_to_the_momentum_flux() {
    for (name, integrator) in Integrator::ALL {
        // Body forces have no energy in a periodic box.
        let force =
            if integrator.has_time() { "[[body_force]]\nacceleration = [0.1, 0.0, -0.2]\n" } else { "" };
        for (axis, column) in [("x", "carried_xx"), ("z", "carried_zz")] {
            let text = format!(
                "model = \"m.toml\"\nkT = 0.7\nseed = 7\ndensity = 6.05\nprecision = \"double\"\n[box]\n\
                 lengths = [3.0, 3.0, 4.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
                 [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 0.8\nlattice = \"fcc\"\nfrozen = true\n\
                 [[part]]\nshape = \"rest\"\n{force}[[stage]]\nname = \"run\"\nsteps = 8\n{}dt = 0.02\n\
                 [observe]\nevery = 1\npressure = true\nstress_profile = {{ axis = \"{axis}\", bins = 7 }}\n",
                steps(name, integrator)
            );
            let text = if integrator.has_time() { text } else { text.replace("dt = 0.02\n", "") };
            let scene = support::scene(SET6, &text).unwrap();
            let stage = &scene.stages[0];
            let mut simulation = scene.simulation(scene.initial_state()).unwrap();
            scene.enter(stage, &mut simulation).unwrap();
            simulation.prepare_for(stage.integrator, stage.dt, Want::FORCES).unwrap();
            simulation.record_flux(Recorded::Lines);
            let mut observers = Observers::new(&scene.observe, [stage.name.as_str()]);
            for _ in 0..8 {
                simulation.step(stage.dt, stage.integrator, Want::TOTALS).unwrap();
                observers.sample(simulation.view(0.0), &stage.name);
            }
            let out = observers.finish();
            let normal = &find(&out, "stress_profile").get("normal").unwrap().values;
            let mean = normal.iter().sum::<f64>() / normal.len() as f64;
            let carried = find(&out, "pressure").get(column).unwrap().values[0];
            assert!((mean / carried - 1.0).abs() < 1e-11, "{name} {axis}: {mean} {carried}");
        }
    }
}

/// The recorded drag is what changes momentum: without noise and other forces, the impulses of the lines of a step are the change of
/// the momentum of a particle. Where the thermostat acts at every third step, they are spread over the three steps from there.
#[test]
fn recorded_drag_is_what_slows_particles() {
    let model = Model::parse("m.toml", IDEAL_MIXTURE).unwrap();
    let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
    let dt = 0.07;
    for (name, mut integrator) in Integrator::ALL {
        // The impulse of Lowe's thermostat is all or nothing; recorded is its mean.
        if name == "lowe-andersen" {
            continue;
        }
        let mut every = 1;
        if let Some(coupling) = integrator.settings().coupling {
            (coupling.every, every) = (3, 3);
        }
        // The pair lies across a face of the box.
        let mut state =
            State::at_rest(domain.clone(), vec![1.0, 3.0], vec![[3.9, 1.0, 1.0], [0.2, 1.2, 1.1]]);
        state.species = vec![0, 1];
        state.v = vec![[0.3, 0.1, -0.2], [-0.2, 0.4, 0.1]];
        let mut run = Simulation::new(&model, 1e-20, state, 1).unwrap();
        run.prepare_for(integrator, dt, Want::FORCES).unwrap();
        run.record_flux(Recorded::Lines);
        let in_forces = integrator.properties().drag_in_forces;
        let (mut before, mut impulse, mut acted) = (None::<f64>, 0.0, 0);
        for step in 1..=7 {
            let start = run.state().v[0][0];
            run.step(dt, integrator, Want::FORCES).unwrap();
            let flux = run.flux().unwrap();
            let apart = run.state().domain.minimum_image(run.state().x[0], run.state().x[1]);
            let dot = |d: [f64; 3]| d.iter().zip(apart).map(|(a, b)| a * b).sum::<f64>();
            let drag: f64 = flux
                .drag
                .iter()
                .flat_map(|drag| &drag.pairs)
                .flat_map(|pairs| {
                    (0..pairs.i.len()).map(|k| (pairs.d.each_ref().map(|d| d[k]), pairs.strengths[k]))
                })
                .map(|(d, strength)| strength * d[0] * dot(d).signum())
                .sum();
            acted += usize::from(drag != 0.0);
            if in_forces {
                // Such a force belongs to the kicks before and behind the present end of the step.
                let momentum = dt * flux.ways[0].f[0];
                if let Some(before) = before {
                    assert!(
                        (momentum - before - impulse).abs() < 1e-6,
                        "{name}: {momentum} {before} {impulse}"
                    );
                }
                (before, impulse) = (Some(momentum), dt * drag);
            } else {
                let change = run.state().v[0][0] - start;
                let expected = if step % every == 0 { f64::from(every) * dt * drag } else { 0.0 };
                assert!((change - expected).abs() < 1e-6, "{name}, step {step}: {change} {expected}");
            }
        }
        assert_eq!(acted, if every == 1 { 7 } else { 5 }, "{name}");
    }
}
