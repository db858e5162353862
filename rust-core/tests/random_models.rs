//! Compares the engine with the plain reference for random models, and both with the Hamiltonian.

use proptest::prelude::*;
use psidpd_core::engine::{Images, Newton, Particles, PeriodicBox, Request, Want};
use psidpd_core::model::{ExcessFreeEnergy, Fluid, Model};
use psidpd_core::truth::{self, Truth};
use random_fluid::{Random, model_text};
use with_images::{Outcome, Owned};

mod random_fluid;
mod with_images;

struct Configuration {
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    species: Vec<usize>,
}

/// Distances at which a kernel or a pair potential of the random models is not smooth.
fn kinks(fluid: &Fluid) -> Vec<f64> {
    let ranges = fluid.densities.iter().map(|d| d.kernel.range()).chain([0.8, 0.9, 1.0]);
    ranges.flat_map(|r| [r, 0.5 * r]).collect()
}

fn configuration(random: &mut Random, fluid: &Fluid) -> Configuration {
    let depth = if fluid.dimensions == 2 { 1.0 } else { random.within(1.4, 2.2) };
    let edges = nalgebra::Matrix3::new(
        random.within(2.0, 3.0),
        random.within(-0.4, 0.4),
        if fluid.dimensions == 2 { 0.0 } else { random.within(-0.4, 0.4) },
        0.0,
        random.within(2.0, 3.0),
        if fluid.dimensions == 2 { 0.0 } else { random.within(-0.4, 0.4) },
        0.0,
        0.0,
        depth,
    );
    let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true, true, fluid.dimensions == 3]).unwrap();
    let count = (4.0 * domain.volume(fluid.dimensions)).min(45.0) as usize;
    let mut x: Vec<[f64; 3]> = Vec::new();
    while x.len() < count {
        let z = if fluid.dimensions == 2 { 0.0 } else { random.within(0.0, 1.0) };
        let point = domain.point([random.within(0.0, 1.0), random.within(0.0, 1.0), z]);
        // The densities have a cusp where two particles meet.
        let apart = |other: &[f64; 3]| {
            domain.minimum_image(point, *other).iter().map(|c| c * c).sum::<f64>() > 0.05f64.powi(2)
        };
        if x.iter().all(apart) {
            x.push(point);
        }
    }
    Configuration { species: (0..count).map(|_| random.below(fluid.species.len())).collect(), x, domain }
}

fn run_engine(fluid: &Fluid, c: &Configuration, newton: Newton) -> Outcome {
    let v = vec![[0.0; 3]; c.x.len()];
    let tag: Vec<i32> = (1..=c.x.len() as i32).collect();
    let owned = Owned { domain: &c.domain, x: &c.x, v: &v, species: &c.species, tag: &tag };
    with_images::evaluate(fluid, owned, newton, None)
}

/// The side of every kink: for pairs the kinks of kernels and pair potentials, for particles those of
/// bounds and of the rows of tables.
fn sides(fluid: &Fluid, x: &[[f64; 3]], c: &Configuration, domain: &PeriodicBox, here: &Truth) -> Vec<i64> {
    let mut sides = Vec::new();
    let kinks = kinks(fluid);
    let images = if fluid.dimensions == 3 { -2..=2 } else { 0..=0 };
    for i in 0..x.len() {
        for j in 0..i {
            for (a, b, k) in (-2..=2)
                .flat_map(|a| (-2..=2).flat_map(move |b| [(a, b)]))
                .flat_map(|(a, b)| images.clone().map(move |k: i32| (a, b, k)))
            {
                let r2: f64 = (0..3)
                    .map(|m| {
                        let shift = f64::from(a) * domain.edge(0)[m]
                            + f64::from(b) * domain.edge(1)[m]
                            + f64::from(k) * domain.edge(2)[m];
                        (x[i][m] - x[j][m] + shift).powi(2)
                    })
                    .sum();
                if r2 < 1.21 {
                    sides.push(kinks.iter().filter(|r| *r * *r > r2).count() as i64);
                }
            }
        }
    }
    let count = fluid.species.len();
    for (i, alpha) in c.species.iter().copied().enumerate() {
        let n = here.densities_of(i);
        for (d, density) in fluid.densities.iter().enumerate() {
            let corrected: Vec<f64> = (0..count)
                .map(|beta| density.correction[alpha * count + beta].at(n[d * count + beta]).0)
                .collect();
            let total: f64 = corrected.iter().sum();
            if let Some(bounds) = density.bounds {
                sides.extend(
                    corrected.iter().chain([&total]).map(|n| bounds.beyond(*n).total_cmp(&0.0) as i64),
                );
            }
            if matches!(fluid.excess[alpha], ExcessFreeEnergy::Curve(_)) {
                sides.push((2.0 * total).floor() as i64);
            }
        }
    }
    sides
}

/// The fourth-order central difference of the energy, or `None` if it crosses a kink.
fn difference(
    fluid: &Fluid,
    c: &Configuration,
    h: f64,
    moved: impl Fn(f64) -> (Vec<[f64; 3]>, PeriodicBox),
) -> Option<f64> {
    let mut energies = [0.0; 5];
    let mut first = None;
    for (energy, step) in energies.iter_mut().zip([-2.0, -1.0, 0.0, 1.0, 2.0]) {
        let (x, domain) = moved(step * h);
        let here = truth::conservative(fluid, &x, &c.species, &domain).unwrap();
        *energy = here.energy;
        let sides = sides(fluid, &x, c, &domain, &here);
        if *first.get_or_insert_with(|| sides.clone()) != sides {
            return None;
        }
    }
    let [a, b, _, d, e] = energies;
    Some((8.0 * (d - b) - (e - a)) / (12.0 * h))
}

fn load(seed: u64) -> (String, Fluid, Random) {
    let mut random = Random(seed);
    let text = model_text(&mut random);
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/models/good/random.toml");
    let model = Model::parse(name, &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let fluid = model.at(random.number(0.5, 2.0)).unwrap_or_else(|e| panic!("{e}\n{text}"));
    (text, fluid, random)
}

/// Whether `a` and `b` differ by a small fraction of `scale`.
fn close(a: f64, b: f64, scale: f64) -> bool {
    (a - b).abs() <= scale
}

fn equals_reference(seed: u64) {
    let (text, fluid, mut random) = load(seed);
    let c = configuration(&mut random, &fluid);
    let truth = truth::conservative(&fluid, &c.x, &c.species, &c.domain).unwrap();
    let largest = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
    let size = truth.virial.iter().fold(1.0f64, |m, w| m.max(w.abs()));
    for newton in [Newton::On, Newton::Off] {
        let found = run_engine(&fluid, &c, newton);
        let scale = 1e-12 * truth.energy.abs().max(c.x.len() as f64);
        assert!(
            close(found.tally.energy(), truth.energy, scale),
            "{} {}\n{text}",
            found.tally.energy(),
            truth.energy
        );
        for (f, g) in found.forces.iter().flatten().zip(truth.forces.iter().flatten()) {
            assert!(close(*f, *g, 1e-12 * largest), "force {f} {g}, largest {largest}\n{text}");
        }
        for (f, g) in found.tally.virial.iter().zip(truth.virial) {
            assert!(close(*f, g, 1e-12 * size), "virial {f} {g}\n{text}");
        }
        for (f, g) in found.densities.iter().zip(&truth.densities) {
            assert!(close(*f, *g, 1e-12 * g.abs().max(1.0)), "density {f} {g}\n{text}");
        }
    }
}

/// Compares forces with differences of the energy; returns the number of differences that crossed no kink.
fn is_gradient(seed: u64) -> usize {
    let (text, fluid, mut random) = load(seed);
    let c = configuration(&mut random, &fluid);
    let here = run_engine(&fluid, &c, Newton::On);
    let mut taken = 0;
    let largest = here.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
    for _ in 0..4 {
        let (i, k) = (random.below(c.x.len()), random.below(fluid.dimensions));
        let found = difference(&fluid, &c, 2e-4, |h| {
            let mut x = c.x.clone();
            x[i][k] += h;
            (x, c.domain.clone())
        });
        if let Some(found) = found {
            taken += 1;
            let force = here.forces[i][k];
            assert!(close(force, -found, 1e-7 * largest), "force {force} against {}\n{text}", -found);
        }
    }
    let size = here.tally.virial.iter().fold(1.0f64, |m, w| m.max(w.abs()));
    for (w, a, b) in [(0, 0, 0), (1, 1, 1), (3, 0, 1)] {
        let found = difference(&fluid, &c, 5e-5, |h| {
            // The strain x_a → x_a + h x_b acts on the box and the particles.
            let strain = |p: [f64; 3]| {
                let mut q = p;
                q[a] += h * p[b];
                q
            };
            let edges = nalgebra::Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|k| {
                nalgebra::Vector3::from(strain(c.domain.edge(k)))
            }));
            let domain = PeriodicBox::new(strain(c.domain.origin()), edges, c.domain.periodic()).unwrap();
            (c.x.iter().map(|p| strain(*p)).collect(), domain)
        });
        if let Some(found) = found {
            taken += 1;
            let virial = here.tally.virial[w];
            assert!(close(virial, -found, 1e-7 * size), "virial {virial} against {}\n{text}", -found);
        }
    }
    taken
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, max_shrink_iters: 0, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn engine_equals_reference(seed: u64) {
        equals_reference(seed);
    }
}

#[test]
fn forces_and_virials_are_gradients() {
    let taken: usize = (0..50).map(|seed| is_gradient(1000 + seed)).sum();
    // Most differences must not have been skipped.
    assert!(taken > 120, "{taken}");
}

/// Particles in a box wide enough for a sweep with periods, and with room for ghosts.
fn wide_configuration(random: &mut Random, fluid: &Fluid) -> Configuration {
    let flat = fluid.dimensions == 2;
    let mut edge = || fluid.cutoff() * random.within(2.7, 3.2);
    let (a, b, c) = (edge(), edge(), if flat { 1.0 } else { edge() });
    let mut tilt = || random.within(-0.3, 0.3);
    let (xy, xz, yz) = (tilt(), if flat { 0.0 } else { tilt() }, if flat { 0.0 } else { tilt() });
    let edges = nalgebra::Matrix3::new(a, xy, xz, 0.0, b, yz, 0.0, 0.0, c);
    let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true, true, !flat]).unwrap();
    let count = (4.0 * domain.volume(fluid.dimensions)) as usize;
    let x: Vec<[f64; 3]> = (0..count)
        .map(|_| {
            let z = if flat { 0.0 } else { random.within(0.0, 1.0) };
            domain.point([random.within(0.0, 1.0), random.within(0.0, 1.0), z])
        })
        .collect();
    Configuration { species: (0..count).map(|_| random.below(fluid.species.len())).collect(), x, domain }
}

/// Energy, forces and virial of the sweep: in the box itself, and in open space with ghosts.
fn run_sweep(
    fluid: &Fluid,
    c: &Configuration,
    settings: psidpd_core::engine::Settings,
    ghosts: bool,
) -> (f64, Vec<[f64; 3]>, [f64; 6]) {
    let mut sweep = psidpd_core::engine::Sweep::new(fluid, settings).unwrap();
    let owned = c.x.len();
    let mut x = c.x.clone();
    let mut tag: Vec<i32> = (1..=owned as i32).collect();
    let mut kind: Vec<i32> = c.species.iter().map(|s| *s as i32).collect();
    let mut forces = vec![[0.0; 3]; owned];
    if !ghosts {
        assert!(sweep.fits(&c.domain));
        let particles = Particles { owned, x: &x, tag: &tag, kind: &kind };
        let tally = sweep
            .evaluate(
                &c.domain,
                &Request { particles, v: &[], step: None, want: Want::TOTALS },
                &mut forces,
                false,
            )
            .unwrap();
        return (tally.energy(), forces, tally.virial);
    }
    let mut images = Images::default();
    images.build(&c.domain, fluid.dimensions, fluid.cutoff(), owned, &mut x);
    images.forward(1, &mut tag);
    images.forward(1, &mut kind);
    let particles = Particles { owned, x: &x, tag: &tag, kind: &kind };
    let edges = nalgebra::Matrix3::from_columns(&[0, 1, 2].map(|k| c.domain.edge(k).into()));
    let open = PeriodicBox::new(c.domain.origin(), edges, [false; 3]).unwrap();
    let around = psidpd_core::engine::Around { domain: &open, images: &[] };
    sweep.first(around, &Request { particles, v: &[], step: None, want: Want::TOTALS }, &mut forces).unwrap();
    let width = sweep.plan().slope_width();
    let mut slopes = sweep.slopes_mut()[..owned * width].to_vec();
    images.forward(width, &mut slopes);
    sweep.slopes_mut().copy_from_slice(&slopes);
    let tally = sweep.second(&particles, &mut forces).unwrap();
    (tally.energy(), forces, tally.virial)
}

/// Compares every instruction set and precision, in the box and with ghosts, with the sums over pairs,
/// which the test above compares with the reference. In mixed precision the error of a force is some
/// millionths of the largest force.
#[test]
fn fast_engine_equals_plain_engine() {
    use psidpd_core::engine::{Instructions, Precision, Settings};
    for seed in 0..24 {
        let (text, fluid, mut random) = load(5000 + seed);
        let c = wide_configuration(&mut random, &fluid);
        let truth = run_engine(&fluid, &c, Newton::On);
        let largest = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
        let size = truth.tally.virial.iter().fold(1.0f64, |m, w| m.max(w.abs()));
        let energy = truth.tally.energy().abs().max(c.x.len() as f64);
        for (name, instructions) in Instructions::ALL {
            if !instructions.available() {
                continue;
            }
            for (precision, limit) in [(Precision::Double, 1e-11), (Precision::Mixed, 1e-4)] {
                for ghosts in [false, true] {
                    let settings = Settings { precision, instructions, ..Settings::default() };
                    let (u, f, w) = run_sweep(&fluid, &c, settings, ghosts);
                    let what = format!("{name}, {precision}, ghosts {ghosts}, seed {seed}\n{text}");
                    assert!(
                        close(u, truth.tally.energy(), limit * energy),
                        "energy {u} {}: {what}",
                        truth.tally.energy()
                    );
                    for (f, g) in f.as_flattened().iter().zip(truth.forces.as_flattened()) {
                        assert!(close(*f, *g, limit * largest), "force {f} {g}, largest {largest}: {what}");
                    }
                    for (w, v) in w.iter().zip(truth.tally.virial) {
                        assert!(close(*w, v, limit * size), "virial {w} {v}: {what}");
                    }
                }
            }
        }
    }
}
