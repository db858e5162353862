//! What tests of walls of matter share, flat and round.

use super::*;
use crate::run::runner::{Begin, Runner};
use crate::run::tests::resume::{assert_same, finished, until};
use psidpd_core::model::wall::{Surface, Wall};
use psidpd_observe::{Observation, Observers, Recorded};
use std::num::NonZeroUsize;
use std::sync::atomic::AtomicUsize;

pub const STAGE: &str = "[[stage]]\nname = \"run\"\nsteps = 1\n";

pub fn named(name: &str) -> Integrator {
    Integrator::ALL.iter().find(|(other, _)| *other == name).unwrap().1
}

/// A wall with drag beside a gas without other forces.
pub fn rough(surface: Surface, velocity: [f64; 3]) -> Wall {
    Wall {
        surface,
        species: 0,
        density: 3.0,
        local_densities: Vec::new(),
        strength: 1.0,
        velocity,
        drag: [Some(20.0), Some(1.0)],
    }
}

/// The deviation of the energy of a particle, root mean square, in runs of this time from each start, without drag and noise.
pub fn deviation(scene: &Scene, starts: &[State], integrator: Integrator, [dt, time]: [f64; 2]) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for start in starts {
        let mut run = scene.simulation(start.clone()).unwrap();
        run.set_thermostat(false);
        run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
        let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
        let first = energy(&run);
        for _ in 0..(time / dt).round() as usize {
            run.step(dt, integrator, Want::TOTALS).unwrap();
            squares += (energy(&run) - first).powi(2);
            count += 1.0;
        }
    }
    (squares / count).sqrt() / starts[0].len() as f64
}

/// Asserts that walls take what the fluid loses, by forces, drag, noise and reflection: where a step has one kick, step by step to
/// rounding; where kicks are shared with the next step, but for the kicks at both ends. Returns what walls took, and the run.
pub fn balanced(scene: &Scene, start: &State, name: &str, steps: usize) -> ([f64; 3], Simulation) {
    let mut run = scene.simulation(start.clone()).unwrap();
    let (dt, integrator) = (0.01, named(name));
    run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
    run.record_flux(Recorded::Sum);
    let walls = run.engine().plan().walls().len();
    let first = momentum(&run);
    let (mut given, mut before, mut worst) = ([0.0; 3], first, 0.0f64);
    for _ in 0..steps {
        run.step(dt, integrator, Want::TOTALS).unwrap();
        let on_walls = run.flux().unwrap().on_walls(walls);
        let now = momentum(&run);
        for c in 0..3 {
            let taken = dt * on_walls.iter().map(|force| force[c]).sum::<f64>();
            given[c] += taken;
            worst = worst.max((now[c] - before[c] + taken).abs());
        }
        before = now;
    }
    // The force on all particles together is below 300 in these runs.
    let off = (0..3).map(|c| (before[c] - first[c] + given[c]).abs()).fold(0.0, f64::max);
    let [limit, step_limit] = if name == "aboba" { [1e-9; 2] } else { [300.0 * dt; 2] };
    assert!(off < limit && worst < step_limit, "{name}: {off} {worst}");
    (given, run)
}

/// Asserts that the temperatures of a gas at kT = 1, of all particles and of those near walls, are right: the means of 20 blocks, of which
/// Student's t exceeds 6 less than once in 10^5 seeds, with an error below `most`.
pub fn assert_temperatures(scene: &Scene, name: &str, is_near: impl Fn(&[f64; 3]) -> bool, most: f64) {
    let (dt, integrator) = (0.1, named(name));
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    run.prepare_for(integrator, dt, Want::FORCES).unwrap();
    run.advance(30, dt, integrator).unwrap();
    let blocks: Vec<[f64; 2]> = (0..20)
        .map(|_| {
            let (mut near, mut all) = ([0.0; 2], 0.0);
            for _ in 0..12 {
                run.step(dt, integrator, Want::FORCES).unwrap();
                all += run.temperature() / 12.0;
                let state = run.state();
                for (_, v) in state.x.iter().zip(&state.v).filter(|(x, _)| is_near(x)) {
                    near[0] += v.iter().map(|v| v * v).sum::<f64>();
                    near[1] += 3.0;
                }
            }
            [all, near[0] / near[1]]
        })
        .collect();
    for k in 0..2 {
        let n = blocks.len() as f64;
        let mean = blocks.iter().map(|b| b[k]).sum::<f64>() / n;
        let variance = blocks.iter().map(|b| (b[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        assert!((mean - 1.0).abs() < 6.0 * error && error < most, "{name} {k}: {mean} +- {error}");
    }
}

/// What is observed in the steps of a scene's stage, the momentum that its fluid loses in them, and the run.
pub fn observed(scene: &Scene, recorded: Recorded) -> (Vec<Observation>, [f64; 3], Simulation) {
    let stage = &scene.stages[0];
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    scene.enter(stage, &mut run).unwrap();
    run.prepare_for(stage.integrator, stage.dt, Want::TOTALS).unwrap();
    run.record_flux(recorded);
    let mut observers = Observers::new(&scene.observe, [stage.name.as_str()]);
    let first = momentum(&run);
    for _ in 0..stage.steps {
        run.step(stage.dt, stage.integrator, Want::TOTALS).unwrap();
        observers.sample(run.view(0.0), &stage.name);
    }
    let last = momentum(&run);
    (observers.finish(), std::array::from_fn(|c| first[c] - last[c]), run)
}

/// Asserts that with every integrator slices of stress add up to the momentum flux, which `pressure` has, to this share. `of` makes a
/// scene with these lines at its end.
pub fn assert_slices_add_up(of: impl Fn(&str) -> Scene, steps: u64, share: f64) {
    for (name, integrator) in Integrator::ALL {
        for (axis, column) in [("x", "carried_xx"), ("z", "carried_zz")] {
            let dt = if integrator.has_time() { "dt = 0.02\n" } else { "" };
            let scene = of(&format!(
                "[[stage]]\nname = \"run\"\nsteps = {steps}\nintegrator = \"{name}\"\n{dt}[observe]\nevery = 1\n\
                 pressure = true\nstress_profile = {{ axis = \"{axis}\", bins = 7 }}\n"
            ));
            let (out, ..) = observed(&scene, Recorded::Lines);
            let of = |name: &str| out.iter().find(|o| o.name == name).unwrap();
            let normal = &of("stress_profile").get("normal").unwrap().values;
            let mean = normal.iter().sum::<f64>() / normal.len() as f64;
            let off = (mean / of("pressure").get(column).unwrap().values[0] - 1.0).abs();
            assert!(off < share, "{name} {axis}: {off}");
        }
    }
}

/// Asserts that runs that are stopped and go on end in the same bytes, and so do runs on any number of threads. `of` makes a scene with
/// these lines at its end.
pub fn assert_same_bytes(of: impl Fn(&str) -> Scene) {
    let scene = of("[[stage]]\nname = \"a\"\nsteps = 6\ndt = 0.01\n\
         [[stage]]\nname = \"b\"\nsteps = 5\nintegrator = \"aboba\"\nthermostat_every = 2\ndt = 0.02\n\
         [[stage]]\nname = \"c\"\nsteps = 4\nintegrator = \"force-gradient\"\ndt = 0.02\n\
         [[stage]]\nname = \"d\"\nsteps = 3\nintegrator = \"monte-carlo\"\n\
         [output]\nthermo = 2\ndump = 3\ncheckpoint = 4\n\
         [observe]\nevery = 2\nstages = [\"a\", \"b\", \"c\"]\npressure = true\nstress_profile = true\nwall_force = true\n");
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    finished(&scene, &whole, Begin::New);
    for at in [3, 7, 10, 13, 16] {
        let out = folder.path().join(at.to_string());
        until(&scene, &out, Begin::New, at).unwrap();
        finished(&scene, &out, Begin::Resume);
        assert_same(&whole, &out, &format!("after step {at}"));
    }
    let out = folder.path().join("threads");
    let mut runner = Runner::begin(&scene, &out, Begin::New).unwrap();
    runner.set_threads(NonZeroUsize::new(3).unwrap()).unwrap();
    runner.run(&AtomicUsize::new(0), &mut |_| ()).unwrap();
    assert_same(&whole, &out, "on three threads");
}
