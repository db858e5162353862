//! Steps: the same bits in two runs, momentum, faults, refusals, changes of temperature, memory. The tests of the native runner
//! compare trajectories with those of the CPU.
#![cfg(feature = "wgpu")]

mod common;

use common::{by_tag, device, model, particles, settings};
use nalgebra::Matrix3;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::{Fluid, Model};
use psidpd_gpu::{Fault, GpuError, GpuSimulation, Particles, Rule, Settings, Stop};

const VERLET: Rule = Rule::VelocityVerlet;
const TWO_STAGE: Rule = Rule::TwoStage { lambda: 0.21, gradient: 0.0, every: 1 };
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

/// The same bits in two runs, from particles in another order, and from the state half way.
#[test]
fn runs_repeat_and_continue_with_the_same_bits() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(7.0);
    let first = particles(4, &fluid, &domain, 6.0);
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
    let particles = particles(5, &fluid, &domain, 6.0);
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

#[test]
fn a_failing_step_is_named() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let domain = cube(6.0);
    let mut fast = particles(7, &fluid, &domain, 6.0);
    let tag = fast.tag[17];
    fast.v[17] = [400.0, 0.0, 0.0];
    let mut gpu = start(&fluid, settings(&fluid, &domain), &fast, 0.01, TWO_STAGE);
    gpu.advance(2, 0.001, TWO_STAGE, false).unwrap();
    let stopped = gpu.advance(100, 0.03, TWO_STAGE, false);
    assert_eq!(stopped, Err(GpuError::Stopped(Stop { step: 3, tag, fault: Fault::Runaway })));
    fast.v[17] = [f64::NAN; 3];
    let mut gpu = start(&fluid, settings(&fluid, &domain), &fast, 0.01, TWO_STAGE);
    let stopped = gpu.advance(100, 0.01, TWO_STAGE, false);
    assert_eq!(stopped, Err(GpuError::Stopped(Stop { step: 1, tag, fault: Fault::Velocity })));
    // ψ is singular where there are no neighbours.
    let text = "title = \"s\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[excess_free_energy]\nA = \"ln(n)\"\n";
    let singular = Model::parse("s.toml", text).unwrap().at(1.0).unwrap();
    let mut apart = particles(8, &singular, &domain, 0.05);
    apart.tag.reverse();
    let mut gpu = GpuSimulation::new(&device(), &singular, settings(&singular, &domain)).unwrap();
    gpu.upload(&apart, 4).unwrap();
    let stopped = gpu.prepare(0.01, VERLET, false);
    assert!(
        matches!(stopped, Err(GpuError::Stopped(Stop { step: 4, fault: Fault::ExcessFreeEnergy, .. }))),
        "{stopped:?}"
    );
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
    let particles = particles(9, &cold, &domain, 5.0);
    let of = |fluid: &Fluid| {
        let mut gpu =
            start(fluid, Settings { seed: 6, ..settings(fluid, &domain) }, &particles, 0.01, VERLET);
        (gpu.prepare(0.01, VERLET, true), gpu.totals().unwrap(), state(&mut gpu))
    };
    let mut gpu = start(&cold, settings(&cold, &domain), &particles, 0.01, VERLET);
    // At kT = 2 the formula is another: 0.
    for fluid in [&hot, &linear, &cold] {
        gpu.replace(fluid, Settings { seed: 6, ..settings(fluid, &domain) }).unwrap();
        let found = (gpu.prepare(0.01, VERLET, true), gpu.totals().unwrap(), state(&mut gpu));
        assert!(found == of(fluid), "{}", fluid.kt);
    }
}

#[test]
fn memory_and_times_are_known() {
    let fluid = model("warren2003-set6.toml").at(1.0).unwrap();
    let particles = particles(10, &fluid, &cube(12.0), 6.05);
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
