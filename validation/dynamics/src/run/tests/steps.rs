//! A step equals its formulas to the last bit, particle by particle.

use super::*;
use crate::checkpoint::Thermo;
use crate::particles::{BodyForce, Tags};
use crate::run::simulation::{Course, Task};
use nalgebra::Matrix3;
use psidpd_core::engine::{PeriodicBox, Precision, Settings};
use psidpd_observe::Recorded;
use psidpd_observe::flux::Flux;

/// A fluid of two masses, whose number of particles is not a multiple of four.
fn start(masses: [f64; 2], edges: Matrix3<f64>) -> (Model, State) {
    let model = Model::parse("m.toml", if masses[0] == masses[1] { SET6 } else { IDEAL_MIXTURE }).unwrap();
    assert_eq!(model.species().len(), if masses[0] == masses[1] { 1 } else { 2 });
    let mut state = settled();
    assert_eq!(state.len() % 4, 3);
    if model.species().len() == 2 {
        state.mass = masses.to_vec();
        state.species = (0..state.len()).map(|k| i32::from(k % 3 == 1)).collect();
    }
    state.domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
    (model, state)
}

#[test]
fn steps_are_their_formulas() {
    let dt = 0.01;
    let straight = Matrix3::from_diagonal_element(4.0);
    let leaning = Matrix3::new(4.0, 0.3, 0.0, 0.0, 4.0, -0.2, 0.0, 0.0, 4.0);
    for (masses, edges) in [([1.0, 1.0], straight), ([1.0, 1.0], leaning), ([1.0, 2.5], straight)] {
        let (model, state) = start(masses, edges);
        for integrator in [Integrator::VelocityVerlet, Integrator::GrootWarren { lambda: 0.65 }] {
            let mut run = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
            run.prepare(dt, Want::FORCES).unwrap();
            let mut wrapped = 0;
            for _ in 0..20 {
                let (before, f) = (run.state().clone(), run.forces().to_vec());
                run.step(dt, integrator, Want::FORCES).unwrap();
                for k in 0..run.len() {
                    let (mut x, mut image, mut v) = (before.x[k], before.image[k], before.v[k]);
                    let (mass, new) = (before.mass[before.species[k] as usize], run.forces()[k]);
                    for c in 0..3 {
                        match integrator {
                            Integrator::VelocityVerlet => {
                                v[c] += 0.5 * dt / mass * f[k][c];
                                x[c] += dt * v[c];
                                v[c] += 0.5 * dt / mass * new[c];
                            }
                            _ => {
                                let over_mass = dt / mass;
                                x[c] += dt * (v[c] + 0.5 * over_mass * f[k][c]);
                                v[c] += 0.5 * dt / mass * (f[k][c] + new[c]);
                            }
                        }
                    }
                    run.state().domain.wrap(&mut x, &mut image);
                    wrapped += usize::from(image != before.image[k]);
                    assert_eq!((x, v, image), (run.state().x[k], run.state().v[k], run.state().image[k]));
                }
            }
            assert!(wrapped > 20, "{wrapped}");
        }
    }
}

/// Steps with a deferred kick give the same bits, whatever happens between them.
#[test]
fn steps_in_a_row_are_steps_one_by_one() {
    let (model, state) = start([1.0, 2.5], Matrix3::from_diagonal_element(4.0));
    for integrator in [Integrator::VelocityVerlet, Integrator::GrootWarren { lambda: 0.65 }] {
        let [mut single, mut row] = [(); 2].map(|()| {
            let mut run = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
            run.set_reordering(true);
            run.prepare(0.01, Want::FORCES).unwrap();
            run
        });
        let lengths = [(0.01, 5), (0.01, 1), (0.02, 3), (0.005, 40)];
        for (dt, steps) in lengths {
            for _ in 0..steps {
                single.step(dt, integrator, Want::FORCES).unwrap();
            }
            row.advance(steps, dt, integrator).unwrap();
            assert!(single.state() == row.state());
        }
        // A step of another length, or another evaluation of forces, completes a deferred kick.
        let mut row = Course::of(row);
        for dt in [0.01, 0.02, 0.01] {
            single.step(dt, integrator, Want::FORCES).unwrap();
            row.make(dt, integrator, Task::default()).unwrap();
        }
        let row = row.ended().unwrap();
        for run in [&mut single, &mut *row] {
            run.prepare(0.01, Want::FORCES).unwrap();
        }
        assert!(single.state() == row.state() && single.forces() == row.forces());
    }
}

/// Whoever reads a run on its way changes no bit of it, with every integrator, in a periodic box and between faces. What is read is
/// that of the end of the step: forces are those of the plain sums at the positions that are read.
#[test]
fn reading_changes_nothing() {
    let (model, mut state) = start([1.0, 1.0], Matrix3::from_diagonal_element(4.0));
    for (periodic, (name, integrator)) in
        [true, false].into_iter().flat_map(|p| Integrator::ALL.iter().map(move |i| (p, *i)))
    {
        state.domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true, true, periodic]).unwrap();
        let [mut read, mut unread] = [(); 2].map(|()| {
            let mut run = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
            run.set_reordering(true);
            run.prepare_for(integrator, 0.01, Want::TOTALS).unwrap();
            Course::of(run)
        });
        let mut plain = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
        plain.use_pair_sums_only(true);
        for step in 1..=70 {
            let want = if step % 3 == 0 { Want::TOTALS } else { Want::FORCES };
            for run in [&mut read, &mut unread] {
                run.make(0.01, integrator, Task { want, ..Task::default() }).unwrap();
            }
            match step % 5 {
                0 => assert!(read.whole().unwrap().temperature().is_finite(), "{name}"),
                1 => assert!(read.ended().unwrap().temperature().is_finite(), "{name}"),
                2 if want == Want::TOTALS => {
                    assert!(read.totals(0.0).unwrap().potential.is_finite(), "{name}")
                }
                _ => {}
            }
            if step % 5 == 0 && !integrator.properties().drag_in_forces {
                let now = read.whole().unwrap();
                plain.restore(0, &now.state().clone(), now.forces(), [0; 2]);
                plain.compute(Want::FORCES, None).unwrap();
                for (found, expected) in now.forces().iter().flatten().zip(plain.forces().iter().flatten()) {
                    assert!(
                        (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                        "{name}: {found} {expected}"
                    );
                }
            }
        }
        let (read, unread) = (read.ended().unwrap(), unread.ended().unwrap());
        assert!(read.state() == unread.state(), "{name}");
    }
}

/// A liquid whose density leaves its bounds, with drag.
const BOUNDED: &str = r#"
title = "bounded"
species = ["A"]
[density.n]
kernel = "wendland-c2"
range = 1.0
bounds = [3.0, 4.0]
[excess_free_energy]
A = "2*n + 0.3*n^2"
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

/// Conservative forces that are found for observables are those of the plain sums, with every integrator, with and without body forces. They
/// change no bit of a run, no total and no count.
#[test]
fn finding_conservative_forces_changes_nothing() {
    let model = Model::parse("m.toml", BOUNDED).unwrap();
    let (state, settings) = (settled(), Settings { precision: Precision::Mixed, ..Settings::default() });
    let push = BodyForce {
        acceleration: [0.5, 0.0, -0.2],
        reversed_along: None,
        species: Vec::new(),
        tags: Tags::Ranges(vec![1..=i32::MAX]),
    };
    for (pushed, (name, integrator)) in
        [false, true].into_iter().flat_map(|p| Integrator::ALL.iter().map(move |i| (p, *i)))
    {
        let [mut found, mut plain, mut truth] =
            [(); 3].map(|()| Simulation::new(&model, 1.0, state.clone(), 7).unwrap());
        truth.use_pair_sums_only(true);
        for run in [&mut found, &mut plain] {
            if pushed {
                run.set_body_forces(std::slice::from_ref(&push));
            }
            run.set_settings(settings).unwrap();
            run.set_reordering(true);
            run.prepare_for(integrator, 0.02, Want::TOTALS).unwrap();
        }
        let [mut found, mut plain] = [found, plain].map(Course::of);
        for _ in 0..70 {
            for run in [&mut found, &mut plain] {
                let task = Task { want: Want::TOTALS, ..Task::default() };
                run.make(0.02, integrator, task).unwrap();
                run.whole().unwrap();
            }
            let now = found.whole().unwrap();
            now.find_conservative_forces().unwrap();
            truth.restore(0, &now.state().clone(), now.forces(), [0; 2]);
            truth.compute(Want::FORCES, None).unwrap();
            let squares = truth.forces().as_flattened().iter().map(|f| f * f).sum::<f64>();
            let scale = (squares / truth.len() as f64).sqrt();
            let forces = now.view(0.0).forces.unwrap();
            for (found, expected) in forces.as_flattened().iter().zip(truth.forces().as_flattened()) {
                assert!((found - expected).abs() < 1e-5 * scale, "{name}: {found} {expected}");
            }
        }
        let [found, plain] = [&mut found, &mut plain].map(|run| run.whole().unwrap());
        assert!(found.state() == plain.state() && found.forces() == plain.forces(), "{name}");
        assert_eq!(format!("{:?}", found.tally()), format!("{:?}", plain.tally()), "{name}");
        let counts = plain.out_of_bounds();
        assert!(counts[0] > 0 && counts[1] > 0 && found.out_of_bounds() == counts, "{name}: {counts:?}");
    }
}

/// The pressure of an ideal gas of two masses is `Σ m v ⊗ v/V`: in the totals, and in the flux of a step with the velocities
/// that moved the particles.
#[test]
fn momentum_is_carried_by_mass() {
    let (model, state) = start([1.0, 2.5], Matrix3::new(4.0, 0.3, 0.0, 0.0, 4.0, -0.2, 0.0, 0.0, 4.0));
    let mut run = Simulation::new(&model, 1.0, state, 7).unwrap();
    let carried = |run: &Simulation, v: &[[f64; 3]]| {
        [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(a, b)| {
            let term = |k: usize| run.state().mass[run.state().species[k] as usize] * v[k][a] * v[k][b];
            (0..run.len()).map(term).sum::<f64>()
        })
    };
    let same = |found: [f64; 6], expected: [f64; 6]| {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-10 * (1.0 + expected.abs()), "{found} {expected}");
        }
    };
    let dt = 1e-3;
    run.record_flux(Recorded::Lines);
    run.prepare(dt, Want::TOTALS).unwrap();
    let before: Vec<[f64; 3]> = run.state().v.to_vec();
    let pulls = run.forces().to_vec();
    run.step(dt, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
    let moved: Vec<[f64; 3]> = (0..run.len())
        .map(|k| {
            let mass = run.state().mass[run.state().species[k] as usize];
            std::array::from_fn(|c| before[k][c] + 0.5 * dt / mass * pulls[k][c])
        })
        .collect();
    let flux = run.flux().unwrap();
    same(Flux { ways: flux.ways.clone(), ..Flux::default() }.sum(), carried(&run, &moved));
    let volume = run.state().domain.volume(3);
    let ends = carried(&run, &run.state().v).map(|sum| sum / volume);
    same(run.conservative_pressure_tensor(), ends);
    let drag: [f64; 6] = std::array::from_fn(|c| run.pressure_tensor()[c] - ends[c]);
    assert!(drag.iter().any(|c| *c != 0.0));
    let totals = Thermo::of(&run, 0.0);
    assert!((totals.pressure - (totals.tensor[0] + totals.tensor[1] + totals.tensor[2]) / 3.0).abs() < 1e-12);
    assert!((totals.conservative_pressure - (ends[0] + ends[1] + ends[2]) / 3.0).abs() < 1e-10);
    assert!((totals.kinetic - 0.5 * volume * (ends[0] + ends[1] + ends[2])).abs() < 1e-9);
}

/// Counts of boxes are limited to 2³¹: a particle farther away is refused, not counted wrong.
#[test]
fn particles_beyond_all_counts_are_refused() {
    let mut state = state_of(IDEAL, "[4.0, 4.0, 4.0]", 1.0);
    state.x[3][1] = 1e9;
    assert!(Simulation::new(&Model::parse("m.toml", IDEAL).unwrap(), 1.0, state.clone(), 7).is_ok());
    state.x[3][1] = -1e10;
    let error = Simulation::new(&Model::parse("m.toml", IDEAL).unwrap(), 1.0, state.clone(), 7).unwrap_err();
    assert!(
        error.to_string().contains(&format!("particle {} is more than 2^31 boxes", state.tag[3])),
        "{error}"
    );
}
