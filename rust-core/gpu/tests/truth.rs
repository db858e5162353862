//! Forces, energies and virials beside the plain reference.
#![cfg(feature = "wgpu")]

mod common;

use common::{device, difference, particles, random_fluid, settings};
use nalgebra::Matrix3;
use psidpd_core::engine::{PeriodicBox, Step};
use psidpd_core::model::{Fluid, Model};
use psidpd_core::truth;
use psidpd_gpu::{Device, GpuError, GpuSimulation, Particles, Rule};

const DT: f64 = 0.01;

/// Largest errors of conservative forces and of all, relative to the largest force, of the energy and of virials.
type Errors = [f64; 4];

const ALLOWED: Errors = [2e-5, 2e-5, 1e-6, 5e-6];

fn in_words(errors: Errors) -> String {
    let [conservative, all, energy, virial] = errors.map(|e| format!("{e:.1e}"));
    format!("forces {conservative}, with drag and noise {all}, energy {energy}, virial {virial}")
}

fn are_allowed(errors: Errors) -> bool {
    errors.iter().zip(ALLOWED).all(|(e, allowed)| *e <= allowed)
}

fn errors(device: &Device, fluid: &Fluid, domain: &PeriodicBox, particles: &Particles) -> Errors {
    let Particles { x, v, species, tag, .. } = particles;
    let species: Vec<usize> = species.iter().map(|s| *s as usize).collect();
    let truth = truth::conservative(fluid, x, &species, domain).unwrap();
    let step = Step { seed: 12345, number: 7, dt: DT };
    let (heat, of_heat) = truth::drag_and_noise(fluid, x, v, tag, &species, domain, step);
    let largest = |f: &[[f64; 3]]| f.iter().flatten().fold(0.0, |m: f64, f| m.max(f.abs()));
    let mut gpu = GpuSimulation::new(device, fluid, settings(fluid, domain)).unwrap();
    gpu.upload(particles, 7).unwrap();
    let mut found = Particles::default();
    let two_stage = Rule::TwoStage { lambda: 0.21, gradient: 0.0, every: 1 };
    gpu.prepare(DT, two_stage, true).unwrap();
    gpu.download(&mut found).unwrap();
    let totals = gpu.totals().unwrap();
    let conservative =
        difference((&found, &found.force), (particles, &truth.forces)) / largest(&truth.forces);
    let all: Vec<[f64; 3]> =
        truth.forces.iter().zip(&heat).map(|(a, b)| [0, 1, 2].map(|c| a[c] + b[c])).collect();
    gpu.prepare(DT, Rule::VelocityVerlet, true).unwrap();
    gpu.download(&mut found).unwrap();
    let with_heat = gpu.totals().unwrap();
    // Virials of 10⁻⁶ kT per particle are errors of the pressure of 10⁻⁶ of that of an ideal gas.
    let error = |found: [f64; 6], exact: [f64; 6]| {
        let scale = exact.iter().fold(x.len() as f64, |m, w| m.max(w.abs()));
        (0..6).map(|k| (found[k] - exact[k]).abs() / scale).fold(0.0, f64::max)
    };
    [
        conservative,
        difference((&found, &found.force), (particles, &all)) / largest(&all),
        // Energies that cancel are known to 10⁻⁶ kT per particle.
        (totals.tally.energy() - truth.energy).abs() / truth.energy.abs().max(x.len() as f64),
        error(totals.tally.virial, truth.virial).max(error(with_heat.tally.thermostat_virial, of_heat)),
    ]
}

fn density(fluid: &Fluid) -> f64 {
    if fluid.title.contains("Lennard") { 0.7 } else { 5.0 }
}

/// The box of every model: tilted in every second.
fn domain(fluid: &Fluid, tilts: bool) -> PeriodicBox {
    let cutoff = fluid.cutoff();
    let tilt = if tilts { 0.7 } else { 0.0 };
    let depth = if fluid.dimensions == 2 { 1.0 } else { 3.9 * cutoff };
    let flat = if fluid.dimensions == 2 { 0.0 } else { tilt };
    let wide = if fluid.dimensions == 2 { 9.0 } else { 4.3 };
    let edges = Matrix3::new(wide * cutoff, tilt, -flat, 0.0, 3.7 * cutoff, flat, 0.0, 0.0, depth);
    PeriodicBox::new([-1.0, 0.5, 0.0], edges, [true; 3]).unwrap()
}

#[test]
fn every_shipped_model_has_the_forces_of_the_reference() {
    let device = device();
    let mut wrong = Vec::new();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../validation/models");
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for (k, name) in names.iter().filter(|name| name.ends_with(".toml")).enumerate() {
        let fluid = common::model(name).at(1.0).unwrap();
        let domain = domain(&fluid, k % 2 == 1);
        let particles = particles(k as u64, &fluid, &domain, density(&fluid));
        let errors = errors(&device, &fluid, &domain, &particles);
        println!("{name}: {} particles, {}", particles.x.len(), in_words(errors));
        if !are_allowed(errors) {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Random formulas, kernels, corrections, bounds, tables, equations of state and pair forms, in two and three dimensions.
#[test]
fn random_models_have_the_forces_of_the_reference() {
    let device = device();
    let (mut wrong, mut refused, mut worst) = (Vec::new(), Vec::new(), [0.0f64; 4]);
    for seed in 0..200 {
        let mut random = random_fluid::Random(seed);
        let text = random_fluid::model_text(&mut random);
        let name = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/models/good/random.toml");
        let fluid = Model::parse(name, &text).unwrap().at(random.number(0.5, 2.0)).unwrap();
        let wide = if fluid.dimensions == 2 { 5.0 } else { 3.0 };
        let tilt = |random: &mut random_fluid::Random| random.within(-0.4, 0.4);
        let depth = if fluid.dimensions == 2 { 1.0 } else { random.within(2.6, 3.4) };
        let mut edges = Matrix3::from_diagonal(&nalgebra::Vector3::new(wide, random.within(2.9, 4.0), depth));
        edges[(0, 1)] = tilt(&mut random);
        if fluid.dimensions == 3 {
            (edges[(0, 2)], edges[(1, 2)]) = (tilt(&mut random), tilt(&mut random));
        }
        let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true; 3]).unwrap();
        let mut particles = particles(seed, &fluid, &domain, 4.0);
        // Two-dimensional models do not look at z.
        particles.x.iter_mut().for_each(|x| x[2] = x[2].max(2.0));
        match GpuSimulation::new(&device, &fluid, settings(&fluid, &domain)) {
            Err(error @ GpuError::Unsupported(_)) => {
                refused.push(format!("{error}\n{text}"));
                continue;
            }
            other => drop(other.unwrap()),
        }
        let errors = errors(&device, &fluid, &domain, &particles);
        worst.iter_mut().zip(errors).for_each(|(worst, e)| *worst = worst.max(e));
        if !are_allowed(errors) {
            wrong.push(format!("{seed}: {}\n{text}", in_words(errors)));
        }
    }
    println!("the largest errors: {}", in_words(worst));
    assert!(wrong.is_empty() && refused.is_empty(), "{}\n{}", wrong.join("\n"), refused.join("\n"));
}
