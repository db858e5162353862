//! The thermostat that acts at every k-th step: pressures at the steps between.

use super::*;
use crate::integrator::Coupling;
use psidpd_core::engine::PeriodicBox;
use psidpd_observe::{Observation, Observers, Recorded};

const PAIR: &str = "title = \"pair\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 6\nrange = 1\n";

/// Two particles so slow that they stay, and so cold that there is no noise. With D = γ (1 − ½)² and x = ½ kΔt D/μ the
/// midpoint rule takes 2x/(1 + x) of their relative velocity u, by the mean force 2x/(1 + x) μu/(kΔt). Its virial is part of the
/// pressure in the steps up to the next action, as the drag at the middle of the velocities is of the momentum carried.
#[test]
fn the_virial_is_that_of_the_mean_force_in_every_step() {
    let along = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let start = [3e-15, -1e-15, 2e-15];
    let u: f64 = along.iter().zip(start).map(|(e, v)| e * v).sum();
    let state = State {
        domain: PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap(),
        mass: vec![1.0, 3.0],
        x: vec![[2.0; 3], along.map(|e| 2.0 - 0.5 * e)],
        v: vec![start, [0.0; 3]],
        species: vec![0, 1],
        tag: vec![1, 2],
        image: vec![[0; 3]; 2],
    };
    let model = Model::parse("m.toml", PAIR).unwrap();
    let (dt, mu) = (0.3, 0.75);
    for every in [1u64, 2, 3] {
        let coupling = Coupling { every, ..Coupling::DEFAULT };
        for integrator in [
            Integrator::TwoStage { lambda: 0.21, coupling },
            Integrator::ForceGradient { lambda: 1.0 / 6.0, gradient: 1.0 / 24.0, coupling },
            Integrator::Aboba(coupling),
            Integrator::Baoab(coupling),
        ] {
            let mut run = Simulation::new(&model, 1e-60, state.clone(), 7).unwrap();
            run.record_flux(Recorded::Lines);
            run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
            let x = 0.5 * every as f64 * dt * 1.5 / mu;
            for step in 1..=9u64 {
                run.step(dt, integrator, Want::TOTALS).unwrap();
                let Some(actions) = (step / every).checked_sub(1) else { continue };
                let before = u * ((1.0 - x) / (1.0 + x)).powi(actions as i32);
                let force = -mu * before * 2.0 * x / (1.0 + x) / (every as f64 * dt);
                let (total, rest) = (run.pressure_tensor(), run.conservative_pressure_tensor());
                let drag = psidpd_observe::flux::Flux {
                    drag: run.flux().unwrap().drag.clone(),
                    ..Default::default()
                };
                for (c, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                    let expected = 0.5 * along[a] * along[b] * force;
                    let close = |found: f64| (found / expected - 1.0).abs() < 1e-9;
                    assert!(close(64.0 * (total[c] - rest[c])), "{integrator:?}, step {step}: {total:?}");
                    assert!(close(drag.sum()[c]), "{integrator:?}, step {step}: {:?}", drag.sum());
                }
            }
        }
    }
}

/// Rows and observables of a step do not depend on which other steps are sampled.
#[test]
fn rows_do_not_depend_on_other_rows() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |thermo: u64| {
        let rest = format!(
            "[[stage]]\nname = \"run\"\nsteps = 30\ndt = 0.02\nintegrator = \"two-stage\"\nthermostat_every = 4\n\
             [output]\nthermo = {thermo}\n"
        );
        let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &rest).unwrap();
        let out = folder.path().join(thermo.to_string());
        run_scene(&scene, &out, &mut |_| {}).unwrap();
        std::fs::read_to_string(out.join("thermo.csv")).unwrap()
    };
    let all = rows(1);
    for thermo in [3, 5] {
        for row in rows(thermo).lines() {
            assert!(all.lines().any(|line| line == row), "{thermo}: {row}");
        }
    }
}

/// What the observables of a scene find where every step is recorded and asked for all totals.
fn sampled(scene: &Scene, what: Recorded) -> Vec<Observation> {
    let stage = &scene.stages[0];
    let mut observers = Observers::new(&scene.observe, [stage.name.as_str()]);
    let mut run = scene.simulation_of_run(scene.initial_state(), std::num::NonZeroUsize::MIN).unwrap();
    scene.enter(stage, &mut run).unwrap();
    run.prepare_for(stage.integrator, stage.dt, Want::TOTALS).unwrap();
    run.record_flux(what);
    for _ in 0..stage.steps {
        run.step(stage.dt, stage.integrator, Want::TOTALS).unwrap();
        observers.sample(run.view(run.step_number() as f64 * stage.dt), &stage.name);
    }
    observers.finish()
}

/// A sample has the same bits whether steps around it are recorded or not: at every fifth step, with an action at every fourth, all
/// phases are sampled, one at a time.
#[test]
fn samples_do_not_depend_on_what_other_steps_record() {
    for (integrator, every) in [("two-stage", 5), ("force-gradient", 5), ("force-gradient", 4), ("aboba", 3)]
    {
        let rest = format!(
            "[[stage]]\nname = \"run\"\nsteps = 40\ndt = 0.02\nintegrator = \"{integrator}\"\nthermostat_every = 4\n\
             [observe]\nevery = {every}\nstress_profile = {{ axis = \"z\", bins = 5 }}\npressure = true\n"
        );
        let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &rest).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        run_scene(&scene, &out, &mut |_| {}).unwrap();
        let found = std::fs::read_to_string(out.join("observables.json")).unwrap();
        let expected = serde_json::to_value(sampled(&scene, Recorded::Lines)).unwrap();
        let found: serde_json::Value = serde_json::from_str(&found).unwrap();
        assert!(expected == found, "{integrator} {every}: {expected} {found}");
    }
}

/// Samples of sums and of lines at different steps have the same bits as alone, in runs that ask for all totals: with actions of the
/// thermostat that nobody samples, that one samples, and whose drag the next steps need as a sum, as lines, and as both.
#[test]
fn sums_and_lines_are_held_for_different_steps() {
    for (name, integrator) in Integrator::ALL {
        let every = if integrator.coupling().is_some() { "thermostat_every = 4\n" } else { "" };
        for [of_sums, of_lines] in [[3, 5], [3, 4], [4, 3]] {
            let scene = |observe: &str| {
                let rest = format!(
                    "[[stage]]\nname = \"run\"\nsteps = 11\ndt = 0.02\nintegrator = \"{name}\"\n{every}\
                     [output]\nthermo = 0\n[observe]\n{observe}"
                );
                scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &rest).unwrap()
            };
            let sums = format!("surface_tension = {{ every = {of_sums}, axis = \"z\" }}\n");
            let lines = format!("stress_profile = {{ every = {of_lines}, axis = \"z\", bins = 5 }}\n");
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("out");
            run_scene(&scene(&format!("{sums}{lines}")), &out, &mut |_| {}).unwrap();
            let found = std::fs::read_to_string(out.join("observables.json")).unwrap();
            let found: Vec<serde_json::Value> = serde_json::from_str(&found).unwrap();
            for (observe, what) in [(sums, Recorded::Sum), (lines, Recorded::Lines)] {
                let expected = sampled(&scene(&observe), what);
                assert!(!expected.is_empty() && expected[0].samples > 1);
                for expected in expected {
                    let expected = serde_json::to_value(expected).unwrap();
                    assert!(found.contains(&expected), "{name} {of_sums} {of_lines}: {expected} {found:?}");
                }
            }
        }
    }
}

/// Steps that nobody samples record nothing, and the sample has the thermostat's last action all the same.
#[test]
fn a_sample_has_the_last_action() {
    let state = state_of(SET6, "[3.0, 3.0, 3.0]", 6.05);
    for every in [1, 2, 4, 7] {
        let coupling = Coupling { every, ..Coupling::DEFAULT };
        let integrator = Integrator::TwoStage { lambda: 0.21, coupling };
        let [mut all, mut sampled] = [0, 1].map(|_| {
            let mut run = simulation(SET6, state.clone());
            run.prepare_for(integrator, 0.02, Want::TOTALS).unwrap();
            run
        });
        all.record_flux(Recorded::Sum);
        for number in 1..=30 {
            all.step(0.02, integrator, Want::TOTALS).unwrap();
            if number % 5 == 0 {
                sampled.advance_to_sample(5, 0.02, integrator, Recorded::Sum).unwrap();
                assert_eq!(all.flux().unwrap().sum(), sampled.flux().unwrap().sum(), "{every} {number}");
                assert_eq!(all.pressure_tensor(), sampled.pressure_tensor(), "{every} {number}");
            }
        }
    }
}
