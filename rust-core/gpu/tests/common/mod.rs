//! Particles without a pattern, and the device that tests run on.
#![allow(dead_code)]

#[path = "../../../tests/random_fluid/mod.rs"]
pub mod random_fluid;

use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::{Fluid, Model};
use psidpd_gpu::{Device, Particles, Settings};
use random_fluid::Random;
use std::path::Path;

/// The device of an index in `PSIDPD_GPU_DEVICE`, or the first.
pub fn device() -> Device {
    let index = std::env::var("PSIDPD_GPU_DEVICE").ok().map(|index| index.parse().unwrap());
    Device::open(index).unwrap()
}

/// Particles on a grid of about `density`, each off by up to 0.3 of the spacing, with velocities of about 1.
pub fn particles(seed: u64, fluid: &Fluid, domain: &PeriodicBox, density: f64) -> Particles {
    let mut random = Random(seed);
    let dimensions = fluid.dimensions;
    let spacing = density.powf(-1.0 / dimensions as f64);
    let along = [0, 1, 2]
        .map(|k| if k < dimensions { (domain.height(k) / spacing).round().max(1.0) as usize } else { 1 });
    let mut particles = Particles::default();
    for (a, b, c) in
        (0..along[0]).flat_map(|a| (0..along[1]).flat_map(move |b| (0..along[2]).map(move |c| (a, b, c))))
    {
        let mut s = [0.0; 3];
        for (k, at) in [a, b, c].into_iter().enumerate().filter(|(k, _)| *k < dimensions) {
            s[k] = (at as f64 + 0.5 + random.within(-0.3, 0.3)) / along[k] as f64;
        }
        particles.x.push(domain.point(s));
        let mut v = [0; 3].map(|_| random.within(-1.7, 1.7));
        v[dimensions..].fill(0.0);
        particles.v.push(v);
        particles.species.push(random.below(fluid.species.len()) as i32);
    }
    let count = particles.x.len();
    // Tags in no order.
    particles.tag = (1..=count as i32).collect();
    for k in (1..count).rev() {
        particles.tag.swap(k, random.below(k + 1));
    }
    (particles.image, particles.marks) = (vec![[0; 3]; count], vec![0; count]);
    particles
}

pub fn settings(fluid: &Fluid, domain: &PeriodicBox) -> Settings {
    Settings {
        domain: domain.clone(),
        mass: (0..fluid.species.len()).map(|s| 1.0 + 0.5 * s as f64).collect(),
        seed: 12345,
        thermostat: true,
        body_forces: Vec::new(),
    }
}

/// Path of a shipped model.
pub fn model(name: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../validation/models").join(name);
    Model::open(&path).unwrap()
}

/// The particle of each tag, in the order of tags.
pub fn by_tag(particles: &Particles) -> Vec<usize> {
    let mut order: Vec<usize> = (0..particles.tag.len()).collect();
    order.sort_by_key(|k| particles.tag[*k]);
    order
}

/// The largest difference of vectors by tag.
pub fn difference(a: (&Particles, &[[f64; 3]]), b: (&Particles, &[[f64; 3]])) -> f64 {
    let pairs = by_tag(a.0).into_iter().zip(by_tag(b.0));
    pairs
        .flat_map(|(i, j)| (0..3).map(move |c| (a.1[i][c] - b.1[j][c]).abs()))
        .fold(0.0, |m, d| if d > m || d.is_nan() { d } else { m })
}
