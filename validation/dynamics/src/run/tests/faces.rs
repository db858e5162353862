//! Reflecting faces, at which forces press.

use super::*;
use crate::particles::{BodyForce, Tags};
use crate::run::bounce::fly;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::Recorded;
use psidpd_observe::frame::Frame;

fn body_force(acceleration: [f64; 3], species: Vec<i32>) -> BodyForce {
    BodyForce { acceleration, reversed_along: None, species, tags: Tags::All }
}

/// Fractional parts of multiples of irrational numbers, which have no pattern.
fn part(k: usize, c: usize) -> f64 {
    (k as f64 * [2f64, 3.0, 5.0, 7.0, 11.0, 13.0][c].sqrt()).fract()
}

/// Particles of two masses in a box with faces across two directions.
fn gas(periodic: [bool; 3]) -> State {
    let domain = PeriodicBox::orthogonal([-1.0, 0.5, 2.0], [3.0, 4.0, 1.5], periodic).unwrap();
    let x = (0..300).map(|k| domain.point([0, 1, 2].map(|c| part(k + 1, c)))).collect();
    let v = (0..300).map(|k| [3, 4, 5].map(|c| 4.0 * part(k + 1, c) - 2.0)).collect();
    let species = (0..300).map(|k| k % 2).collect();
    State { v, species, ..State::at_rest(domain, vec![1.0, 3.0], x) }
}

/// Under constant accelerations particles follow their exact paths, at any time step and with every integrator, however often
/// they bounce: on the faces below and above, in corners, and where one face presses so strongly that a step has many bounces.
#[test]
fn constant_forces_give_exact_paths() {
    let mut start = gas([false, true, false]);
    let accelerations = [[20.0, 1.0, -20.0], [-0.7, 0.0, 30.0]];
    // Some hop on the upper face.
    for k in (1..300).step_by(6) {
        (start.x[k][2], start.v[k][2]) = (3.5 - 0.01 * part(k, 0), 0.1 * start.v[k][2]);
    }
    let model = Model::parse("m.toml", IDEAL_MIXTURE).unwrap();
    for (name, integrator) in Integrator::ALL {
        for (dt, steps) in [(0.12, 25), (0.01, 60)] {
            let mut run = Simulation::new(&model, 1.0, start.clone(), 1).unwrap();
            run.set_thermostat(false);
            run.set_body_forces(&[0, 1].map(|s| body_force(accelerations[s as usize], vec![s])));
            run.prepare_for(integrator, dt, Want::FORCES).unwrap();
            // Totals are asked for now and then, which must not change the path.
            for n in 0..steps {
                run.step(dt, integrator, if n % 3 == 0 { Want::TOTALS } else { Want::FORCES }).unwrap();
            }
            for k in 0..300 {
                let a = accelerations[start.species[k] as usize];
                for (c, faces) in [(0, [-1.0, 2.0]), (2, [2.0, 3.5])] {
                    let time = dt * f64::from(steps);
                    // A path of some time at once has more bounces than a step may have.
                    let mut exact = [start.x[k][c], start.v[k][c]];
                    for _ in 0..steps {
                        let end = fly(exact, a[c], faces, time / f64::from(steps), |_| ()).unwrap();
                        exact = [end.x, end.u];
                    }
                    let found = [run.state().x[k][c], run.state().v[k][c]];
                    let scale = [1.0, a[c].abs().max(1.0)];
                    let off = (0..2).map(|j| (found[j] - exact[j]).abs() / scale[j]).fold(0.0, f64::max);
                    assert!(off < 1e-6, "{name} {dt}: particle {k} along {c}: {found:?} {exact:?}");
                }
            }
        }
    }
}

/// What particles carry in a step of velocity Verlet, of momentum normal to a face at z = 0, is the change of `Σ z p` with the
/// momenta of the drift: the face, where z is 0, adds nothing to that. The ways begin and end where the particles do.
#[test]
fn momentum_is_carried_to_the_faces() {
    let model = Model::parse("m.toml", IDEAL_MIXTURE).unwrap();
    let evaluator = Evaluator::new(model.at(1.0).unwrap()).unwrap();
    for (low, g) in [(0.0f64, -20.0f64), (-40.0, 20.0)] {
        let mut state = gas([true, true, false]);
        let domain =
            PeriodicBox::orthogonal([-1.0, 0.5, low], [3.0, 4.0, 40.0], [true, true, false]).unwrap();
        state.x.iter_mut().for_each(|x| x[2] = (x[2] - 2.0) * -g.signum());
        state.domain = domain;
        let mut run = Simulation::new(&model, 1.0, state, 1).unwrap();
        run.set_thermostat(false);
        run.set_body_forces(&[body_force([0.3, 0.0, g], Vec::new())]);
        for (name, integrator) in [
            ("velocity-verlet", Integrator::VelocityVerlet),
            ("groot-warren", Integrator::GrootWarren { lambda: 0.65 }),
        ] {
            let dt = 0.1;
            run.prepare_for(integrator, dt, Want::FORCES).unwrap();
            run.record_flux(Recorded::Lines);
            let mut most = 0.0f64;
            for _ in 0..30 {
                let before = run.state().clone();
                run.step(dt, integrator, Want::FORCES).unwrap();
                let now = run.state();
                let sum: f64 = (0..300)
                    .map(|k| {
                        let m = now.mass[now.species[k] as usize];
                        let p = |v: f64, sign: f64| m * (v + sign * 0.5 * dt * g);
                        now.x[k][2] * p(now.v[k][2], -1.0) - before.x[k][2] * p(before.v[k][2], 1.0)
                    })
                    .sum();
                let frame = Frame::new(run.view(0.0), &evaluator);
                let carried = dt * frame.volume() * frame.carried_pressure().unwrap()[2];
                assert!((carried - sum).abs() < 1e-9 * sum.abs().max(1.0), "{name}: {carried} {sum}");
                most = most.max(frame.view.flux.unwrap().ways.len() as f64);
                let heights = frame.view.flux.unwrap().ways.iter().map(|way| way.from[2] - way.d[2]);
                assert!(heights.into_iter().all(|z| (low - 1e-12..=low + 40.0 + 1e-12).contains(&z)));
            }
            assert!(most > 320.0, "{most}");
        }
    }
}

/// Faces do no work: the deviations of the energy between them fall with the square of the step, as without them.
#[test]
fn energy_is_kept_to_second_order_between_faces() {
    let soft = support::SOFT;
    let lengths = "[4.0, 4.0, 4.0]\nboundary = \"reflecting\"";
    let mut start = simulation(soft, state_of(soft, lengths, 3.0));
    advance(&mut start, 400, 0.01, Integrator::VelocityVerlet);
    let deviation = |integrator: Integrator, dt: f64| {
        let mut run = simulation(soft, start.state().clone());
        run.set_thermostat(false);
        run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
        let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
        let first = energy(&run);
        let steps = (1.6 / dt).round() as usize;
        let squares: f64 = (0..steps)
            .map(|_| {
                run.step(dt, integrator, Want::TOTALS).unwrap();
                (energy(&run) - first).powi(2)
            })
            .sum();
        (squares / steps as f64).sqrt() / run.len() as f64
    };
    for (name, integrator) in Integrator::ALL {
        let [coarse, fine] = [0.016, 0.002].map(|dt| deviation(integrator, dt));
        println!("{name}: {coarse:.1e} {fine:.1e}");
        assert!(coarse < 4e-3 && fine < coarse / 20.0, "{name}: {coarse} {fine}");
    }
}

/// Between faces the configurational temperature is kT: for a particle beside a frozen one in a corner both means are integrals over
/// the box. Without weights the ratio is far off.
#[test]
fn the_configurational_temperature_knows_faces() {
    const PLANE: &str = "title = \"plane\"\ndimensions = 2\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"wendland-c2\"\n\
        range = 0.8\n[excess_free_energy]\nA = \"0.3*n^2\"\nB = \"0.5*n^2\"\n[[pair]]\nbetween = [\"A\", \"B\"]\n\
        form = \"expression\"\nphi = \"3*(1 - r^2)^4\"\nrange = 1.0\n";
    let model = Model::parse("m.toml", PLANE).unwrap();
    let kt = 0.7;
    let evaluator = Evaluator::new(model.at(kt).unwrap()).unwrap();
    for periodic in [[false, false, true], [true, false, true]] {
        let domain = PeriodicBox::orthogonal([-0.4, 1.0, 0.0], [2.5, 2.2, 1.0], periodic).unwrap();
        let fixed = [-0.1, 2.8, 0.0];
        let mut state = State::at_rest(domain.clone(), vec![1.0, 2.0], vec![fixed, fixed]);
        state.species = vec![0, 1];
        let mut run = Simulation::new(&model, kt, state, 1).unwrap();
        run.set_frozen(&Tags::Ranges(vec![1..=1]));
        let cells = 200;
        let (mut sums, mut plain) = ([0.0; 2], [0.0; 2]);
        for k in 0..cells * cells {
            let at = [k % cells, k / cells, 0].map(|k| (f64::from(k) + 0.5) / f64::from(cells));
            let x = [fixed, domain.point([at[0], at[1], 0.0])];
            let frame = Frame::new(psidpd_observe::frame::View { x: &x, ..run.view(0.0) }, &evaluator);
            let evaluation = frame.evaluation();
            let probability = (-evaluation.energy / kt).exp();
            let terms = psidpd_observe::configurational::sums(&frame);
            let laplacian = evaluation.laplacians(run.engine().pool(), &evaluator.fluid)[1];
            let square: f64 =
                evaluation.forces(frame.view.pool, &frame.evaluator.fluid)[1].iter().map(|f| f * f).sum();
            (0..2).for_each(|c| sums[c] += probability * terms[c]);
            (plain[0], plain[1]) = (plain[0] + probability * square, plain[1] + probability * laplacian);
        }
        let (found, without) = (sums[0] / sums[1], plain[0] / plain[1]);
        assert!((found / kt - 1.0).abs() < 1e-3, "{periodic:?}: {found} {without}");
        assert!((without / kt - 1.0).abs() > 0.1, "{periodic:?}: {found} {without}");
    }
}

/// Totals that are asked for after a step change no later one, though some integrators then compute forces at other positions than
/// those which the next step holds; nor does a checkpoint in between.
#[test]
fn totals_and_checkpoints_change_no_bounce() {
    let soft = support::SOFT;
    let start = state_of(soft, "[3.0, 3.0, 3.0]\nboundary = \"reflecting\"", 3.0);
    for (name, integrator) in Integrator::ALL {
        let [quiet, asked, resumed] = [0, 1, 2].map(|how| {
            let mut run = simulation(soft, start.clone());
            run.prepare_for(integrator, 0.02, Want::FORCES).unwrap();
            for n in 1..=30 {
                run.step(0.02, integrator, if how == 0 { Want::FORCES } else { Want::TOTALS }).unwrap();
                if how == 2 && n % 4 == 0 {
                    let (state, forces) = (run.state().clone(), run.held_forces().to_vec());
                    run = simulation(soft, start.clone());
                    run.restore(n, &state, &forces, [0; 2]);
                }
            }
            run.state().clone()
        });
        assert!(quiet == asked && quiet == resumed, "{name}");
    }
}

/// Density of the first layer of 0.1 at both faces, and kinetic and configurational temperature there and in the whole box.
fn at_the_faces(integrator: Integrator, dt: f64, steps: u64) -> [f64; 3] {
    let model = include_str!("../../../../models/standard-dpd.toml");
    let lengths = "[4.0, 4.0, 6.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]";
    let mut run = simulation(model, state_of(model, lengths, 3.0));
    run.set_settling(true);
    advance(&mut run, 400, 0.01, Integrator::VelocityVerlet);
    run.prepare_for(integrator, dt, Want::FORCES).unwrap();
    run.advance(steps / 10, dt, integrator).unwrap();
    run.set_settling(false);
    let evaluator = Evaluator::new(Model::parse("m.toml", model).unwrap().at(1.0).unwrap()).unwrap();
    let (mut count, mut heat, mut sums, mut samples) = (0.0, 0.0, [0.0; 2], 0.0);
    for _ in 0..steps / 3 {
        run.advance(3, dt, integrator).unwrap();
        samples += 1.0;
        for (x, v) in run.state().x.iter().zip(&run.state().v) {
            if x[2].min(6.0 - x[2]) < 0.1 {
                count += 1.0;
                heat += v.iter().map(|v| v * v).sum::<f64>();
            }
        }
        let found = psidpd_observe::configurational::sums(&Frame::new(run.view(0.0), &evaluator));
        (0..2).for_each(|c| sums[c] += found[c]);
    }
    [count / samples / (2.0 * 16.0 * 0.1), heat / 3.0 / count, sums[0] / sums[1]]
}

/// Standard DPD between faces, at steps that are advised: density and temperature of the first layer are those of Monte Carlo.
#[test]
#[ignore = "errors of half a percent take minutes"]
fn the_layer_at_a_face_is_right() {
    let every = |every| crate::integrator::Coupling { every, ..crate::integrator::Coupling::DEFAULT };
    let trials = Integrator::MonteCarlo { sweeps: 3, max_move: None };
    let [density, _, conf] = at_the_faces(trials, 1.0, 9_000);
    println!("monte-carlo: {density:.3}, T_conf {conf:.4}");
    assert!((conf - 1.0).abs() < 0.02);
    let force_gradient = Integrator::ForceGradient { lambda: 0.17, gradient: 1.0 / 24.0, coupling: every(2) };
    for (integrator, dt) in [
        (Integrator::VelocityVerlet, 0.005),
        (force_gradient, 0.06),
        (force_gradient, 0.12),
        (Integrator::TwoStage { lambda: 0.21, coupling: every(2) }, 0.06),
        (Integrator::Aboba(every(1)), 0.02),
        (Integrator::Baoab(every(1)), 0.02),
        (Integrator::VelocityVerlet, 0.02),
    ] {
        let steps = f64::min(180.0 / dt, 15_000.0) as u64;
        let [found, kinetic, conf] = at_the_faces(integrator, dt, steps);
        println!("{} {dt}: {found:.3}, T {kinetic:.4}, T_conf {conf:.4}", integrator.name());
        assert!(dt > 0.1 || integrator == Integrator::VelocityVerlet || (found / density - 1.0).abs() < 0.02);
    }
}
