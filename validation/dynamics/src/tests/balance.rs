//! Balances of momentum from the observed stress. The time step is so long that velocities at the ends of steps
//! and conservative forces alone miss the balance by far. Errors are those of the mean of sixteen stretches of
//! a run; six standard errors are exceeded by chance less than once in 10⁴ runs. The seeds are fixed.

use super::find;
use crate::run::{Integrator, Simulation};
use crate::scene::Scene;
use crate::tests::support::SET6;
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::frame::Frame;
use psidpd_observe::{Measured, Observation, Observers, Recorded};

const DT: f64 = 0.02;

/// A scene of Warren's set 6, whose vapour has almost no density.
fn scene(lengths: &str, initial: &str, observe: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), SET6.replace("gamma = 18.0", "gamma = 12.0")).unwrap();
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 5\n[box]\nlengths = {lengths}\n[initial]\n{initial}\n\
         [[stage]]\nname = \"run\"\nsteps = 1\ndt = {DT}\n{observe}"
    );
    Scene::parse("s.toml", &text, folder.path()).unwrap()
}

/// Observes sixteen stretches of a run of velocity Verlet. Each stretch has `samples` samples, one every fifth step.
fn stretches(scene: &Scene, simulation: &mut Simulation, samples: usize) -> Vec<Vec<Observation>> {
    let integrator = Integrator::VelocityVerlet;
    let stretch = |_| {
        let mut observers = Observers::new(&scene.observe, ["run"]);
        for _ in 0..samples {
            simulation.record_flux(Recorded::Nothing);
            simulation.advance(4, DT, integrator).unwrap();
            simulation.record_flux(Recorded::Lines);
            simulation.step(DT, integrator, Want::TOTALS).unwrap();
            observers.sample(simulation.view(0.0), "run");
        }
        observers.finish()
    };
    (0..16).map(stretch).collect()
}

/// A film without vapour transmits no normal stress, whatever the integrator. The conservative stress alone
/// is wrong by 0.5 with velocity Verlet, which the test must be able to see, and by 0.25 and more with most
/// other integrators.
#[test]
fn what_is_carried_across_a_film_is_nothing() {
    let scene = scene("[3.0, 3.0, 7.0]", "kind = \"slab\"\nthickness = 3.2\ndensity = 6.0", "");
    let fluid = Evaluator::new(scene.model.at(1.0).unwrap()).unwrap();
    for (name, integrator) in Integrator::ALL {
        let mut simulation = Simulation::new(&scene.model, 1.0, scene.initial_state(), 11).unwrap();
        simulation.prepare_for(integrator, DT, Want::FORCES).unwrap();
        simulation.advance(200, DT, integrator).unwrap();
        simulation.record_flux(Recorded::Lines);
        let (mut carried, mut conservative) = (Vec::new(), Vec::new());
        for _ in 0..16 {
            let (mut sums, steps) = ([0.0; 2], 160);
            for _ in 0..steps {
                simulation.step(DT, integrator, Want::TOTALS).unwrap();
                let frame = Frame::new(simulation.view(0.0), &fluid);
                sums[0] += frame.carried_pressure().unwrap()[2];
                sums[1] += frame.view.conservative_pressure[2];
            }
            carried.push(sums[0] / f64::from(steps));
            conservative.push(sums[1] / f64::from(steps));
        }
        let (carried, conservative) = (Measured::mean(&carried), Measured::mean(&conservative));
        assert!(carried.value.abs() < 6.0 * carried.error && carried.error < 0.12, "{name}: {carried:?}");
        let seen = conservative.value.abs() > 4.0 * carried.error;
        assert!(seen || integrator != Integrator::VelocityVerlet, "{conservative:?}");
    }
}

/// In a slab the normal pressure P_N is equal in the liquid and in the vapour. With velocities at the ends of
/// steps and conservative forces alone the two values differ by 1.1.
#[test]
fn normal_pressure_is_the_same_everywhere() {
    let slab = "kind = \"slab\"\nthickness = 4.0\ndensity = 6.0";
    let scene = scene("[3.5, 3.5, 9.0]", slab, "[observe.stress_profile]\nevery = 5\nbins = 45");
    let mut simulation = Simulation::new(&scene.model, 1.0, scene.initial_state(), 11).unwrap();
    simulation.prepare(DT, Want::FORCES).unwrap();
    simulation.advance(300, DT, Integrator::VelocityVerlet).unwrap();
    let differences: Vec<f64> = stretches(&scene, &mut simulation, 40)
        .iter()
        .map(|out| {
            let normal = &find(out, "stress_profile").get("normal").unwrap().values;
            let mean = |p: &[f64]| p.iter().sum::<f64>() / p.len() as f64;
            mean(&normal[16..29]) - 0.5 * (mean(&normal[..8]) + mean(&normal[37..]))
        })
        .collect();
    let found = Measured::mean(&differences);
    assert!(found.value.abs() < 6.0 * found.error && found.error < 0.16, "{found:?}");
}

/// In a drop `r² P_N` grows as `∫ 2 r P_T dr` from the vapour to the liquid, so the difference of the two
/// vanishes. With velocities at the ends of steps and conservative forces alone it is 1.1 in the liquid.
#[test]
fn a_drop_balances() {
    let scene = scene(
        "[9.0, 9.0, 9.0]",
        "kind = \"random\"\ncount = 400",
        "[observe.drop]\ndistance = 1.0\nevery = 5\nbins = 40\nrange = 4.0",
    );
    let mut state = scene.initial_state();
    let side = (400.0f64 / 6.05).cbrt();
    for x in &mut state.x {
        *x = x.map(|c| (c / 9.0 - 0.5) * side);
    }
    let mut simulation = Simulation::new(&scene.model, 1.0, state, 11).unwrap();
    for dt in [0.005, DT] {
        simulation.prepare(dt, Want::FORCES).unwrap();
        simulation.advance(300, dt, Integrator::VelocityVerlet).unwrap();
    }
    let h = 0.1;
    let residuals: Vec<f64> = stretches(&scene, &mut simulation, 48)
        .iter()
        .map(|out| {
            let profile = find(out, "drop_profile");
            let [normal, tangential] =
                ["normal", "tangential"].map(|name| &profile.get(name).unwrap().values);
            let residual = |a: usize| {
                let r = a as f64 * h;
                let pull: f64 = (a..40).map(|k| 2.0 * (k as f64 + 0.5) * h * tangential[k] * h).sum();
                0.5 * (normal[a - 1] + normal[a]) + (pull - 16.0 * normal[39]) / (r * r)
            };
            (17..=19).map(residual).sum::<f64>() / 3.0
        })
        .collect();
    let found = Measured::mean(&residuals);
    assert!(found.value.abs() < 6.0 * found.error && found.error < 0.18, "{found:?}");
}

/// Three times the time step of the other tests; the force-gradient integrator uses its recommended λ.
const LONG: f64 = 0.06;

fn force_gradient() -> Integrator {
    let coupling = crate::integrator::Coupling::DEFAULT;
    Integrator::ForceGradient { lambda: 0.17, gradient: 1.0 / 24.0, coupling }
}

/// Forces of the middle kick are computed at displaced positions and act at the present positions. Counted at
/// the displaced positions they would transmit a stress of 0.09 across a film without vapour, which the test
/// must be able to see.
#[test]
fn displaced_forces_carry_nothing_across_a_film() {
    let scene = scene("[3.0, 3.0, 7.0]", "kind = \"slab\"\nthickness = 3.2\ndensity = 6.0", "");
    let fluid = Evaluator::new(scene.model.at(1.0).unwrap()).unwrap();
    let mut simulation = Simulation::new(&scene.model, 1.0, scene.initial_state(), 11).unwrap();
    simulation.prepare(0.01, Want::FORCES).unwrap();
    simulation.advance(400, 0.01, Integrator::VelocityVerlet).unwrap();
    simulation.advance(100, LONG, force_gradient()).unwrap();
    simulation.record_flux(Recorded::Lines);
    let (mut carried, mut elsewhere) = (Vec::new(), Vec::new());
    for _ in 0..64 {
        let (mut sums, steps) = ([0.0; 2], 150);
        for _ in 0..steps {
            simulation.step(LONG, force_gradient(), Want::TOTALS).unwrap();
            let frame = Frame::new(simulation.view(0.0), &fluid);
            let carried = frame.carried_pressure().unwrap()[2];
            let kick = &simulation.flux().unwrap().forces[0];
            let place = kick.at.as_ref().unwrap();
            let to = place.displaced.as_ref().unwrap();
            let there =
                fluid.evaluate(simulation.engine().pool(), to, &place.species, &simulation.state().domain);
            sums[0] += carried;
            sums[1] += carried + kick.share * (there.virial()[2] - kick.virial[2]) / frame.volume();
        }
        carried.push(sums[0] / f64::from(steps));
        elsewhere.push(sums[1] / f64::from(steps));
    }
    let (carried, elsewhere) = (Measured::mean(&carried), Measured::mean(&elsewhere));
    assert!(carried.value.abs() < 6.0 * carried.error && carried.error < 0.04, "{carried:?}");
    assert!(elsewhere.value.abs() > 3.0 * elsewhere.error, "{elsewhere:?}");
}

/// A film that gravity presses on a wall carries at every height the weight of the particles above it, with
/// steps of [`LONG`]. The pressure is about 10 in the middle of the film and 19 on the wall.
#[test]
fn a_film_on_a_wall_carries_its_weight() {
    const WEIGHT: f64 = 1.0;
    let rest =
        "[[body_force]]\nacceleration = [0.0, 0.0, -1.0]\n[observe.stress_profile]\nevery = 1\nbins = 35";
    let lengths = "[3.0, 3.0, 7.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]";
    let scene =
        scene(lengths, "kind = \"slab\"\naxis = \"z\"\nthickness = 3.2\nat = 1.7\ndensity = 6.0", rest);
    let mut simulation = scene.simulation(scene.initial_state()).unwrap();
    scene.enter(&scene.stages[0], &mut simulation).unwrap();
    simulation.prepare(0.01, Want::FORCES).unwrap();
    simulation.advance(600, 0.01, Integrator::VelocityVerlet).unwrap();
    simulation.advance(100, LONG, force_gradient()).unwrap();
    simulation.record_flux(Recorded::Lines);
    let middles: Vec<f64> = (0..35).map(|k| 0.2 * (f64::from(k) + 0.5)).collect();
    let differences: Vec<f64> = (0..16)
        .map(|_| {
            let mut observers = Observers::new(&scene.observe, ["run"]);
            let mut above = [0.0; 35];
            for _ in 0..150 {
                simulation.step(LONG, force_gradient(), Want::TOTALS).unwrap();
                observers.sample(simulation.view(0.0), "run");
                for (sum, z) in above.iter_mut().zip(&middles) {
                    *sum += simulation.state().x.iter().filter(|x| x[2] > *z).count() as f64 / 150.0;
                }
            }
            let out = observers.finish();
            let normal = &find(&out, "stress_profile").get("normal").unwrap().values;
            // Heights from 0.8 to 2.6 lie neither at the wall nor at the free surface.
            let bins = 4..13;
            let count = bins.len() as f64;
            bins.map(|k| normal[k] - WEIGHT * above[k] / 9.0).sum::<f64>() / count
        })
        .collect();
    let found = Measured::mean(&differences);
    assert!(found.value.abs() < 6.0 * found.error && found.error < 0.1, "{found:?}");
}
