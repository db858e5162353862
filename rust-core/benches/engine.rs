//! Micro-benchmarks of the engine on one thread: `cargo bench -p psidpd-core`.
//!
//! - `sweep`: one evaluation of all forces of 6050 particles, for each fluid, precision and instruction set;
//! - `reference`: the same by the reference;
//! - `noise`: the random numbers of pairs;
//! - `psi`: ψ and its slopes, in blocks as the engine evaluates them.

mod setup;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use psidpd_core::engine::noise::PairNoise;
use psidpd_core::engine::{Engine, Instructions, Particles, Precision, Request, Settings, Step, Want};
use psidpd_core::model::ExcessFreeEnergy;
use psidpd_core::model::expression::{Formula, Program};
use setup::{Cloud, SUBJECTS, sweep, uniform};
use std::hint::black_box;
use std::time::Duration;

const COUNT: usize = 6050;

fn sweeps(c: &mut Criterion) {
    let mut group = c.benchmark_group("sweep");
    group.throughput(Throughput::Elements(COUNT as u64));
    for subject in &SUBJECTS {
        let fluid = subject.fluid();
        for (precision_name, precision) in Precision::ALL {
            for (set_name, set) in Instructions::ALL.into_iter().filter(|(_, set)| set.available()) {
                let mut cloud = Cloud::new(subject, &fluid, COUNT);
                let mut sweep = sweep(&fluid, precision, set);
                group.bench_function(format!("{} {precision_name} {set_name}", subject.name), |b| {
                    b.iter(|| {
                        cloud.drift();
                        cloud.evaluate(&mut sweep);
                    });
                });
            }
        }
    }
    group.finish();
}

fn reference(c: &mut Criterion) {
    let mut group = c.benchmark_group("reference");
    group.throughput(Throughput::Elements(COUNT as u64));
    for subject in &SUBJECTS {
        let fluid = subject.fluid();
        let mut reference = Engine::new(&fluid, Settings::default()).expect("a plan");
        reference.use_pair_sums_only(true);
        let mut cloud = Cloud::new(subject, &fluid, COUNT);
        let mut number = 0;
        group.bench_function(subject.name, |b| {
            b.iter(|| {
                number += 1;
                let Cloud { domain, x, v, tag, kind, force, .. } = &mut cloud;
                let particles = Particles { owned: COUNT, x, tag, kind };
                let step = Some(Step { seed: 1, number, dt: subject.dt });
                let request = Request { particles, v, step, want: Want::FORCES };
                reference.forces(domain, &request, force, false).expect("forces");
            });
        });
    }
    group.finish();
}

fn noise(c: &mut Criterion) {
    const PAIRS: u32 = 4096;
    let mut group = c.benchmark_group("noise");
    group.throughput(Throughput::Elements(u64::from(PAIRS)));
    let noise = PairNoise::new(1, 2);
    group.bench_function("xi", |b| {
        b.iter(|| (0..PAIRS).map(|k| noise.xi(black_box(k), k + 17)).sum::<f64>());
    });
    group.finish();
}

fn psi(c: &mut Criterion) {
    const LANES: usize = 64;
    let mut group = c.benchmark_group("psi");
    group.throughput(Throughput::Elements(LANES as u64));
    for subject in &SUBJECTS {
        let fluid = subject.fluid();
        let variables = fluid.variables();
        let ExcessFreeEnergy::Formula(psi) = &fluid.excess[0] else { continue };
        if variables == 0 {
            continue;
        }
        let slopes: Vec<Formula> = (0..variables).map(|v| psi.derivative(v).expect("a slope")).collect();
        let outputs: Vec<&Formula> = std::iter::once(psi).chain(&slopes).collect();
        let program = Program::new(&outputs);
        let at: Vec<f64> = (0..variables * LANES).map(|k| 4.0 + 4.0 * uniform(k)).collect();
        let mut work = Vec::new();
        group.bench_function(subject.name, |b| {
            b.iter_batched_ref(
                || vec![0.0; outputs.len() * LANES],
                |out| program.eval_block(LANES, black_box(&at), out, &mut work),
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(30)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2));
    targets = sweeps, reference, noise, psi
}
criterion_main!(benches);
