use super::*;
use crate::engine::{Engine, Images, Instructions, Step, Want};
use crate::maximum::largest;
use crate::model::Model;
use nalgebra::Matrix3;
use std::num::NonZeroUsize;
use std::path::Path;

mod miri_sized;
mod ranks;
use ranks::with_ghosts;

/// A reproducible generator of points.
struct Points(u64);

impl Points {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Particles in a box, with their velocities.
#[derive(Clone)]
struct Cloud {
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
}

impl Cloud {
    fn new(domain: PeriodicBox, dimensions: usize, species: usize, count: usize, seed: u64) -> Cloud {
        let mut points = Points(seed);
        let mut cloud = Cloud { domain, x: vec![], v: vec![], tag: vec![], kind: vec![] };
        for k in 0..count {
            let mut s = [points.unit(), points.unit(), points.unit()];
            let mut v = [points.unit() - 0.5, points.unit() - 0.5, points.unit() - 0.5];
            if dimensions == 2 {
                (s[2], v[2]) = (0.5, 0.0);
            }
            cloud.x.push(cloud.domain.point(s));
            cloud.v.push(v);
            // The tags are not in order.
            cloud.tag.push(1 + ((k * 7919) % count) as i32);
            cloud.kind.push((points.unit() * species as f64) as i32);
        }
        let mut tags = cloud.tag.clone();
        tags.sort_unstable();
        tags.dedup();
        assert_eq!(tags.len(), count, "a number of particles that 7919 divides");
        cloud
    }

    fn particles(&self) -> Particles<'_> {
        Particles { owned: self.x.len(), x: &self.x, tag: &self.tag, kind: &self.kind }
    }
}

const STEP: Step = Step { seed: 11, number: 5, dt: 0.01 };

/// Computes forces and totals by the reference.
fn plain(fluid: &Fluid, cloud: &Cloud) -> (Vec<[f64; 3]>, Tally) {
    let mut reference = Engine::new(fluid, Settings::default()).unwrap();
    reference.use_pair_sums_only(true);
    let request = Request { particles: cloud.particles(), v: &cloud.v, step: Some(STEP), want: Want::TOTALS };
    let mut force = vec![[0.0; 3]; cloud.x.len()];
    let tally = reference.forces(&cloud.domain, &request, &mut force, false).unwrap();
    (force, tally)
}

fn settings(precision: Precision, instructions: Instructions, threads: usize) -> Settings {
    Settings { precision, instructions, threads: NonZeroUsize::new(threads).unwrap() }
}

fn every() -> impl Iterator<Item = (Precision, Instructions)> {
    let precisions = [Precision::Mixed, Precision::Double];
    let sets = Instructions::ALL.map(|(_, set)| set);
    precisions.into_iter().flat_map(move |p| sets.into_iter().filter(|i| i.available()).map(move |i| (p, i)))
}

/// Computes forces and totals by a sweep without ghosts.
fn swept(sweep: &mut Sweep, cloud: &Cloud, want: Want) -> (Vec<[f64; 3]>, Tally) {
    let particles = cloud.particles();
    let mut force = vec![[0.0; 3]; cloud.x.len()];
    let tally = sweep
        .evaluate(
            &cloud.domain,
            &Request { particles, v: &cloud.v, step: Some(STEP), want },
            &mut force,
            false,
        )
        .unwrap();
    (force, tally)
}

/// Largest difference of two sets of forces, over the rms force.
fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square: f64 = a.as_flattened().iter().map(|f| f * f).sum();
    let rms = (square / a.len() as f64).sqrt().max(1e-300);
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    largest(pairs.map(|(a, b)| (a - b).abs())) / rms
}

fn tally_difference(a: &Tally, b: &Tally) -> f64 {
    let list = |t: &Tally| -> Vec<f64> {
        let virials = t.virial.into_iter().chain(t.thermostat_virial).chain(t.drag_virial);
        [t.excess, t.pair].into_iter().chain(virials).collect()
    };
    let (a, b) = (list(a), list(b));
    let scale = largest(&a).max(1e-300);
    largest(a.iter().zip(&b).map(|(a, b)| (a - b).abs())) / scale
}

/// The largest error of a force for each precision, relative to the rms force.
fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::Mixed => 1e-5,
        Precision::Double => 1e-12,
    }
}

fn boxes(dimensions: usize, length: f64) -> Vec<PeriodicBox> {
    let l = length;
    let cube = PeriodicBox::orthogonal(
        [-1.0, 2.0, -0.5],
        [l, 1.1 * l, if dimensions == 3 { 0.9 * l } else { 1.0 }],
        [true; 3],
    );
    let mut edges = Matrix3::new(1.2 * l, 0.3 * l, -0.2 * l, 0.0, l, 0.25 * l, 0.0, 0.0, l);
    if dimensions == 2 {
        edges = Matrix3::new(1.2 * l, 0.3 * l, 0.0, 0.0, l, 0.0, 0.0, 0.0, 1.0);
    }
    let skew = PeriodicBox::new([0.5, 0.0, -0.5], edges, [true; 3]);
    vec![cube.unwrap(), skew.unwrap()]
}

/// Every model file that ships, and models with features that these lack.
fn fluids() -> Vec<(String, Fluid)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models");
    let mut fluids: Vec<(String, Fluid)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| {
            let fluid = Model::open(&path).unwrap().at(1.0).unwrap();
            (path.file_name().unwrap().to_string_lossy().into_owned(), fluid)
        })
        .collect();
    fluids.sort_by(|a, b| a.0.cmp(&b.0));
    for (k, text) in [MANY, EXPONENTS, WIDE, SHORT, THREE].into_iter().enumerate() {
        let model = Model::parse("many", text).unwrap_or_else(|e| panic!("{e}"));
        fluids.push((format!("own {k}"), model.at(0.7).unwrap()));
    }
    for exponent in [0.25, 0.5, 0.75, 1.75, 3.0, 4.0, 1.0 / 3.0] {
        let text = EXPONENTS.replace("exponent = 2", &format!("exponent = {exponent}"));
        let model = Model::parse("exponent", &text).unwrap_or_else(|e| panic!("{e}"));
        fluids.push((format!("exponent {exponent}"), model.at(0.7).unwrap()));
    }
    fluids
}

/// A fluid with two species, three densities of different range and kernel, one of them linear, bounds,
/// a correction, self terms, every pair form, and thermostats by pair.
const MANY: &str = r#"
title = "everything at once"
species = ["A", "B"]
[density.n]
kernel = "lucy"
range = 1.0
correction = [0.5, 1.1]
bounds = [1.0, 6.0]
[density.m]
kernel = "wendland-c2"
range = 0.7
self = true
[density.k]
kernel = "cubic-spline"
range = 0.9
[excess_free_energy]
A = "0.3*n^1.5 + 0.1*m_A*m_B + 0.7*k_B"
B = "0.2*n_A*n_B + 0.05*m^2 + 0.4*k_A"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 20.0
range = 1.0
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 35.0
range = 0.8
[[pair]]
between = ["A", "A"]
form = "soft"
strength = -3.0
range = 0.6
[[pair]]
between = ["B", "B"]
form = "spline"
strength = 9.5
A = 2.0
B = 1.0
range_A = 0.8
range_B = 1.0
[[pair]]
between = ["A", "B"]
form = "expression"
phi = "3*(1 - r)^3"
range = 1.0
[[thermostat]]
between = ["A", "A"]
gamma = 4.5
range = 1.0
exponent = 1
[[thermostat]]
between = ["A", "B"]
gamma = 9.0
range = 0.8
exponent = 2
[[thermostat]]
between = ["B", "B"]
gamma = 0.0
range = 1.0
"#;

const EXPONENTS: &str = r#"
title = "thermostat alone, with a square weight, and kernels that reach their range with a slope"
dimensions = 2
species = ["A"]
[density.n]
kernel = "linear"
range = 1.0
[density.m]
kernel = "bell"
range = 0.8
[excess_free_energy]
A = "0.4*n^2 + 0.1*m^3"
[[thermostat]]
gamma = 4.5
range = 1.0
exponent = 2
"#;

/// A fluid with three species and three densities, two of which have the same range: more slopes than are read at once.
const WIDE: &str = r#"
title = "nine slopes"
species = ["A", "B", "C"]
[density.n]
kernel = "quadratic"
range = 1.0
[density.m]
kernel = "wendland-c2"
range = 1.0
[density.k]
kernel = "lucy"
range = 0.8
self = true
[excess_free_energy]
A = "0.3*n^2 + 0.1*m_A*m_C + 0.7*k_B^2"
B = "0.2*n_A*n_B + 0.05*m^2 + 0.4*k_C*n_A"
C = "0.1*n_C^3 + 0.2*k^2"
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

/// A fluid whose densities have a much shorter range than a pair force.
const SHORT: &str = r#"
title = "short densities"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 0.6
[density.m]
kernel = "wendland-c2"
range = 0.5
[excess_free_energy]
A = "0.3*n^2 + 0.1*m_A*m_B"
B = "0.2*n_A*n_B + 0.05*m^2"
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 20.0
range = 1.0
"#;

const THREE: &str = r#"
title = "one species, three densities"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 0.8
[density.m]
kernel = "wendland-c2"
range = 0.8
[density.k]
kernel = "cubic-spline"
range = 0.6
[excess_free_energy]
A = "0.3*n^2*k + 0.1*m^3"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 20.0
range = 1.0
"#;

#[test]
fn every_model_by_every_path_has_the_forces_of_the_plain_engine() {
    for (name, fluid) in fluids() {
        let cutoff = fluid.cutoff();
        let density: f64 = if fluid.dimensions == 3 { 3.0 } else { 5.0 };
        // The density is the highest that every model can evaluate: huggins has a pole.
        for (b, domain) in boxes(fluid.dimensions, 3.1 * cutoff).into_iter().enumerate() {
            let volume = domain.volume(fluid.dimensions) / cutoff.powi(fluid.dimensions as i32);
            let count = (density * volume) as usize;
            let cloud = Cloud::new(domain, fluid.dimensions, fluid.species.len(), count, 7 + b as u64);
            let (force, tally) = plain(&fluid, &cloud);
            for (precision, instructions) in every() {
                let what = format!("{name}, box {b}, {precision}, {instructions}");
                let mut sweep = Sweep::new(&fluid, settings(precision, instructions, 1)).unwrap();
                assert!(sweep.fits(&cloud.domain));
                let (here, totals) = swept(&mut sweep, &cloud, Want::TOTALS);
                let off = difference(&force, &here);
                assert!(off < tolerance(precision), "{what}: {off:.1e}");
                let off = tally_difference(&tally, &totals);
                assert!(off < tolerance(precision), "{what}: totals {off:.1e} {tally:?} {totals:?}");
                let (again, none) = swept(&mut sweep, &cloud, Want::FORCES);
                assert_eq!(here, again, "{what}: forces depend on other requests");
                assert_eq!(none.pair, 0.0);
                let (ghosts, totals) = with_ghosts(&mut sweep, &cloud);
                let off = difference(&force, &ghosts);
                assert!(off < tolerance(precision), "{what}, ghosts: {off:.1e}");
                let off = tally_difference(&tally, &totals);
                assert!(off < tolerance(precision), "{what}, ghosts: totals {off:.1e}");
            }
        }
    }
}

fn shipped(name: &str) -> Fluid {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models");
    Model::open(&folder.join(name)).unwrap().at(1.0).unwrap()
}

fn many() -> Fluid {
    Model::parse("many", MANY).unwrap().at(0.7).unwrap()
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for fluid in [shipped("warren2003-set6.toml"), many(), shipped("van-der-waals-2d.toml")] {
        for domain in boxes(fluid.dimensions, 10.3 * fluid.cutoff()) {
            let cloud = Cloud::new(domain, fluid.dimensions, fluid.species.len(), 1500, 3);
            for (precision, instructions) in every() {
                let mut one = Sweep::new(&fluid, settings(precision, instructions, 1)).unwrap();
                let (force, tally) = swept(&mut one, &cloud, Want::TOTALS);
                for threads in [2, 3, 7, 64] {
                    let mut more = Sweep::new(&fluid, settings(precision, instructions, threads)).unwrap();
                    let (here, totals) = swept(&mut more, &cloud, Want::TOTALS);
                    assert!(
                        force == here && tally == totals,
                        "{precision}, {instructions}, {threads} threads"
                    );
                }
            }
        }
    }
}

#[test]
fn avx512_gives_the_same_bits_with_vbmi2_and_without() {
    for fluid in [shipped("warren2003-set6.toml"), shipped("standard-dpd.toml"), many()] {
        let sets = [Instructions::Avx512, Instructions::Avx512Vbmi2].into_iter().filter(|i| i.available());
        let cloud = Cloud::new(boxes(3, 7.3).remove(0), 3, fluid.species.len(), 1500, 3);
        let forces: Vec<_> = sets
            .map(|i| {
                let mut sweep = Sweep::new(&fluid, settings(Precision::Mixed, i, 1)).unwrap();
                assert_eq!(sweep.settings.instructions, i);
                swept(&mut sweep, &cloud, Want::TOTALS)
            })
            .collect();
        assert!(forces.windows(2).all(|two| two[0] == two[1]));
    }
}

/// Accumulators are reused as a sweep moves through its planes, and slabs of threads begin anywhere:
/// the same sweeps evaluate boxes of few and many planes, full and nearly empty ones.
#[test]
fn any_number_of_layers_and_threads_gives_the_forces_of_the_plain_engine() {
    for fluid in [shipped("warren2003-set6.toml"), shipped("standard-dpd.toml"), many()] {
        let engines = (1..=5)
            .map(|t| Sweep::new(&fluid, settings(Precision::Double, Instructions::best(), t)).unwrap());
        let mut engines: Vec<Sweep> = engines.collect();
        for (n, (planes, periodic)) in
            [2, 9, 3, 12, 4, 7, 5, 6, 8].into_iter().flat_map(|l| [(l, true), (l, false)]).enumerate()
        {
            // A plane is one unit, two or four.
            let columns = [3.0, 10.4, 20.2][n % 3];
            let lengths = [3.0, columns, planes as f64 + 0.3].map(|l| l * fluid.cutoff());
            let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true, n % 4 < 2, periodic]).unwrap();
            let count = (8.0 * columns) as usize * planes;
            let mut cloud = Cloud::new(domain, 3, fluid.species.len(), count, planes as u64);
            for x in &mut cloud.x {
                // The density decreases with height.
                x[2] *= x[2] / lengths[2];
            }
            let (force, tally) = plain(&fluid, &cloud);
            let (first, first_tally) = swept(&mut engines[0], &cloud, Want::TOTALS);
            let off = difference(&force, &first).max(tally_difference(&tally, &first_tally));
            assert!(off < tolerance(Precision::Double), "{planes} planes, periodic {periodic}: {off:.1e}");
            for sweep in &mut engines {
                let (here, totals) = swept(sweep, &cloud, Want::TOTALS);
                assert!(here == first && totals == first_tally, "{planes} planes, {:?}", sweep.settings);
            }
        }
    }
}

/// Without ghosts only the forces and densities of a few planes are summed at a time.
#[test]
fn longer_boxes_have_no_more_accumulators() {
    for (fluid, most) in [(shipped("warren2003-set6.toml"), 120.0), (many(), 200.0)] {
        let memory = |planes: usize| {
            let domain =
                PeriodicBox::orthogonal([0.0; 3], [6.0, 6.0, planes as f64 + 0.1], [true; 3]).unwrap();
            let cloud = Cloud::new(domain, 3, fluid.species.len(), 300 * planes, 5);
            let mut sweep = Sweep::new(&fluid, settings(Precision::Mixed, Instructions::best(), 1)).unwrap();
            swept(&mut sweep, &cloud, Want::FORCES);
            sweep.memory() as f64
        };
        let per_particle = (memory(40) - memory(20)) / (300.0 * 20.0);
        assert!(per_particle < most, "{per_particle} bytes");
    }
}

#[test]
fn the_order_of_particles_matters_to_rounding_alone() {
    let fluid = many();
    let domain = boxes(3, 4.0).remove(0);
    let cloud = Cloud::new(domain.clone(), 3, 2, 800, 5);
    for (precision, instructions) in every() {
        let mut sweep = Sweep::new(&fluid, settings(precision, instructions, 1)).unwrap();
        let (force, tally) = swept(&mut sweep, &cloud, Want::TOTALS);
        let order: Vec<usize> = (0..800).map(|k| k * 397 % 800).collect();
        let shuffled = Cloud {
            domain: domain.clone(),
            x: order.iter().map(|k| cloud.x[*k]).collect(),
            v: order.iter().map(|k| cloud.v[*k]).collect(),
            tag: order.iter().map(|k| cloud.tag[*k]).collect(),
            kind: order.iter().map(|k| cloud.kind[*k]).collect(),
        };
        let (other, totals) = swept(&mut sweep, &shuffled, Want::TOTALS);
        let same: Vec<[f64; 3]> = order.iter().map(|k| force[*k]).collect();
        assert!(difference(&same, &other) < tolerance(precision));
        assert!(tally_difference(&tally, &totals) < tolerance(precision));
        // The returned order contains each of the host's particles once.
        let mut order = sweep.order().to_vec();
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, o)| k as u32 == *o));
    }
}

/// i-clusters have eight particles in sparse columns, and four in others; in some columns there are too
/// few to fill an i-cluster, or they are too far apart to share one.
#[test]
fn rows_with_few_particles_and_with_many() {
    let fluids = [shipped("warren2003-set6.toml"), many(), shipped("van-der-waals-2d.toml")];
    let mut i_cluster_sizes = vec![];
    for fluid in &fluids {
        for density in [0.4, 1.5, 4.0, 5.0, 11.0] {
            for (b, domain) in boxes(fluid.dimensions, 4.3 * fluid.cutoff()).into_iter().enumerate() {
                let volume = domain.volume(fluid.dimensions) / fluid.cutoff().powi(fluid.dimensions as i32);
                let count = (density * volume) as usize;
                let geometry = BoxGeometry::of_box(&domain, fluid.dimensions).unwrap();
                i_cluster_sizes.push(CellGrid::new(&geometry, fluid.cutoff(), count).unwrap().i_cluster_size);
                let cloud = Cloud::new(domain, fluid.dimensions, fluid.species.len(), count, 21 + b as u64);
                let (force, tally) = plain(fluid, &cloud);
                for (precision, instructions) in every() {
                    let mut sweep = Sweep::new(fluid, settings(precision, instructions, 2)).unwrap();
                    let here = swept(&mut sweep, &cloud, Want::TOTALS);
                    for (forces, totals) in [here, with_ghosts(&mut sweep, &cloud)] {
                        let off = difference(&force, &forces).max(tally_difference(&tally, &totals));
                        assert!(
                            off < tolerance(precision),
                            "{density}, {precision}, {instructions}: {off:.1e}"
                        );
                    }
                }
            }
        }
    }
    assert!(i_cluster_sizes.contains(&4) && i_cluster_sizes.contains(&8));
}

/// Tests crowds in which a particle has more neighbours than a block has room for, walls without
/// periods, and particles far from all others.
#[test]
fn crowds_open_sides_and_runaways() {
    let fluid = shipped("warren2003-set6.toml");
    let open = PeriodicBox::orthogonal([0.0; 3], [6.0, 7.0, 8.0], [true, true, false]).unwrap();
    let mut cloud = Cloud::new(open, 3, 1, 700, 9);
    for k in 0..300 {
        cloud.x[k] = [3.0 + 0.001 * (k % 7) as f64, 3.0 + 0.002 * (k % 11) as f64, 4.0 + 1e-4 * k as f64];
    }
    cloud.x[300][2] = 50.0;
    cloud.x[301][2] = -1234.5;
    let (force, tally) = plain(&fluid, &cloud);
    for (precision, instructions) in every() {
        let mut sweep = Sweep::new(&fluid, settings(precision, instructions, 2)).unwrap();
        let (here, totals) = swept(&mut sweep, &cloud, Want::TOTALS);
        let off = difference(&force, &here);
        // Positions are fractions of a region longer than a thousand here.
        let tolerance = if precision == Precision::Mixed { 1e-3 } else { 1e-12 };
        assert!(off < tolerance, "{precision}, {instructions}: {off:.1e}");
        assert!(tally_difference(&tally, &totals) < tolerance);
    }
}

#[test]
fn particles_on_one_point_do_not_push_each_other() {
    let fluid = shipped("warren2003-set6.toml");
    let domain = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
    let mut cloud = Cloud::new(domain, 3, 1, 2, 9);
    cloud.x[1] = cloud.x[0];
    for (precision, instructions) in every() {
        let mut sweep = Sweep::new(&fluid, settings(precision, instructions, 1)).unwrap();
        let (force, _) = swept(&mut sweep, &cloud, Want::TOTALS);
        assert_eq!(force, [[0.0; 3]; 2]);
    }
}

#[test]
fn what_cannot_be_computed_is_named() {
    let fluid = shipped("warren2003-set6.toml");
    let domain = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
    let good = || Cloud::new(domain.clone(), 3, 1, 100, 9);
    for (precision, instructions) in every() {
        let mut sweep = Sweep::new(&fluid, settings(precision, instructions, 2)).unwrap();
        let mut force = vec![[0.0; 3]; 100];
        let open = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [false; 3]).unwrap();
        let open = Around { domain: &open, images: &[] };
        let mut fails = |cloud: &Cloud, domain: Option<&PeriodicBox>| {
            let (particles, v, want) = (cloud.particles(), &cloud.v, Want::FORCES);
            let error = match domain {
                Some(domain) => sweep
                    .evaluate(domain, &Request { particles, v, step: Some(STEP), want }, &mut force, false)
                    .unwrap_err(),
                None => sweep
                    .first(open, &Request { particles, v, step: Some(STEP), want }, &mut force)
                    .unwrap_err(),
            };
            assert!(sweep.second(&particles, &mut force).is_err());
            error
        };
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let mut cloud = good();
            cloud.x[17][1] = bad;
            let tag = cloud.tag[17];
            assert_eq!(fails(&cloud, Some(&domain)), EngineError::Position { tag });
            assert_eq!(fails(&cloud, None), EngineError::Position { tag });
        }
        let mut cloud = good();
        cloud.tag[3] = 0;
        assert_eq!(fails(&cloud, Some(&domain)), EngineError::Tag { tag: 0 });
        let mut cloud = good();
        cloud.kind[5] = 1;
        let tag = cloud.tag[5];
        assert_eq!(fails(&cloud, Some(&domain)), EngineError::Kind { tag, kind: 1 });
        let narrow = PeriodicBox::orthogonal([0.0; 3], [5.0, 1.9, 5.0], [true; 3]).unwrap();
        assert!(matches!(fails(&good(), Some(&narrow)), EngineError::Host(_)));
        assert!(!sweep.fits(&narrow) && sweep.fits(&domain));
        // The sweep still works after errors.
        swept(&mut sweep, &good(), Want::TOTALS);
        let mut cloud = good();
        cloud.v[3] = [f64::NAN; 3];
        cloud.x[4] = cloud.x[3].map(|x| x + 0.01);
        let particles = cloud.particles();
        let error = sweep
            .evaluate(
                &domain,
                &Request { particles, v: &cloud.v, step: Some(STEP), want: Want::FORCES },
                &mut force,
                false,
            )
            .unwrap_err();
        assert!(matches!(error, EngineError::Force { .. }), "{error}");
    }
}

#[test]
fn faults_of_the_passes_name_their_particles() {
    const SINGULAR: &str = "title = \"vdw\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
        [excess_free_energy]\nA = \"-ln(4 - n)\"\n";
    let singular = Model::parse("vdw", SINGULAR).unwrap().at(1.0).unwrap();
    let dpd = shipped("standard-dpd.toml");
    let domain = PeriodicBox::orthogonal([0.0; 3], [5.0, 5.0, 9.0], [true; 3]).unwrap();
    for threads in 1..5 {
        let settings = settings(Precision::Mixed, Instructions::best(), threads);
        let fault = |fluid: &Fluid, cloud: &Cloud| {
            let mut sweep = Sweep::new(fluid, settings).unwrap();
            let particles = cloud.particles();
            let mut force = vec![[0.0; 3]; cloud.x.len()];
            sweep
                .evaluate(
                    &domain,
                    &Request { particles, v: &cloud.v, step: Some(STEP), want: Want::FORCES },
                    &mut force,
                    false,
                )
                .unwrap_err()
        };
        for plane in 0..9 {
            // Ten particles lie almost at one point.
            let mut cloud = Cloud::new(domain.clone(), 3, 1, 30, 4);
            for k in 0..10 {
                cloud.x[k] = [2.0, 2.0 + 0.001 * k as f64, plane as f64 + 0.5];
            }
            let EngineError::ExcessFreeEnergy { tag, .. } = fault(&singular, &cloud) else {
                panic!("no fault")
            };
            assert!(cloud.tag[..10].contains(&tag), "{tag}");
            // Two pairs in two planes each contain a particle without velocity.
            let mut cloud = Cloud::new(domain.clone(), 3, 1, 4, 4);
            for (k, z) in [(0, plane as f64 + 0.5), (2, 8.5 - plane as f64)] {
                cloud.v[k] = [f64::NAN; 3];
                cloud.x[k] = [3.0, 4.0 - k as f64, z];
                cloud.x[k + 1] = cloud.x[k].map(|x| x + 0.01);
            }
            assert_eq!(fault(&dpd, &cloud), EngineError::Force { tag: 1 });
        }
    }
}

#[test]
fn passes_that_a_fluid_does_not_need_are_left_out() {
    let dpd = shipped("standard-dpd.toml");
    let domain = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
    let cloud = Cloud::new(domain, 3, 1, 300, 9);
    let mut sweep = Sweep::new(&dpd, Settings::default()).unwrap();
    swept(&mut sweep, &cloud, Want::FORCES);
    let first = sweep.counts();
    assert_eq!((first.density, first.excess, first.energy, first.virial), (0, 0, 0, 0));
    assert!(first.search > 0 && first.force > 0 && first.noise > 0);
    let particles = cloud.particles();
    let mut force = vec![[0.0; 3]; 300];
    sweep
        .evaluate(
            &cloud.domain,
            &Request { particles, v: &[], step: None, want: Want::TOTALS },
            &mut force,
            false,
        )
        .unwrap();
    let second = sweep.counts();
    assert_eq!((second.search, second.force), (2 * first.search, 2 * first.force));
    // The energy of every batch is summed, and no noise drawn.
    assert_eq!((second.noise, second.energy, second.density), (first.noise, first.noise, 0));

    // A nonlinear ψ takes a pass for its density, and an evaluation.
    let mdpd = shipped("warren2003-set6.toml");
    let mut sweep = Sweep::new(&mdpd, Settings::default()).unwrap();
    swept(&mut sweep, &cloud, Want::FORCES);
    let counts = sweep.counts();
    assert_eq!((counts.density, counts.energy), (counts.noise, 0));
    assert!(counts.density > 0 && counts.excess > 0);
}
