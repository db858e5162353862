//! Steps beside those of the CPU in mixed precision.
#![cfg(feature = "wgpu")]

mod common;
#[path = "common/cpu.rs"]
mod cpu;

use common::{Random, by_tag, device, difference, model, particles, settings};
use cpu::Cpu;
use nalgebra::Matrix3;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::{Fluid, Model};
use psidpd_gpu::{
    BodyForce, FROZEN, GpuError, GpuSimulation, Particles, Rule, Settings, Stop, body_force_mark,
};

const VERLET: Rule = Rule::VelocityVerlet;
const TWO_STAGE: Rule = Rule::TwoStage { lambda: 0.21, gradient: 0.0, every: 1 };
const EVERY_THIRD: Rule = Rule::TwoStage { lambda: 0.21, gradient: 0.0, every: 3 };
const FORCE_GRADIENT: Rule = Rule::TwoStage { lambda: 0.17, gradient: 1.0 / 24.0, every: 2 };

fn cube(edge: f64) -> PeriodicBox {
    PeriodicBox::orthogonal([-0.5, 0.0, 3.0], [edge; 3], [true; 3]).unwrap()
}

fn start(fluid: &Fluid, settings: Settings, particles: &Particles, dt: f64, rule: Rule) -> GpuSimulation {
    let mut gpu = GpuSimulation::new(&device(), fluid, settings).unwrap();
    gpu.upload(particles, 0).unwrap();
    gpu.prepare(dt, rule, false).unwrap();
    gpu
}

fn state(gpu: &mut GpuSimulation) -> Particles {
    let mut particles = Particles::default();
    gpu.download(&mut particles).unwrap();
    particles
}

/// Makes 50 steps on both, and compares positions, velocities, boxes, totals and iterations.
fn follows(fluid: &Fluid, settings: &Settings, particles: &Particles, dt: f64, rule: Rule) {
    let mut cpu = Cpu::new(fluid, settings.clone(), particles, 0);
    cpu.forces(dt, rule == VERLET);
    (0..50).for_each(|_| cpu.step(dt, rule));
    let mut gpu = start(fluid, settings.clone(), particles, dt, rule);
    gpu.advance(20, dt, rule, false).unwrap();
    gpu.advance(30, dt, rule, true).unwrap();
    let (found, totals) = (state(&mut gpu), gpu.totals().unwrap());
    let unwrapped = |p: &Particles| -> Vec<[f64; 3]> {
        let away = |k: usize, c: usize| {
            (0..3).map(|e| settings.domain.edge(e)[c] * f64::from(p.image[k][e])).sum::<f64>()
        };
        (0..p.x.len()).map(|k| std::array::from_fn(|c| p.x[k][c] + away(k, c))).collect()
    };
    let x = difference((&found, &unwrapped(&found)), (&cpu.particles, &unwrapped(&cpu.particles)));
    let v = difference((&found, &found.v), (&cpu.particles, &cpu.particles.v));
    let size = particles.x.len() as f64;
    let energy = (totals.excess + totals.pair - cpu.tally.energy()).abs() / size;
    let error = |a: [f64; 6], b: [f64; 6]| (0..6).map(|k| (a[k] - b[k]).abs() / size).fold(0.0, f64::max);
    let virial = error(totals.virial, cpu.tally.virial);
    let heat = error(totals.thermostat_virial, cpu.tally.thermostat_virial);
    println!(
        "{} particles, {rule:?}: x {x:.1e}, v {v:.1e}, energy {energy:.1e}, virial {virial:.1e}, of drag and noise {heat:.1e}, iterations {:?}",
        particles.x.len(),
        gpu.effort()
    );
    assert!(
        x <= 1e-4 && v <= 1e-3 && energy <= 1e-4 && virial <= 1e-3 && heat <= 1e-2,
        "{x} {v} {energy} {virial} {heat}"
    );
    assert_eq!(gpu.step_number(), 50);
    if rule != VERLET {
        let iterations = cpu.iterations();
        assert!(gpu.effort()[1].abs_diff(iterations) <= 1, "{:?} {iterations}", gpu.effort());
    }
}

#[test]
fn trajectories_follow_the_cpu() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(6.0);
    let particles = particles(&mut Random(1), &fluid, &domain, 6.0);
    for rule in [VERLET, TWO_STAGE, EVERY_THIRD, FORCE_GRADIENT] {
        follows(&fluid, &settings(&fluid, &domain), &particles, 0.01, rule);
    }
}

/// Two species of different mass in a tilted plane, with frozen particles and body forces.
#[test]
fn mixtures_in_a_tilted_plane_follow_the_cpu() {
    let fluid = model("binary-2d.toml").at(1.0).unwrap();
    let edges = Matrix3::new(12.0, 3.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0);
    let domain = PeriodicBox::new([1.0, -2.0, 0.0], edges, [true; 3]).unwrap();
    let mut particles = particles(&mut Random(2), &fluid, &domain, 5.0);
    for k in 0..particles.x.len() {
        if k % 9 == 0 {
            (particles.marks[k], particles.v[k]) = (FROZEN, [0.0; 3]);
        } else {
            particles.marks[k] = body_force_mark(k % 2);
        }
    }
    let body_forces = vec![
        BodyForce { acceleration: [0.5, -0.3, 0.0], reversed_along: None },
        BodyForce { acceleration: [2.0, 0.0, 0.0], reversed_along: Some(1) },
    ];
    let settings = Settings { body_forces, ..settings(&fluid, &domain) };
    for rule in [VERLET, TWO_STAGE, FORCE_GRADIENT] {
        follows(&fluid, &settings, &particles, 0.005, rule);
    }
}

#[test]
fn particles_between_walls_follow_the_cpu() {
    let fluid = model("standard-dpd.toml").at(1.0).unwrap();
    let domain = PeriodicBox::orthogonal([0.0, -1.0, 2.0], [5.0, 4.0, 7.0], [false, true, false]).unwrap();
    let particles = particles(&mut Random(3), &fluid, &domain, 3.0);
    for rule in [VERLET, TWO_STAGE] {
        follows(&fluid, &settings(&fluid, &domain), &particles, 0.01, rule);
    }
}

/// The same bits in two runs, from particles in another order, and from the state half way.
#[test]
fn runs_repeat_and_continue_with_the_same_bits() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(7.0);
    let first = particles(&mut Random(4), &fluid, &domain, 6.0);
    let order = by_tag(&first);
    let sorted = Particles {
        x: order.iter().map(|k| first.x[*k]).collect(),
        v: order.iter().map(|k| first.v[*k]).collect(),
        tag: order.iter().map(|k| first.tag[*k]).collect(),
        ..first.clone()
    };
    for rule in [VERLET, TWO_STAGE, FORCE_GRADIENT] {
        let mut whole = start(&fluid, settings(&fluid, &domain), &first, 0.01, rule);
        whole.advance(40, 0.01, rule, true).unwrap();
        let (expected, totals) = (state(&mut whole), whole.totals().unwrap());
        let mut again = start(&fluid, settings(&fluid, &domain), &sorted, 0.01, rule);
        again.advance(15, 0.01, rule, false).unwrap();
        let half_way = state(&mut again);
        again.advance(25, 0.01, rule, true).unwrap();
        assert!(state(&mut again) == expected && again.totals().unwrap() == totals, "{rule:?}");
        let mut resumed = GpuSimulation::new(&device(), &fluid, settings(&fluid, &domain)).unwrap();
        resumed.upload(&half_way, 15).unwrap();
        resumed.advance(25, 0.01, rule, true).unwrap();
        assert!(state(&mut resumed) == expected && resumed.totals().unwrap() == totals, "{rule:?}");
    }
}

#[test]
fn momentum_is_kept() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(6.0);
    let particles = particles(&mut Random(5), &fluid, &domain, 6.0);
    for rule in [VERLET, TWO_STAGE] {
        let mut gpu = start(&fluid, settings(&fluid, &domain), &particles, 0.01, rule);
        let before = gpu.totals().unwrap().momentum;
        gpu.advance(200, 0.01, rule, false).unwrap();
        let after = gpu.totals().unwrap();
        let drift = (0..3).map(|c| (after.momentum[c] - before[c]).abs()).fold(0.0, f64::max);
        let kt = after.momentum_flux[..3].iter().sum::<f64>() / (3 * gpu.len() - 3) as f64;
        println!("{rule:?}: momentum changes by {drift:.1e}, kT {kt:.3}");
        // Roundings of 10⁻⁷ of momenta and impulses of about 1, of 1296 particles in 200 steps, without a direction.
        assert!(drift < 1e-3, "{drift}");
    }
}

/// Strong drag needs more iterations than are sent to the device at first.
#[test]
fn updates_go_on_until_they_are_accurate() {
    let text = "title = \"drag\"\nspecies = [\"A\"]\n[excess_free_energy]\nA = \"0\"\n[[thermostat]]\nbetween = [\"A\", \"A\"]\n\
                gamma = 1000\nrange = 1.0\n";
    let fluid = Model::parse("drag.toml", text).unwrap().at(1.0).unwrap();
    let domain = cube(5.0);
    let particles = particles(&mut Random(6), &fluid, &domain, 5.0);
    let settings = settings(&fluid, &domain);
    let mut cpu = Cpu::new(&fluid, settings.clone(), &particles, 0);
    (0..5).for_each(|_| cpu.step(0.02, TWO_STAGE));
    let mut gpu = start(&fluid, settings, &particles, 0.02, TWO_STAGE);
    gpu.advance(5, 0.02, TWO_STAGE, false).unwrap();
    let [updates, iterations, inaccurate] = gpu.effort();
    let found = state(&mut gpu);
    let v = difference((&found, &found.v), (&cpu.particles, &cpu.particles.v));
    println!("{iterations} iterations, {} on the cpu, v {v:.1e}", cpu.iterations());
    assert_eq!((updates, inaccurate), (5, 0));
    assert!(
        iterations > 40 && iterations.abs_diff(cpu.iterations()) <= 5 && v < 1e-3,
        "{iterations} {} {v}",
        cpu.iterations()
    );
}

#[test]
fn a_failing_step_is_named() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(6.0);
    let mut fast = particles(&mut Random(7), &fluid, &domain, 6.0);
    let tag = fast.tag[17];
    fast.v[17] = [400.0, 0.0, 0.0];
    let mut gpu = start(&fluid, settings(&fluid, &domain), &fast, 0.01, TWO_STAGE);
    gpu.advance(2, 0.001, TWO_STAGE, false).unwrap();
    let stopped = gpu.advance(100, 0.03, TWO_STAGE, false);
    assert_eq!(stopped, Err(GpuError::Stopped(Stop::Runaway { step: 3, tag })));
    fast.v[17] = [f64::NAN; 3];
    let mut gpu = start(&fluid, settings(&fluid, &domain), &fast, 0.01, TWO_STAGE);
    let stopped = gpu.advance(100, 0.01, TWO_STAGE, false);
    assert_eq!(stopped, Err(GpuError::Stopped(Stop::Velocity { step: 1, tag })));
    // ψ is singular where there are no neighbours.
    let text = "title = \"s\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[excess_free_energy]\nA = \"ln(n)\"\n";
    let singular = Model::parse("s.toml", text).unwrap().at(1.0).unwrap();
    let mut apart = particles(&mut Random(8), &singular, &domain, 0.05);
    apart.tag.reverse();
    let mut gpu = GpuSimulation::new(&device(), &singular, settings(&singular, &domain)).unwrap();
    gpu.upload(&apart, 4).unwrap();
    let stopped = gpu.prepare(0.01, VERLET, false);
    assert!(matches!(stopped, Err(GpuError::Stopped(Stop::ExcessFreeEnergy { step: 4, .. }))), "{stopped:?}");
}

#[test]
fn what_is_not_there_is_refused_by_name() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let refusal = |domain: &PeriodicBox| match GpuSimulation::new(&device(), &fluid, settings(&fluid, domain))
    {
        Err(GpuError::Unsupported(unsupported)) => unsupported.what,
        other => panic!("{other:?}"),
    };
    assert_eq!(refusal(&cube(1.9)), "a box narrower than twice the cutoff along a period");
    let edges = Matrix3::new(6.0, 1.0, 0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 6.0);
    let leaning = PeriodicBox::new([0.0; 3], edges, [true, true, false]).unwrap();
    assert_eq!(refusal(&leaning), "walls in a tilted box");
    let text = "title = \"s\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[excess_free_energy]\nA = \"1e50*n^2\"\n";
    let large = Model::parse("s.toml", text).unwrap().at(1.0).unwrap();
    let refused =
        GpuSimulation::new(&device(), &large, settings(&large, &cube(6.0))).unwrap_err().to_string();
    assert!(refused.starts_with("the number 1e50 of the model: not available on a gpu"), "{refused}");
}

/// A temperature that is set is that of a simulation that begins with it, and of the thermostat.
#[test]
fn temperatures_and_settings_change() {
    let model = Model::parse(
        "t.toml",
        "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"lucy\"\nrange = 1.0\n[excess_free_energy]\n\
         A = \"n*(2 - kT)*(1 + 0.1*kT*n)\"\n[[thermostat]]\nbetween = [\"A\", \"A\"]\ngamma = 4.5\nrange = 1.0\n",
    )
    .unwrap();
    let domain = cube(5.0);
    let [cold, hot, linear] = [0.7, 1.3, 2.0].map(|kt| model.at(kt).unwrap());
    let particles = particles(&mut Random(9), &cold, &domain, 5.0);
    let of = |fluid: &Fluid| {
        let mut gpu =
            start(fluid, Settings { seed: 6, ..settings(fluid, &domain) }, &particles, 0.01, VERLET);
        (gpu.prepare(0.01, VERLET, true), gpu.totals().unwrap(), state(&mut gpu))
    };
    let mut gpu = start(&cold, settings(&cold, &domain), &particles, 0.01, VERLET);
    gpu.set_settings(Settings { seed: 6, ..settings(&cold, &domain) }).unwrap();
    // At kT = 2 the formula is another: 0.
    for fluid in [&hot, &linear, &cold] {
        gpu.set_fluid(fluid).unwrap();
        let found = (gpu.prepare(0.01, VERLET, true), gpu.totals().unwrap(), state(&mut gpu));
        assert!(found == of(fluid), "{}", fluid.kt);
    }
}

#[test]
fn memory_and_times_are_known() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let particles = particles(&mut Random(10), &fluid, &cube(12.0), 6.05);
    let mut gpu = start(&fluid, settings(&fluid, &cube(12.0)), &particles, 0.01, VERLET);
    let per_particle = |gpu: &GpuSimulation| gpu.memory_bytes() as f64 / gpu.len() as f64;
    let verlet = per_particle(&gpu);
    gpu.advance(1, 0.01, TWO_STAGE, false).unwrap();
    println!("bytes per particle: {verlet:.1}, with the implicit thermostat {:.1}", per_particle(&gpu));
    assert!(verlet < 140.0 && per_particle(&gpu) < 200.0);
    gpu.measure_time(true).unwrap();
    gpu.advance(5, 0.01, VERLET, false).unwrap();
    let times = gpu.timings();
    for time in &times {
        println!("{}: {} runs, {:.1e} s", time.kernel, time.runs, time.seconds);
    }
    let forces = times.iter().find(|time| time.kernel == "forces").unwrap();
    assert!(forces.runs == 5 && forces.seconds > 0.0 && times.len() == 8, "{times:?}");
}
