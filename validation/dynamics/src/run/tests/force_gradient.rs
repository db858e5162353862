//! The force-gradient step: its formulas, its order and its conserved quantities.

use super::*;
use crate::integrator::Coupling;
use psidpd_core::engine::PeriodicBox;

const SMOOTH: &str = "title = \"smooth\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"wendland-c2\"\nrange = 1.0\n\
    [excess_free_energy]\nA = \"0.3*n^2\"\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\n\
    phi = \"12*(1 - r^2)^8\"\nrange = 1.0\n";

fn force_gradient(lambda: f64, gradient: f64) -> Integrator {
    Integrator::ForceGradient { lambda, gradient, coupling: Coupling::DEFAULT }
}

/// Conservative forces on particles of set 6 or of an ideal mixture at other positions.
fn forces_at(model: &Model, state: &State, x: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let mut there = Simulation::new(model, 1.0, State { x, ..state.clone() }, 7).unwrap();
    there.compute(Want::FORCES, None).unwrap();
    there.forces().to_vec()
}

/// One step agrees with the formulas, whose forces are evaluated separately, in double precision with two masses.
#[test]
fn a_step_is_its_formulas() {
    let text = SET6
        .replace("[\"F\"]", "[\"F\", \"G\"]")
        .replace("[excess_free_energy]", "[excess_free_energy]\nG = \"pi/30 * rd^4 * B * n^2\"")
        + "\n[[pair]]\nbetween = [\"G\", \"G\"]\nform = \"soft\"\nstrength = \"A\"\nrange = \"rc\"\n\
         [[pair]]\nbetween = [\"F\", \"G\"]\nform = \"soft\"\nstrength = \"A\"\nrange = \"rc\"\n";
    let model = Model::parse("m.toml", &text).unwrap();
    let mut state = settled();
    state.mass = vec![1.0, 2.5];
    state.species = (0..state.len()).map(|k| i32::from(k % 3 == 1)).collect();
    let (dt, lambda, gradient) = (0.04, 0.17, 0.045);
    let mut run = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
    run.set_thermostat(false);
    run.prepare_for(force_gradient(lambda, gradient), dt, Want::FORCES).unwrap();
    run.step(dt, force_gradient(lambda, gradient), Want::FORCES).unwrap();

    let mass = |k: usize| state.mass[state.species[k] as usize];
    let moved = |x: &[[f64; 3]], by: &[[f64; 3]], h: f64, over_mass: bool| -> Vec<[f64; 3]> {
        let scale = |k: usize| if over_mass { h / mass(k) } else { h };
        (0..x.len()).map(|k| std::array::from_fn(|c| x[k][c] + scale(k) * by[k][c])).collect()
    };
    let (x, v) = (state.x.clone(), state.v.clone());
    let v = moved(&v, &forces_at(&model, &state, x.clone()), lambda * dt, true);
    let x = moved(&x, &v, 0.5 * dt, false);
    let aside = moved(&x, &forces_at(&model, &state, x.clone()), gradient * dt * dt, true);
    let v = moved(&v, &forces_at(&model, &state, aside), (1.0 - 2.0 * lambda) * dt, true);
    let x = moved(&x, &v, 0.5 * dt, false);
    let v = moved(&v, &forces_at(&model, &state, x.clone()), lambda * dt, true);
    for k in 0..run.len() {
        let d = run.state().domain.minimum_image(x[k], run.state().x[k]);
        let off = (0..3).map(|c| d[c].abs().max((v[k][c] - run.state().v[k][c]).abs())).fold(0.0, f64::max);
        assert!(off < 1e-10, "{k}: {off}");
    }
}

/// Without a thermostat, for a fluid with smooth forces, deviations of the energy fall with the fourth power
/// of the step; with another λ or ξ they fall with the second power.
#[test]
fn it_is_of_fourth_order_for_smooth_forces() {
    let mut begin = simulation(SMOOTH, state_of(SMOOTH, "[4.0, 4.0, 4.0]", 4.0));
    for dt in [0.001, 0.01] {
        advance(&mut begin, 200, dt, Integrator::VelocityVerlet);
    }
    let scale = (begin.len() as f64 * 3.0 / 2.0 / begin.kinetic_energy()).sqrt();
    let mut start = begin.state().clone();
    start.v.iter_mut().flatten().for_each(|v| *v *= scale);
    let deviation = |integrator: Integrator, dt: f64| {
        let mut run = simulation(SMOOTH, start.clone());
        run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
        let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
        let first = energy(&run);
        let steps = (0.64 / dt).round() as usize;
        let squares: f64 = (0..steps)
            .map(|_| {
                run.step(dt, integrator, Want::TOTALS).unwrap();
                (energy(&run) - first).powi(2)
            })
            .sum();
        (squares / steps as f64).sqrt()
    };
    let order = |integrator: Integrator| {
        let [coarse, fine] = [0.04, 0.01].map(|dt| deviation(integrator, dt));
        (coarse / fine).log2() / 2.0
    };
    let fourth = order(force_gradient(1.0 / 6.0, 1.0 / 24.0));
    assert!((3.6..4.6).contains(&fourth), "{fourth}");
    for (lambda, gradient) in [(0.18, 1.0 / 24.0), (1.0 / 6.0, 0.03)] {
        let second = order(force_gradient(lambda, gradient));
        assert!((1.7..2.4).contains(&second), "{lambda} {gradient}: {second}");
    }
}

/// Linear momentum is conserved to rounding. Angular momentum is not, unlike with undisplaced forces: its
/// change in a step falls with the displacement and the kick, by Δt³ and more. Steps are time-reversible.
#[test]
fn it_keeps_momentum_and_is_reversible_but_not_angular_momentum() {
    let whole = settled();
    // A drop in the middle of a wide box, so that no particle crosses a face.
    let near = |x: &[f64; 3]| (0..3).all(|c| (x[c] - 2.0).abs() < 1.5);
    let keep: Vec<usize> = (0..whole.len()).filter(|k| near(&whole.x[*k])).collect();
    let domain = PeriodicBox::orthogonal([-8.0; 3], [20.0; 3], [true; 3]).unwrap();
    let mut start = State::at_rest(domain, vec![1.0], keep.iter().map(|k| whole.x[*k]).collect());
    start.v = keep.iter().map(|k| whole.v[*k]).collect();
    let turn = |run: &Simulation| -> [f64; 3] {
        run.state().x.iter().zip(&run.state().v).fold([0.0; 3], |sum, (x, v)| {
            let (x, l) = (x.map(|c| c - 2.0), sum);
            [
                l[0] + x[1] * v[2] - x[2] * v[1],
                l[1] + x[2] * v[0] - x[0] * v[2],
                l[2] + x[0] * v[1] - x[1] * v[0],
            ]
        })
    };
    let change = |integrator: Integrator, dt: f64| {
        let mut run = simulation(SET6, start.clone());
        run.set_thermostat(false);
        run.prepare_for(integrator, dt, Want::FORCES).unwrap();
        let (total, before) = (momentum(&run), turn(&run));
        run.step(dt, integrator, Want::FORCES).unwrap();
        let (now, after) = (momentum(&run), turn(&run));
        assert!((0..3).all(|c| (now[c] - total[c]).abs() < 1e-10), "{total:?} {now:?}");
        (0..3).map(|c| (after[c] - before[c]).powi(2)).sum::<f64>().sqrt()
    };
    let step = force_gradient(1.0 / 6.0, 1.0 / 24.0);
    let [coarse, fine] = [0.04, 0.01].map(|dt| change(step, dt));
    assert!(coarse > 1e-6 && coarse / fine > 32.0, "{coarse} {fine}");
    assert!(change(force_gradient(1.0 / 6.0, 0.0), 0.04) < 1e-10);

    let mut run = simulation(SET6, start.clone());
    run.set_thermostat(false);
    run.prepare_for(step, 0.02, Want::FORCES).unwrap();
    run.advance(20, 0.02, step).unwrap();
    let mut back = run.state().clone();
    back.v.iter_mut().flatten().for_each(|v| *v = -*v);
    let mut run = simulation(SET6, back);
    run.set_thermostat(false);
    run.prepare_for(step, 0.02, Want::FORCES).unwrap();
    run.advance(20, 0.02, step).unwrap();
    for (x, from) in run.state().x.iter().zip(&start.x) {
        assert!((0..3).all(|c| (x[c] - from[c]).abs() < 1e-8), "{x:?} {from:?}");
    }
}

/// With ξ = 0 the step equals the two-stage step up to the rounding of sums, in a tilted box too.
#[test]
fn without_displacement_it_is_the_two_stage_step() {
    let start = settled();
    let two_stage = Integrator::TwoStage { lambda: 0.2, coupling: Coupling::DEFAULT };
    let [a, b] = [two_stage, force_gradient(0.2, 0.0)].map(|integrator| {
        let mut run = simulation(SET6, start.clone());
        run.prepare_for(integrator, 0.03, Want::FORCES).unwrap();
        run.advance(10, 0.03, integrator).unwrap();
        run.state().clone()
    });
    assert!(a == b);
}

/// A displaced evaluation mirrors positions beyond a face, and has the forces there.
#[test]
fn particles_are_displaced_and_mirrored_at_faces() {
    let model = Model::parse("m.toml", SMOOTH).unwrap();
    let x = vec![[0.01, 2.0, 2.0], [0.45, 2.0, 2.1], [3.99, 2.2, 2.0], [3.6, 2.0, 2.0]];
    let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [false, true, true]).unwrap();
    let state = State::at_rest(domain, vec![1.0], x.clone());
    let mut run = Simulation::new(&model, 1.0, state.clone(), 7).unwrap();
    run.prepare_for(force_gradient(1.0 / 6.0, 1.0 / 24.0), 0.1, Want::FORCES).unwrap();
    let before = run.forces().to_vec();
    run.displaced_forces(0.003).unwrap();
    assert_eq!(run.state().x, x);
    let mut there = x.clone();
    for (x, f) in there.iter_mut().zip(&before) {
        (0..3).for_each(|c| x[c] += 0.003 * f[c]);
    }
    // A force of at least 17 pushes the first particle out, to −0.04 or beyond.
    assert!(there[0][0] < -0.02 && there[2][0] > 4.02, "{there:?}");
    (there[0][0], there[2][0]) = (-there[0][0], 8.0 - there[2][0]);
    let expected = forces_at(&model, &state, there);
    for (a, b) in run.forces().iter().flatten().zip(expected.iter().flatten()) {
        assert!((a - b).abs() < 1e-9 * before[0][0].abs(), "{a} {b}");
    }
}
