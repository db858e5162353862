//! A step equals its formulas to the last bit, particle by particle.

use super::*;
use nalgebra::Matrix3;
use psidpd_core::engine::PeriodicBox;

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
                let (before, f) = (run.state(), run.forces().to_vec());
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
                    run.domain().wrap(&mut x, &mut image);
                    wrapped += usize::from(image != before.image[k]);
                    assert_eq!(
                        (x, v, image),
                        (run.positions()[k], run.velocities()[k], run.image_flags()[k])
                    );
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
        for dt in [0.01, 0.02, 0.01] {
            single.step(dt, integrator, Want::FORCES).unwrap();
            row.begin_step(dt, integrator, Want::FORCES).unwrap();
        }
        for run in [&mut single, &mut row] {
            run.prepare(0.01, Want::FORCES).unwrap();
        }
        assert!(single.state() == row.state() && single.forces() == row.forces());
    }
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
