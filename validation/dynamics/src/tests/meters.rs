//! Tests of single observables on particles of runs.

use super::{find, run, scene};
use crate::run::Simulation;
use crate::tests::support::{IDEAL_MIXTURE, SET6};
use psidpd_core::document::FileError;
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::frame::Frame;
use psidpd_observe::meter::surface_tension::stretched_energy;
use psidpd_observe::meter::{AnyMeter, Meter};
use rand::{SeedableRng, rngs::StdRng};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// The cells of a plane hold all particles, each in its own cell.
#[test]
fn every_particle_is_in_its_cell() {
    let observe = "[observe.density_field]\nbins = [4, 5]\nevery = 100\nstages = [\"settle\"]\n";
    let scene = scene(IDEAL_MIXTURE, "[4.0, 3.0, 5.0]", 5.0, 1, observe).unwrap();
    let mut shorter = scene.clone();
    shorter.stages.truncate(1);
    let (simulation, all) = run(&shorter);
    let field = find(&all, "density_field");
    let names: Vec<&str> = field.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["x", "z", "density", "density_A", "density_B"]);
    let (x, z) = (&field.columns[0].values, &field.columns[1].values);
    let mut expected = vec![[0.0; 2]; 20];
    for (p, s) in simulation.state().x.iter().zip(&simulation.state().species) {
        let inside = |k: &usize| (p[0] - x[*k]).abs() <= 0.5 && (p[2] - z[*k]).abs() <= 0.5;
        expected[(0..20).find(inside).unwrap()][*s as usize] += 1.0 / 3.0;
    }
    for (k, e) in expected.iter().enumerate() {
        assert!((field.columns[3].values[k] - e[0]).abs() < 1e-12);
        assert!((field.columns[4].values[k] - e[1]).abs() < 1e-12);
        assert!((field.columns[2].values[k] - e[0] - e[1]).abs() < 1e-12);
    }
}

/// Profiles of one configuration share positions, but not those along other axes or about other centres.
#[test]
fn profiles_have_their_own_axes_and_centres() {
    let keys = ["axis = \"z\"", "axis = \"x\"", "recentre = true", "recentre = \"A\"", "recentre = true"];
    let scenes = keys.map(|keys| {
        let observe = format!("[observe.density_profile]\n{keys}\n");
        scene(IDEAL_MIXTURE, "[4.0, 4.0, 6.0]", 3.0, 10, &observe).unwrap()
    });
    let state = scenes[0].initial_state();
    let mut simulation = Simulation::new(&scenes[0].model, 1.0, state, 1).unwrap();
    simulation.prepare(0.01, Want::TOTALS).unwrap();
    // A lattice has no centre.
    simulation.step(0.01, scenes[0].stages[0].integrator, Want::TOTALS).unwrap();
    let fluid = Evaluator::new(simulation.model().at(1.0).unwrap()).unwrap();
    let shared = Frame::new(simulation.view(0.0), &fluid);
    let found = scenes.each_ref().map(|scene| {
        let [mut one, mut alone] = [0, 1].map(|_| scene.observe.requests[0].meter.clone());
        assert!(one.sample(&shared) && alone.sample(&Frame::new(simulation.view(0.0), &fluid)));
        assert_eq!(one, alone);
        alone
    });
    assert!(found[0] != found[1] && found[2] != found[3] && found[2] == found[4]);
}

/// The parabola of a known viscosity with noise is fitted within five standard errors, a false alarm in 10^6;
/// the seed is fixed.
#[test]
fn a_known_flow() {
    let observe = "[observe.poiseuille]\naxis = \"z\"\nflow = \"x\"\nacceleration = 0.1\nbins = 20\n";
    let scene = scene(IDEAL_MIXTURE, "[4.0, 4.0, 6.0]", 3.0, 10, observe).unwrap();
    let AnyMeter::Poiseuille(mut m) = scene.observe.requests[0].meter.clone() else { panic!() };
    let mut rng = StdRng::seed_from_u64(3);
    let (eta, rho) = (0.8, 3.0);
    let shape = m.parabolas();
    for _ in 0..400 {
        let row: Vec<f64> = shape
            .iter()
            .flat_map(|f| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let mass = rho * 96.0 / 20.0;
                [mass, mass * (rho * 0.1 / (2.0 * eta) * f + 0.05 * noise)]
            })
            .collect();
        assert!(m.series.push(&row));
    }
    let out = m.finish();
    let found = out[0].scalar("viscosity").unwrap();
    assert!((found.value - eta).abs() < 5.0 * found.error && found.error < 0.02, "{found:?}");
    assert!(out[0].scalar("deviation").unwrap().value < 0.05);
    assert!(scene_without().is_err());
}

fn scene_without() -> Result<crate::scene::Scene, FileError> {
    scene(IDEAL_MIXTURE, "[4.0, 4.0, 6.0]", 3.0, 10, "[observe]\npoiseuille = true\n")
}

/// A simple cubic lattice of 5³ sites in a box of 5³ has S = N at multiples of 2π and 0 elsewhere.
#[test]
fn of_a_lattice() {
    let observe = "[observe.structure_factor]\nrange = 14.0\nbins = 2000\nvectors = 10000\n";
    assert!(scene(IDEAL_MIXTURE, "[5.0, 5.0, 5.0]", 1.0, 10, observe).is_err());
    let observe = observe.replace("2000", "1000");
    let scene = scene(IDEAL_MIXTURE, "[5.0, 5.0, 5.0]", 1.0, 10, &observe).unwrap();
    let simulation = Simulation::new(&scene.model, 1.0, scene.initial_state(), 1).unwrap();
    let fluid = Evaluator::new(simulation.model().at(1.0).unwrap()).unwrap();
    let AnyMeter::StructureFactor(mut meter) = scene.observe.requests[0].meter.clone() else { panic!() };
    assert!(meter.sample(&Frame::new(simulation.view(0.0), &fluid)));
    let out = &meter.finish()[0];
    let s = &out.get("s").unwrap().values;
    let mut peaks = 0;
    for shell in 0..meter.lengths.len() {
        let vectors = &meter.vectors[meter.starts[shell]..meter.starts[shell + 1]];
        let bragg = vectors.iter().filter(|h| h.iter().all(|c| c % 5 == 0)).count();
        let expected = 125.0 * bragg as f64 / vectors.len() as f64;
        assert!((s[shell] - expected).abs() < 1e-9, "{shell}: {} {expected}", s[shell]);
        peaks += bragg;
    }
    // Wave vectors ±(1,0,0), (1,1,0), (1,1,1), (2,0,0) and so on within 14/2π = 2.23: half of 6 + 12 + 8 + 6 + 24 - ...
    let within = (-3i32..=3)
        .flat_map(|x| (-3i32..=3).flat_map(move |y| (-3i32..=3).map(move |z| x * x + y * y + z * z)))
        .filter(|q| *q > 0 && f64::from(*q).sqrt() * TAU <= 14.0)
        .count();
    assert_eq!(2 * peaks, within);
}

/// For a slab of any orientation, half the difference of the energies over the change of the area is the
/// virial part of the stress tension, to second order in the perturbation.
#[test]
fn stretching_and_stress_agree_on_every_configuration() {
    let scene = scene(SET6, "[3.0, 3.5, 9.0]", 2.5, 10, "").unwrap();
    let mut simulation = Simulation::new(&scene.model, 1.0, scene.initial_state(), 3).unwrap();
    simulation.prepare(0.01, Want::TOTALS).unwrap();
    for _ in 0..50 {
        simulation.step(0.01, scene.stages[0].integrator, Want::TOTALS).unwrap();
    }
    let fluid = Evaluator::new(simulation.model().at(1.0).unwrap()).unwrap();
    let frame = Frame::new(simulation.view(0.0), &fluid);
    let virial = frame.evaluation().virial();
    for axis in 0..3 {
        let others: f64 = (0..3).filter(|c| *c != axis).map(|c| virial[c]).sum();
        // The derivative dU/d ln A follows from ∂U/∂ε_cc = −W_cc.
        let expected = virial[axis] - 0.5 * others;
        let change =
            |h: f64| (stretched_energy(&frame, axis, h) - stretched_energy(&frame, axis, -h)) / (2.0 * h);
        let found = (4.0 * change(5e-5) - change(1e-4)) / 3.0;
        assert!((found - expected).abs() < 1e-5 * expected.abs().max(100.0), "{axis}: {found} {expected}");
    }
}
