use super::*;
use crate::model::{Fluid, Model};
use nalgebra::Matrix3;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::noise::threefry2x32;
use std::num::NonZeroUsize;

mod distances;
mod listed;
mod ranks;

const ONE: &str = "title = \"one\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

const TWO: &str = r#"
title = "two"
species = ["A", "B"]
[[thermostat]]
between = ["A", "A"]
gamma = 4.5
range = 0.8
exponent = 2
[[thermostat]]
between = ["A", "B"]
gamma = 30.0
range = 1.0
exponent = 0.5
[[thermostat]]
between = ["B", "B"]
gamma = 0.0
range = 1.0
"#;

const FLAT: &str = "title = \"flat\"\ndimensions = 2\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 9.0\nrange = 1.0\nexponent = 2\n";

const DT: f64 = 0.05;

const UPDATES: [Update; 5] = [
    Update::Midpoint,
    Update::OrnsteinUhlenbeck,
    Update::Shardlow { reversed: false },
    Update::Shardlow { reversed: true },
    Update::LoweAndersen,
];

#[derive(Clone)]
struct Cloud {
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    species: Vec<i32>,
    mass: Vec<f64>,
    frozen: Vec<bool>,
    precision: Precision,
}

impl Cloud {
    fn new(species: usize, edges: Matrix3<f64>, periodic: [bool; 3], density: f64) -> Cloud {
        let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, periodic).unwrap();
        let flat = edges[(2, 2)] == 1.0;
        let n = (density * domain.volume(3)) as usize;
        let mut count = 0;
        let mut number = || {
            count += 1;
            f64::from(threefry2x32::<13>([count, 0], [5, 0])[0]) / 4_294_967_296.0
        };
        let mut vector = || std::array::from_fn::<f64, 3, _>(|_| number());
        let planar = |[x, y, z]: [f64; 3]| if flat { [x, y, 0.0] } else { [x, y, z] };
        let mut cloud = Cloud {
            x: (0..n).map(|_| domain.point(planar(vector()))).collect(),
            v: (0..n).map(|_| planar(vector().map(|x| 2.0 * x - 1.0))).collect(),
            tag: Vec::new(),
            species: (0..n).map(|k| (k % species) as i32).collect(),
            mass: [1.0, 7.0][..species].to_vec(),
            frozen: Vec::new(),
            precision: Precision::Mixed,
            domain,
        };
        // Two particles are at one point, and one is on a face.
        cloud.x[1] = cloud.x[0];
        cloud.x[2] = cloud.domain.origin();
        if flat {
            cloud.x.iter_mut().for_each(|x| x[2] = 0.0);
        }
        // Tags may be any different numbers.
        cloud.tag = (0..n).map(|k| 3 * ((k + n / 3) % n) as i32 + 1).collect();
        cloud
    }

    fn bodies(&self) -> Bodies<'_> {
        let Cloud { domain, x, tag, species, mass, frozen, .. } = self;
        Bodies { domain, x, tag, species, mass, frozen }
    }

    fn mass_of(&self, k: usize) -> f64 {
        let frozen = self.frozen.get(k).is_some_and(|f| *f);
        if frozen { f64::INFINITY } else { self.mass[self.species[k] as usize] }
    }

    fn momentum(&self, v: &[[f64; 3]]) -> [f64; 3] {
        std::array::from_fn(|c| (0..v.len()).map(|k| self.mass[self.species[k] as usize] * v[k][c]).sum())
    }

    fn in_order(&self, order: &[usize]) -> Cloud {
        Cloud {
            x: order.iter().map(|k| self.x[*k]).collect(),
            v: order.iter().map(|k| self.v[*k]).collect(),
            tag: order.iter().map(|k| self.tag[*k]).collect(),
            species: order.iter().map(|k| self.species[*k]).collect(),
            frozen: if self.frozen.is_empty() {
                Vec::new()
            } else {
                order.iter().map(|k| self.frozen[*k]).collect()
            },
            ..self.clone()
        }
    }
}

fn clouds() -> Vec<(&'static str, Cloud)> {
    let straight = Matrix3::from_diagonal(&[3.0, 4.1, 5.3].into());
    let narrow = Matrix3::from_diagonal_element(2.0);
    let leaning = Matrix3::new(4.0, 1.3, -0.7, 0.0, 3.5, 0.9, 0.0, 0.0, 3.0);
    let flat = Matrix3::from_diagonal(&[6.0, 5.0, 1.0].into());
    let mixed = vec![
        (ONE, Cloud::new(1, straight, [true; 3], 6.0)),
        (TWO, Cloud::new(2, straight, [true; 3], 6.0)),
        (TWO, Cloud::new(2, narrow, [true; 3], 6.0)),
        (ONE, Cloud::new(1, leaning, [true; 3], 6.0)),
        (TWO, Cloud::new(2, straight, [true, false, true], 6.0)),
        (ONE, Cloud::new(1, straight, [false, true, false], 6.0)),
        (FLAT, Cloud::new(1, flat, [true; 3], 8.0)),
        (ONE, Cloud::new(1, straight, [true; 3], 0.05)),
    ];
    let double = |(model, cloud)| (model, Cloud { precision: Precision::Double, ..cloud });
    let doubles: Vec<_> = mixed.iter().cloned().map(double).collect();
    mixed.into_iter().chain(doubles).collect()
}

/// Tolerance between two computations of the same result. In a box exactly twice as wide as the range,
/// pairs at the range may be missing.
fn rounding(cloud: &Cloud) -> f64 {
    let is_narrow = cloud.domain.lengths() == [2.0; 3];
    if cloud.precision == Precision::Double && !is_narrow { 1e-12 } else { 1e-5 }
}

fn thermostat(model: &str, kt: f64, precision: Precision) -> PairThermostat {
    let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
    let fluid = Fluid { kt, ..fluid };
    let settings = Settings { precision, ..Settings::default() };
    PairThermostat::new(&Plan::new(&fluid).unwrap(), &settings).unwrap()
}

fn pool(threads: usize) -> Pool {
    Pool::new(NonZeroUsize::new(threads).unwrap())
}

/// A thermostat with pairs and noise of `cloud`.
fn ready(model: &str, kt: f64, cloud: &Cloud, pool: &Pool) -> PairThermostat {
    let mut thermostat = thermostat(model, kt, cloud.precision);
    thermostat.find_pairs(pool, &cloud.bodies(), DT, true).unwrap();
    thermostat.draw(11, 5, Stream(0), Law::Gaussian);
    thermostat
}

/// Visits every pair with drag once: `i`, `j`, the direction `(r_i − r_j)/r` and the strength `γ w²` of the drag.
fn for_each_pair(model: &str, cloud: &Cloud, mut visit: impl FnMut(usize, usize, [f64; 3], f64)) {
    let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
    for i in 0..cloud.x.len() {
        for j in 0..i {
            let pair = cloud.species[i] as usize * fluid.species.len() + cloud.species[j] as usize;
            let Some(law) = fluid.thermostats[pair] else { continue };
            let d = cloud.domain.minimum_image(cloud.x[i], cloud.x[j]);
            let r = d.iter().map(|d| d * d).sum::<f64>().sqrt();
            if r == 0.0 || r >= law.range {
                continue;
            }
            let w = (1.0 - r / law.range).powf(law.exponent);
            visit(i, j, d.map(|d| d / r), law.gamma * w * w);
        }
    }
}

/// The velocity of `i` relative to `j` along a direction.
fn approach(cloud: &Cloud, i: usize, j: usize, e: [f64; 3]) -> f64 {
    (0..3).map(|c| e[c] * (cloud.v[i][c] - cloud.v[j][c])).sum()
}

/// Drag, summed over all pairs.
fn plain_drag(model: &str, cloud: &Cloud) -> Vec<[f64; 3]> {
    let mut force = vec![[0.0; 3]; cloud.x.len()];
    for_each_pair(model, cloud, |i, j, e, drag| {
        let along = approach(cloud, i, j, e);
        for c in 0..3 {
            force[i][c] -= drag * along * e[c];
            force[j][c] += drag * along * e[c];
        }
    });
    force
}

#[test]
fn every_pair_in_range_drags_once() {
    for (number, (model, cloud)) in clouds().into_iter().enumerate() {
        let pool = pool(1);
        let mut thermostat = ready(model, 1.0, &cloud, &pool);
        let mut force = vec![[0.0; 3]; cloud.x.len()];
        thermostat.add_forces(&pool, &cloud.v, true, false, &mut force);
        for (f, g) in force.iter().flatten().zip(plain_drag(model, &cloud).iter().flatten()) {
            assert!((f - g).abs() < rounding(&cloud) * (1.0 + g.abs()), "cloud {number}: {f} {g}");
        }
    }
}

/// kT is `Σ D μ u²/Σ D` over the pairs that drag, and the rate `2 Σ D/μ` over the degrees of freedom; the reduced mass `μ` of
/// a pair with a frozen particle is the mass of the other one.
#[test]
fn the_temperature_of_pairs_knows_their_masses() {
    for (number, (model, mut cloud)) in clouds().into_iter().enumerate() {
        cloud.mass.iter_mut().for_each(|mass| *mass *= 3.0);
        if number % 2 == 1 {
            cloud.frozen = (0..cloud.x.len()).map(|k| k % 5 == 0).collect();
        }
        let thermostat = ready(model, 1.0, &cloud, &pool(2));
        let (mut squares, mut drags, mut rates) = (0.0, 0.0, 0.0);
        for_each_pair(model, &cloud, |i, j, e, drag| {
            let inverse = 1.0 / cloud.mass_of(i) + 1.0 / cloud.mass_of(j);
            if inverse > 0.0 {
                squares += drag * approach(&cloud, i, j, e).powi(2) / inverse;
                drags += drag;
                rates += 2.0 * drag * inverse;
            }
        });
        let dimensions = if model == FLAT { 2 } else { 3 };
        let moving = (0..cloud.x.len()).filter(|k| cloud.mass_of(*k).is_finite()).count();
        match thermostat.warmth(&cloud.v, |_| 1.0) {
            None => assert_eq!(drags, 0.0, "cloud {number}"),
            Some(Warmth { kt, rate }) => {
                let expected = [squares / drags, rates / (dimensions * moving) as f64];
                for (found, expected) in [kt, rate].into_iter().zip(expected) {
                    assert!(
                        (found / expected - 1.0).abs() < rounding(&cloud),
                        "cloud {number}: {found} {expected}"
                    );
                }
            }
        }
    }
}

/// Noises of a step are independent: both of every stream and that of the forces have keys of their own, for every seed and step.
#[test]
fn streams_share_no_noise() {
    let (pool, cloud) = (pool(1), Cloud::new(1, Matrix3::from_diagonal_element(3.0), [true; 3], 1.0));
    let mut thermostat = ready(ONE, 1.0, &cloud, &pool);
    let mut keys = Vec::new();
    for seed in [1, 2, 1 << 40] {
        for step in [1, 2, 3, 1 << 33] {
            keys.push(PairNoise::new(seed, step).key());
            for stream in [0, 1, 2, 3, 4, 127, 254, 255] {
                thermostat.draw(seed, step, Stream(stream), Law::Gaussian);
                keys.extend(thermostat.noise.unwrap().0.map(|noise| noise.key()));
            }
        }
    }
    let all = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!((keys.len(), all), (all, 3 * 4 * 17));
}

/// Checks `M (v′ − v) = Δt F((v + v′)/2)` with the forces of drag and noise.
#[test]
fn the_midpoint_rule_is_solved() {
    for (number, (model, mut cloud)) in clouds().into_iter().enumerate() {
        if number % 2 == 1 {
            cloud.frozen = (0..cloud.x.len()).map(|k| k % 5 == 0).collect();
        }
        let pool = pool(2);
        let mut thermostat = ready(model, 1.3, &cloud, &pool);
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::Midpoint, &mut v);
        let pairs: usize = thermostat.planes.iter().map(|plane| plane.lists.own.count()).sum();
        assert!(pairs < 2 || (1..12).contains(&thermostat.iterations()), "{}", thermostat.iterations());
        let middle: Vec<[f64; 3]> =
            v.iter().zip(&cloud.v).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        let mut force = vec![[0.0; 3]; v.len()];
        thermostat.add_forces(&pool, &middle, true, true, &mut force);
        let (mut wrong, mut whole) = (0.0, 0.0);
        for k in 0..v.len() {
            let mass = cloud.mass_of(k);
            for c in 0..3 {
                let change = v[k][c] - cloud.v[k][c];
                if mass.is_infinite() {
                    assert_eq!(change, 0.0);
                    continue;
                }
                wrong += (change - DT * force[k][c] / mass).powi(2) * mass;
                whole += change * change * mass;
            }
        }
        assert!(wrong <= (2.0 * solution::TOLERANCE).powi(2) * whole, "cloud {number}: {wrong} of {whole}");
    }
}

/// At fixed positions the midpoint rule preserves kT of all velocities and of pairs, whatever its residual, to 0.1 %.
/// Half the time step times drag is four times the inertia of the fastest mode, or one and a half times. The bounds are five
/// times the statistical errors, which leaves one false alarm in a million.
#[test]
fn the_temperature_is_right() {
    let model = ONE.replace("4.5", "18.0");
    let mut cloud = Cloud::new(1, Matrix3::from_diagonal_element(4.0), [true; 3], 6.05);
    cloud.precision = Precision::Mixed;
    let pool = pool(1);
    let freedom = (3 * cloud.x.len() - 3) as f64;
    for dt in [0.12, 0.04] {
        let mut thermostat = thermostat(&model, 1.0, cloud.precision);
        thermostat.find_pairs(&pool, &cloud.bodies(), dt, false).unwrap();
        let (mut all, mut of_pairs, mut iterations) = (Vec::new(), Vec::new(), 0);
        let mut v = cloud.v.clone();
        for step in 0..8500 {
            thermostat.draw(3, step, Stream(0), Law::Gaussian);
            thermostat.act(&pool, Update::Midpoint, &mut v);
            if step >= 500 {
                all.push(v.as_flattened().iter().map(|v| v * v).sum::<f64>() / freedom);
                of_pairs.push(thermostat.warmth(&v, |_| 1.0).unwrap().kt);
                iterations += thermostat.iterations();
            }
        }
        let most = if dt > 0.1 { 5.5 } else { 3.1 };
        assert!((iterations as f64) < most * 8000.0, "dt = {dt}: {iterations} iterations");
        for temperatures in [all, of_pairs] {
            let blocks: Vec<f64> =
                temperatures.chunks_exact(400).map(|block| block.iter().sum::<f64>() / 400.0).collect();
            let mean = blocks.iter().sum::<f64>() / 20.0;
            let square = blocks.iter().map(|block| (block - mean).powi(2)).sum::<f64>();
            let error = (square / (19.0 * 20.0)).sqrt();
            assert!(error < 1.5e-3 && (mean - 1.0).abs() < 1e-3 + 5.0 * error, "dt = {dt}: {mean} ± {error}");
        }
    }
}

/// Two particles far from a liquid, almost as far from each other as drag reaches, change their velocities by drag and noise
/// at the middle of the step to 1 %, however strong the drag in the liquid is.
#[test]
fn slow_flow_beside_strong_drag_is_right() {
    let mut cloud = Cloud::new(1, Matrix3::from_diagonal_element(3.0), [false; 3], 6.0);
    cloud.domain =
        PeriodicBox::new([-1.0, 0.5, 2.0], Matrix3::from_diagonal_element(20.0), [false; 3]).unwrap();
    let [a, b] = [3, 4];
    (cloud.x[a], cloud.x[b]) = ([12.0, 12.0, 12.0], [12.95, 12.0, 12.0]);
    for (gamma, precision) in
        [("18.0", Precision::Mixed), ("100.0", Precision::Double), ("1000.0", Precision::Mixed)]
    {
        let model = ONE.replace("4.5", gamma);
        let mut thermostat = thermostat(&model, 1.0, precision);
        let pool = pool(1);
        thermostat.find_pairs(&pool, &cloud.bodies(), 0.06, false).unwrap();
        thermostat.draw(11, 5, Stream(0), Law::Gaussian);
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::Midpoint, &mut v);
        let middle: Vec<[f64; 3]> =
            v.iter().zip(&cloud.v).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        let mut force = vec![[0.0; 3]; v.len()];
        thermostat.add_forces(&pool, &middle, true, true, &mut force);
        let (found, exact) = (v[a][0] - cloud.v[a][0], 0.06 * force[a][0]);
        assert!(exact.abs() > 1e-4, "γ = {gamma}: {exact}");
        assert!((found / exact - 1.0).abs() < 0.011, "γ = {gamma}: {found} {exact}");
    }
}

/// The momentum that a midpoint update gives is that of drag and noise at the velocities that it says, to rounding, though the equation is
/// solved to a hundredth; at the mean of the velocities before and behind it is not. Its virial of drag is that of these forces.
#[test]
fn drag_acts_at_the_velocities_of_the_midpoint() {
    let mut most: f64 = 0.0;
    for (model, cloud) in clouds().into_iter().filter(|(model, _)| *model == ONE) {
        let pool = pool(2);
        let mut thermostat = ready(model, 1.0, &cloud, &pool);
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::Midpoint, &mut v);
        let (drag, mut middle) = (thermostat.drag_of_midpoint(), v.clone());
        thermostat.velocities_of_midpoint(&pool, &mut middle);
        for (a, b) in drag.iter().zip(thermostat.drags(&pool, &middle, None)) {
            assert!((a - b).abs() <= 1e-12 * drag[0].abs(), "{a} {b}");
        }
        let mean: Vec<[f64; 3]> =
            v.iter().zip(&cloud.v).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        let [off, far_off] = [&middle, &mean].map(|middle| {
            let mut force = vec![[0.0; 3]; v.len()];
            thermostat.add_forces(&pool, middle, true, true, &mut force);
            let off =
                |k: usize, c: usize| (v[k][c] - cloud.v[k][c] - DT * force[k][c] / cloud.mass_of(k)).abs();
            (0..v.len()).flat_map(|k| [0, 1, 2].map(|c| off(k, c))).fold(0.0, f64::max)
        });
        assert!(off < 1e-13, "{off}");
        most = far_off.max(most);
    }
    assert!(most > 1e-5, "{most}");
}

/// Checks implicit drag: `M (v′ − v) = Δt/2 F(v′)`.
#[test]
fn implicit_drag_is_solved() {
    for (model, cloud) in clouds() {
        let pool = pool(1);
        let mut thermostat = ready(model, 1.0, &cloud, &pool);
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::ImplicitDrag, &mut v);
        let mut force = vec![[0.0; 3]; v.len()];
        thermostat.add_forces(&pool, &v, true, false, &mut force);
        for k in 0..v.len() {
            for c in 0..3 {
                let change = v[k][c] - cloud.v[k][c];
                assert!((change - 0.5 * DT * force[k][c] / cloud.mass_of(k)).abs() < 1e-3, "{change}");
            }
        }
    }
}

#[test]
fn neither_threads_nor_memory_change_a_bit() {
    for (model, mut cloud) in clouds() {
        cloud.frozen = (0..cloud.x.len()).map(|k| k % 7 == 3).collect();
        let n = cloud.x.len();
        let order: Vec<usize> = (0..n).map(|k| (k * 1009 + 3) % n).collect();
        assert!(n % 1009 != 0);
        let moved = cloud.in_order(&order);
        for update in UPDATES {
            let [one, two, five] = [1, 2, 5].map(|threads| {
                let pool = pool(threads);
                let mut v = cloud.v.clone();
                let virial = ready(model, 1.0, &cloud, &pool).act(&pool, update, &mut v);
                (v, virial)
            });
            assert!(one == two && one == five, "{update:?}");
            let pool = pool(1);
            let mut v = moved.v.clone();
            let virial = ready(model, 1.0, &moved, &pool).act(&pool, update, &mut v);
            assert!(virial == one.1 && (0..n).all(|k| v[k] == one.0[order[k]]), "{update:?}");
            let frozen = (0..n).filter(|k| cloud.frozen[*k]).all(|k| one.0[k] == cloud.v[k]);
            assert!(frozen, "{update:?}");
        }
    }
}

#[test]
fn momentum_is_kept() {
    for (model, cloud) in clouds() {
        for update in UPDATES {
            let pool = pool(1);
            let mut v = cloud.v.clone();
            ready(model, 1.0, &cloud, &pool).act(&pool, update, &mut v);
            for (p, q) in cloud.momentum(&v).into_iter().zip(cloud.momentum(&cloud.v)) {
                assert!((p - q).abs() < 1e-11 * cloud.x.len() as f64, "{update:?}: {p} {q}");
            }
            assert!(v != cloud.v || cloud.x.len() < 10);
        }
    }
}

/// In open space `Σ r_ij ⊗ J_ij` equals `Σ x_i ⊗ m Δv_i`.
#[test]
fn the_virial_is_that_of_the_impulses() {
    let edges = Matrix3::from_diagonal(&[3.0, 4.1, 5.3].into());
    for (model, species) in [(ONE, 1), (TWO, 2)] {
        let cloud = Cloud::new(species, edges, [false; 3], 6.0);
        for update in UPDATES {
            let pool = pool(2);
            let mut v = cloud.v.clone();
            let found = ready(model, 1.0, &cloud, &pool).act(&pool, update, &mut v);
            for (w, (a, b)) in found.iter().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
                let sum: f64 = (0..v.len())
                    .map(|k| cloud.x[k][a] * cloud.mass_of(k) * (v[k][b] - cloud.v[k][b]) / DT)
                    .sum();
                assert!((sum - w).abs() < 1e-6 * (1.0 + v.len() as f64), "{update:?}: {sum} {w}");
            }
        }
    }
}

/// At zero temperature only drag acts, and it removes energy.
#[test]
fn at_zero_temperature_drag_is_left() {
    for (model, cloud) in clouds().into_iter().filter(|(_, cloud)| cloud.x.len() > 50) {
        for update in UPDATES {
            let pool = pool(1);
            let mut v = cloud.v.clone();
            ready(model, 0.0, &cloud, &pool).act(&pool, update, &mut v);
            let energy = |v: &[[f64; 3]]| -> f64 {
                (0..v.len()).map(|k| cloud.mass_of(k) * v[k].iter().map(|c| c * c).sum::<f64>()).sum()
            };
            assert!(energy(&v) < energy(&cloud.v), "{update:?}");
        }
    }
}

/// Without noise the update of a pair is its own adjoint in the product `Σ m u·v`, so that updates in the opposite order are
/// the adjoint of those in the order: `⟨u, A v⟩ = ⟨A′ u, v⟩`.
#[test]
fn reversed_pairs_are_the_adjoint() {
    for (model, mut cloud) in clouds().into_iter().filter(|(_, cloud)| cloud.x.len() > 50) {
        cloud.frozen.fill(false);
        let pool = pool(1);
        let act = |v: &[[f64; 3]], reversed: bool| {
            let mut v = v.to_vec();
            ready(model, 0.0, &cloud, &pool).act(&pool, Update::Shardlow { reversed }, &mut v);
            v
        };
        let product = |u: &[[f64; 3]], v: &[[f64; 3]]| -> f64 {
            (0..v.len()).map(|k| cloud.mass_of(k) * (0..3).map(|c| u[k][c] * v[k][c]).sum::<f64>()).sum()
        };
        let (v, u) = (&cloud.v, cloud.v.iter().rev().copied().collect::<Vec<_>>());
        let size = product(v, v);
        let [there, back, same] =
            [product(&u, &act(v, false)), product(&act(&u, true), v), product(&act(&u, false), v)];
        let bound = if cloud.precision == Precision::Double { 1e-12 } else { 1e-6 } * size;
        assert!((there - back).abs() < bound, "{there} {back} of {size}");
        assert!((there - same).abs() > 10.0 * bound, "the order matters");
    }
}

/// Drag is a hundred times the inertia, and a hundredth of it.
#[test]
fn weak_and_strong_drag_converge() {
    let cloud = clouds().swap_remove(0).1;
    for dt in [1e-6, 1.0, 100.0] {
        let pool = pool(1);
        let mut thermostat = thermostat(ONE, 1.0, Precision::Mixed);
        thermostat.find_pairs(&pool, &cloud.bodies(), dt, false).unwrap();
        thermostat.draw(11, 5, Stream(0), Law::Uniform);
        let mut v = cloud.v.clone();
        thermostat.act(&pool, Update::Midpoint, &mut v);
        assert!(thermostat.iterations() < 200, "dt = {dt}: {}", thermostat.iterations());
        assert!(v.iter().flatten().all(|v| v.abs() < 10.0));
    }
}

#[test]
fn unusable_input_is_refused() {
    let pool = pool(1);
    let mut cloud = Cloud::new(1, Matrix3::from_diagonal_element(1.9), [true; 3], 3.0);
    let mut thermostat = thermostat(ONE, 1.0, Precision::Mixed);
    let narrow = thermostat.find_pairs(&pool, &cloud.bodies(), DT, false);
    assert!(matches!(narrow, Err(EngineError::Host(_))));
    cloud = Cloud::new(1, Matrix3::from_diagonal_element(3.0), [true; 3], 3.0);
    cloud.x[4][1] = f64::NAN;
    let lost = thermostat.find_pairs(&pool, &cloud.bodies(), DT, false);
    assert_eq!(lost, Err(EngineError::Position { tag: cloud.tag[4] }));
}
