//! Walls of matter, plane and round, in everything that evaluates a fluid.

use psidpd_core::engine::noise::threefry2x32;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{
    Engine, LocalEnergy, Particles, PeriodicBox, Pool, Precision, Request, Settings, Want,
};
use psidpd_core::model::wall::{Round, Surface, Wall};
use psidpd_core::model::{Fluid, Model};
use psidpd_core::truth;
use std::num::NonZeroUsize;

/// A fluid of two species, between walls of both, with bounds and corrections, two densities, of which ψ of B is linear in one, and
/// all forms of pairs.
const MIXTURE: &str = r#"
title = "m"
species = ["A", "B"]
[density.n]
kernel = "lucy"
range = 0.8
bounds = [0.5, 12.0]
correction = { "A|A" = [0.1, 1.1, 0.002], "A|B" = [0.0, 1.0], "B|A" = [0.2, 0.9], "B|B" = [0.0, 1.0] }
[density.m]
kernel = "quadratic"
range = 1.0
self = true
[density.l]
kernel = "cubic-spline"
range = 0.9
[excess_free_energy]
A = "0.1*n_A^2 + 0.05*n_A*n_B + 0.3*m^1.5 + 0.2*l_B"
B = "0.2*n^2 + 0.1*l"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = -5.0
range = 1.0
[[pair]]
between = ["A", "B"]
form = "spline"
strength = 3.0
A = 2.0
B = 1.0
range_A = 0.8
range_B = 1.0
[[pair]]
between = ["B", "B"]
form = "expression"
phi = "2*(1 - r^2)^2"
range = 1.0
"#;

const MODELS: [&str; 5] = [
    MIXTURE,
    include_str!("../../validation/models/warren2003-set6.toml"),
    include_str!("../../validation/models/standard-dpd.toml"),
    include_str!("../../validation/models/groot-warren-quadratic.toml"),
    include_str!("../../validation/models/van-der-waals-2d.toml"),
];

fn uniform(k: u32) -> f64 {
    f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 2f64.powi(32)
}

/// A fluid, and places and species of particles in a box.
type Setting = (Fluid, Vec<[f64; 3]>, Vec<i32>, PeriodicBox);

/// A fluid between two walls, of the first and of the last species, and particles between them.
fn between_walls(text: &str) -> Setting {
    let model = Model::parse("m.toml", text).unwrap();
    let (dimensions, last) = (model.dimensions(), model.species().len() - 1);
    let axis = dimensions - 1;
    let wall = |high: bool, species: usize, density: f64| Wall {
        surface: Surface::Face { axis, high },
        species,
        density,
        local_densities: if high { vec![2.0; 3] } else { Vec::new() },
        strength: if high { 0.6 } else { 1.0 },
        velocity: [0.0; 3],
        drag: [None; 2],
    };
    let fluid = model.with_walls(vec![wall(false, 0, 4.0), wall(true, last, 2.5)]).at(1.0).unwrap();
    let (lengths, mut periodic) = ([3.0, 3.2, if dimensions == 2 { 1.0 } else { 2.9 }], [true; 3]);
    periodic[axis] = false;
    let origin = if dimensions == 2 { [0.5, -1.0, -0.5] } else { [0.5, -1.0, 2.0] };
    let domain = PeriodicBox::orthogonal(origin, lengths, periodic).unwrap();
    let place = |k: u32| {
        let mut x = domain.point([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2)]);
        if dimensions == 2 {
            x[2] = 0.0;
        }
        x
    };
    let count = if dimensions == 2 { 120 } else { 110 };
    let species = (0..count as i32).map(|k| k % (last as i32 + 1)).collect();
    (fluid, (0..count).map(place).collect(), species, domain)
}

/// The setting of each test: between two plane walls, in and around a cylinder and a sphere, and in the plane in and around a circle, over
/// the ends of a box that is periodic.
fn settings(text: &str) -> Vec<Setting> {
    let mut all = vec![between_walls(text)];
    let model = Model::parse("m.toml", text).unwrap();
    let (dimensions, last) = (model.dimensions(), model.species().len() - 1);
    let lengths = [4.4, 4.6, if dimensions == 2 { 1.0 } else { 4.5 }];
    let origin = if dimensions == 2 { [0.5, -1.0, -0.5] } else { [0.5, -1.0, 2.0] };
    let domain = PeriodicBox::orthogonal(origin, lengths, [true; 3]).unwrap();
    let across = |along: Option<usize>| [0, 1, 2].map(|c| c < dimensions && Some(c) != along);
    let shapes = if dimensions == 2 { vec![None] } else { vec![Some(1), None] };
    for (along, inside) in shapes.into_iter().flat_map(|along| [(along, true), (along, false)]) {
        let radius = if inside { 1.7 } else { 1.1 };
        let round = Round { across: across(along), center: [0.8, 3.3, 2.2], radius, inside };
        let wall = Wall {
            surface: Surface::Round(round),
            species: last,
            density: 4.0,
            local_densities: vec![2.0; 3],
            strength: 0.7,
            velocity: [0.0; 3],
            drag: [None; 2],
        };
        let fluid = model.clone().with_walls(vec![wall]).at(1.0).unwrap();
        let place = |k: u32| {
            let mut x = domain.point([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2)]);
            if dimensions == 2 {
                x[2] = 0.0;
            }
            x
        };
        let is_in_fluid = |x: &[f64; 3]| {
            let nearest = |c: usize| {
                let d = x[c] - round.center[c];
                (-1..=1).map(|k| (d - f64::from(k) * lengths[c]).powi(2)).fold(f64::INFINITY, f64::min)
            };
            let square: f64 = (0..3).filter(|c| round.across[*c]).map(nearest).sum();
            (square.sqrt() < radius) == inside
        };
        let x: Vec<[f64; 3]> = (0..).map(place).filter(is_in_fluid).take(110).collect();
        let species = (0..110).map(|k| k % (last as i32 + 1)).collect();
        all.push((fluid, x, species, domain.clone()));
    }
    all
}

fn pool() -> Pool {
    Pool::new(NonZeroUsize::new(2).unwrap())
}

/// The sweep in both precisions, the sums over pairs and the evaluation for measurements are the theory written down once.
#[test]
fn every_evaluation_is_the_truth() {
    for (fluid, x, species, domain) in MODELS.into_iter().flat_map(settings) {
        let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
        let truth = truth::conservative(&fluid, &x, &indices, &domain).unwrap();
        let without = Fluid { walls: Vec::new(), ..fluid.clone() };
        let free = truth::conservative(&without, &x, &indices, &domain).unwrap();
        let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
        assert!((truth.energy - free.energy).abs() > 0.1, "walls act");
        let tag: Vec<i32> = (1..=x.len() as i32).collect();
        let mut on_walls = [0.0; 3];
        for (precision, tolerance) in [(Precision::Double, 1e-11), (Precision::Mixed, 3e-5)] {
            for sums in [false, true] {
                let settings =
                    Settings { precision, threads: NonZeroUsize::new(2).unwrap(), ..Settings::default() };
                let mut engine = Engine::new(&fluid, settings).unwrap();
                engine.use_pair_sums_only(sums);
                let particles = Particles { owned: x.len(), x: &x, tag: &tag, kind: &species };
                let want = Want { densities: true, ..Want::TOTALS };
                let request = Request { particles, v: &[], step: None, want };
                let mut forces = vec![[0.0; 3]; x.len()];
                let tally = engine.forces(&domain, &request, &mut forces, false).unwrap();
                assert!((tally.energy() - truth.energy).abs() < tolerance * truth.energy.abs().max(100.0));
                for (f, g) in forces.iter().flatten().zip(truth.forces.iter().flatten()) {
                    assert!((f - g).abs() < tolerance * scale, "{f} {g}");
                }
                for (w, v) in tally.virial.iter().zip(truth.virial) {
                    assert!((w - v).abs() < 100.0 * tolerance * scale, "{w} {v}");
                }
                let found = engine.results().densities.to_vec();
                for (n, m) in found.iter().zip(&truth.densities) {
                    assert!((n - m).abs() < tolerance * 100.0, "{n} {m}");
                }
                on_walls = [0.0; 3];
                for taken in engine.on_walls() {
                    (0..3).for_each(|c| on_walls[c] += taken.vector[c]);
                }
            }
        }
        let evaluator = Evaluator::new(fluid).unwrap();
        let found = evaluator.evaluate(&pool(), &x, &species, &domain);
        assert!((found.energy - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
        assert!(
            (evaluator.energy(&pool(), &x, &species, &domain) - truth.energy).abs()
                < 1e-10 * truth.energy.abs().max(1.0)
        );
        for (f, g) in
            found.forces(&pool(), &evaluator.fluid).iter().flatten().zip(truth.forces.iter().flatten())
        {
            assert!((f - g).abs() < 1e-11 * scale, "{f} {g}");
        }
        // Stretched, it is evaluated anew: what walls add is not among the pairs that are known.
        assert_eq!(evaluator.energy_of_stretched(&pool(), &found, &species, [1.0001, 1.0, 1.0]), None);
        // What the walls give to the fluid is what they get, with the other sign.
        for (c, on_walls) in on_walls.into_iter().enumerate() {
            let given: f64 = truth.forces.iter().map(|f| f[c]).sum();
            assert!((given + on_walls).abs() < 1e-4 * scale, "{c}: {given} {on_walls}");
        }
    }
}

/// Forces are minus the slopes of the energy and Laplacians those of the forces, by central differences, the response of the matter
/// among them.
#[test]
fn forces_are_gradients() {
    for (fluid, x, species, domain) in MODELS.into_iter().flat_map(settings) {
        let (axis, jumps) = (fluid.dimensions - 1, fluid.force_jumps());
        let evaluator = Evaluator::new(fluid).unwrap();
        let here = evaluator.evaluate(&pool(), &x, &species, &domain);
        let laplacians = here.laplacians(&pool(), &evaluator.fluid);
        let near: Vec<usize> = here.near_walls.iter().map(|near| near.particle).step_by(7).take(6).collect();
        assert!(near.len() > 3);
        for k in near {
            let moved = |c: usize, h: f64| {
                let mut x = x.clone();
                x[k][c] += h;
                evaluator.evaluate(&pool(), &x, &species, &domain)
            };
            let h = 1e-5;
            for c in 0..=axis {
                let slope = (moved(c, h).energy - moved(c, -h).energy) / (2.0 * h);
                let force = here.forces(&pool(), &evaluator.fluid)[k][c];
                assert!((slope + force).abs() < 1e-5 * (1.0 + force.abs()), "{slope} {force}");
            }
            if !jumps {
                let by = |c: usize| {
                    (moved(c, h).forces(&pool(), &evaluator.fluid)[k][c]
                        - moved(c, -h).forces(&pool(), &evaluator.fluid)[k][c])
                        / (2.0 * h)
                };
                let divergence: f64 = (0..=axis).map(by).sum();
                assert!(
                    (divergence + laplacians[k]).abs() < 1e-4 * (1.0 + divergence.abs()),
                    "{divergence} {}",
                    laplacians[k]
                );
            }
        }
    }
}

/// The changes of energy of trial moves are differences of the energy, before and after moves are accepted.
#[test]
fn trial_moves_know_walls() {
    for (fluid, mut x, species, domain) in MODELS.into_iter().flat_map(settings) {
        let (axis, mut trials) = (fluid.dimensions - 1, LocalEnergy::new(&fluid).unwrap());
        let evaluator = Evaluator::new(fluid).unwrap();
        let tag: Vec<i32> = (1..=x.len() as i32).collect();
        trials.load(&domain, &Particles { owned: x.len(), x: &x, tag: &tag, kind: &species }).unwrap();
        for k in 0..60 {
            let particle = (7 * k) % x.len();
            let mut to = x[particle];
            to[0] += 0.3 * (uniform(900 + k as u32) - 0.5);
            let [low, high] = [domain.origin()[axis], domain.origin()[axis] + domain.lengths()[axis]];
            to[axis] += 0.6 * (uniform(800 + k as u32) - 0.5);
            if !domain.periodic()[axis] {
                to[axis] = to[axis].clamp(low, high);
            }
            let before = evaluator.energy(&pool(), &x, &species, &domain);
            let found = trials.change(particle, to, 1).unwrap();
            let there = std::mem::replace(&mut x[particle], to);
            let exact = evaluator.energy(&pool(), &x, &species, &domain) - before;
            assert!((found - exact).abs() < 1e-8 * (1.0 + before.abs()), "{found} {exact}");
            match k % 3 {
                0 => x[particle] = there,
                _ => trials.accept(&mut [0; 3]),
            }
        }
    }
}

/// A half-space of particles at random places adds, in the mean, what a wall adds. Places of 400 000 particles give the mean of n at
/// every height within 0.2 % of the bulk's density; that is five standard errors.
#[test]
fn a_wall_is_the_mean_of_random_matter() {
    let fluid = Model::parse("m.toml", MODELS[1]).unwrap();
    let wall = Wall {
        surface: Surface::Face { axis: 2, high: false },
        species: 0,
        density: 6.05,
        local_densities: vec![2.3],
        strength: 1.0,
        velocity: [0.0; 3],
        drag: [None; 2],
    };
    let fluid = fluid.with_walls(vec![wall]).at(1.0).unwrap();
    let (field, kernel) = (&fluid.walls[0].fields[0], &fluid.densities[0].kernel);
    for z in [0.0, 0.15, 0.4] {
        let (count, range) = (400_000, kernel.range());
        // A block as wide as the range on both sides.
        let volume = 4.0 * range * range * range;
        let mut sum = 0.0;
        for k in 0..count {
            let at = |c: u32| f64::from(threefry2x32::<20>([k, c], [3, 4])[0]) / 2f64.powi(32);
            let d = [range * (2.0 * at(0) - 1.0), range * (2.0 * at(1) - 1.0), z + range * at(2)];
            sum += kernel.value(d.iter().map(|c| c * c).sum::<f64>().sqrt());
        }
        let n = 6.05 * volume * sum / f64::from(count);
        let found = field.densities[0].1.at(z)[0];
        assert!((n - found).abs() < 0.012, "{z}: {n} {found}");
    }
}

/// In a box that is periodic across it a wall is not there.
#[test]
fn a_periodic_direction_has_no_wall() {
    let (fluid, x, species, domain) = between_walls(MODELS[1]);
    let whole = PeriodicBox::orthogonal(domain.origin(), domain.lengths(), [true; 3]).unwrap();
    let without = Fluid { walls: Vec::new(), ..fluid.clone() };
    let [a, b] = [fluid, without].map(|fluid| {
        let evaluator = Evaluator::new(fluid).unwrap();
        let found = evaluator.evaluate(&pool(), &x, &species, &whole);
        (found.energy, found.forces(&pool(), &evaluator.fluid))
    });
    assert_eq!(a, b);
}
