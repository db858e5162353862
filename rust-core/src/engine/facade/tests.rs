//! Tests the choice of the path, and that all paths give the same results.

mod special;

use super::*;
use crate::engine::{Around, Images, Newton, PairsOfHost, Precision, Step};
use crate::model::{ForceLaw, Model, WarrenPair, warren_ab};
use psidpd_passes::noise::threefry2x32;

/// A fluid whose ψ is not linear in its only density.
fn warren() -> Fluid {
    let pair = Some(WarrenPair { a: -40.0, b: 25.0, gamma: 18.0, rc: 1.0, rd: 0.75, weight: None });
    warren_ab(&["F".into()], &[pair], 3, ForceLaw::Conservative).unwrap().at(1.0).unwrap()
}

/// A fluid whose ψ is linear in m, which needs no pass.
fn two_densities() -> Fluid {
    let text = "title = \"two\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
        [density.m]\nkernel = \"lucy\"\nrange = 1.0\nself = true\n[excess_free_energy]\nA = \"n^2 + m_B\"\n\
        B = \"n*n_A - 2*m\"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
    Model::parse("two", text).unwrap().at(1.0).unwrap()
}

/// A fluid whose forces need both densities, one with a self term.
fn two_passes() -> Fluid {
    let text = "title = \"two\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
        [density.m]\nkernel = \"lucy\"\nrange = 1.0\nself = true\n[excess_free_energy]\nA = \"n^2 + m^2\"\n";
    Model::parse("passes", text).unwrap().at(1.0).unwrap()
}

struct Cloud {
    pub domain: PeriodicBox,
    pub x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
}

const STEP: Step = Step { seed: 3, number: 5, dt: 0.01 };

impl Cloud {
    fn new(lengths: [f64; 3], count: u32, species: i32) -> Cloud {
        let domain = PeriodicBox::orthogonal([-1.0, 0.5, 2.0], lengths, [true; 3]).unwrap();
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0;
        Cloud {
            x: (0..count).map(|k| domain.point([0, 1, 2].map(|c| uniform(6 * k + c)))).collect(),
            v: (0..count).map(|k| [3, 4, 5].map(|c| uniform(6 * k + c) - 0.5)).collect(),
            tag: (1..=count as i32).collect(),
            kind: (0..count as i32).map(|k| k % species).collect(),
            domain,
        }
    }

    fn request(&self, want: Want) -> Request<'_> {
        let particles = Particles { owned: self.x.len(), x: &self.x, tag: &self.tag, kind: &self.kind };
        Request { particles, v: &self.v, step: Some(STEP), want }
    }

    /// Adds images along `along` as ghosts; returns the owners of the ghosts too.
    fn with_ghosts(&self, along: [bool; 3]) -> (Cloud, Images) {
        let lengths = self.domain.lengths();
        let domain = PeriodicBox::orthogonal(self.domain.origin(), lengths, along).unwrap();
        let mut all = Cloud {
            domain,
            x: self.x.clone(),
            v: self.v.clone(),
            tag: self.tag.clone(),
            kind: self.kind.clone(),
        };
        let mut images = Images::default();
        images.build(&all.domain, 3, 1.0, self.x.len(), &mut all.x);
        images.forward(1, &mut all.v);
        images.forward(1, &mut all.tag);
        images.forward(1, &mut all.kind);
        (all, images)
    }
}

fn engine(fluid: &Fluid) -> Engine {
    Engine::new(fluid, Settings { precision: Precision::Double, ..Settings::default() }).unwrap()
}

type Outcome = (Tally, Vec<[f64; 3]>, Vec<f64>);

fn in_box(engine: &mut Engine, cloud: &Cloud, want: Want) -> Outcome {
    let mut force = vec![[7.0; 3]; cloud.x.len()];
    let tally = engine.forces(&cloud.domain, &cloud.request(want), &mut force, false).unwrap();
    (tally, force, engine.results().densities.to_vec())
}

/// Runs both halves; copies slopes to ghosts and, if ghosts get forces, returns these to the owners.
fn with_ghosts(
    engine: &mut Engine,
    surroundings: Surroundings,
    all: &Cloud,
    images: &Images,
    want: Want,
) -> Outcome {
    let owned = all.x.len() - images.ghosts();
    let request = all.request(want);
    let request = Request { particles: Particles { owned, ..request.particles }, ..request };
    let mut force = vec![[0.0; 3]; all.x.len()];
    let mut pending = engine.first(surroundings, &request, &mut force).unwrap();
    let width = engine.plan().slope_width();
    let mut slopes = pending.slopes_mut()[..owned * width].to_vec();
    images.forward(width, &mut slopes);
    pending.slopes_mut().copy_from_slice(&slopes);
    let tally = pending.finish(engine, &request, &mut force).unwrap();
    images.reverse(&mut force);
    force.truncate(owned);
    (tally, force, engine.results().densities.to_vec())
}

fn agree(a: &Outcome, b: &Outcome) {
    let close =
        |a: f64, b: f64, what: &str| assert!((a - b).abs() < 1e-8 * (100.0 + b.abs()), "{what}: {a} {b}");
    close(a.0.energy(), b.0.energy(), "energy");
    for k in 0..6 {
        close(a.0.virial[k], b.0.virial[k], "virial");
        close(a.0.thermostat_virial[k], b.0.thermostat_virial[k], "thermostat virial");
        close(a.0.drag_virial[k], b.0.drag_virial[k], "drag virial");
    }
    assert_eq!((a.1.len(), a.2.len()), (b.1.len(), b.2.len()));
    a.1.as_flattened().iter().zip(b.1.as_flattened()).for_each(|(a, b)| close(*a, *b, "force"));
    a.2.iter().zip(&b.2).for_each(|(a, b)| close(*a, *b, "density"));
}

/// The request of one evaluation does not affect the next.
#[test]
fn every_evaluation_chooses_anew() {
    let totals = Want::TOTALS;
    let particles = Want { particle_virial: true, ..totals };
    let densities = Want { densities: true, ..totals };
    let (wide, narrow) = ([4.0, 3.5, 3.1], [4.0, 1.9, 3.1]);
    let swept = Path::Sweep;
    let plain = Path::PairSums;
    for (fluid, summed) in [(warren(), swept), (two_densities(), plain(Reason::Densities))] {
        let mut engine = engine(&fluid);
        assert_eq!(engine.path(), None);
        let species = fluid.species.len() as i32;
        let cases = [
            (wide, totals, swept),
            (wide, particles, plain(Reason::ParticleValues)),
            (wide, totals, swept),
            (wide, densities, summed),
            (wide, Want::FORCES, swept),
            (narrow, totals, plain(Reason::Box)),
            (wide, totals, swept),
        ];
        for (lengths, want, path) in cases {
            let cloud = Cloud::new(lengths, 250, species);
            assert_eq!(engine.path_for(Surroundings::Box(&cloud.domain), want), path);
            let before = engine.sweep.sweep.counts().force;
            let found = in_box(&mut engine, &cloud, want);
            assert_eq!(engine.path(), Some(path));
            assert_eq!(engine.sweep.sweep.counts().force > before, path == swept, "{path}");
            assert_eq!(engine.results().order.is_some(), path == swept);
            engine.use_pair_sums_only(true);
            let mut expected = in_box(&mut engine, &cloud, want);
            assert_eq!(engine.path(), Some(plain(Reason::Asked)));
            engine.use_pair_sums_only(false);
            if !want.energy {
                continue;
            }
            if path == swept && !want.densities {
                assert!(found.2.is_empty());
                expected.2.clear();
            }
            agree(&found, &expected);
        }
    }
    assert_eq!(Path::Sweep.to_string(), "cell sweep");
    let text = plain(Reason::ListedPairs).to_string();
    assert_eq!(text, "sums over pairs one by one, because the host lists the pairs");
}

#[test]
fn energies_and_virials_of_particles_add_up() {
    for (fluid, lengths) in [(warren(), [4.0, 3.5, 3.1]), (two_densities(), [1.2, 0.9, 3.0])] {
        let cloud = Cloud::new(lengths, 120, fluid.species.len() as i32);
        let mut engine = engine(&fluid);
        let (tally, _, densities) = in_box(&mut engine, &cloud, Want::ALL);
        assert_eq!(densities.len(), 120 * fluid.variables());
        assert_eq!(
            (engine.results().particle_energy.len(), engine.results().particle_virial.len()),
            (120, 120)
        );
        let energy: f64 = engine.results().particle_energy.iter().sum();
        assert!((energy - tally.energy()).abs() < 1e-9 * (1.0 + energy.abs()));
        for k in 0..6 {
            let sum: f64 = engine.results().particle_virial.iter().map(|w| w[k]).sum();
            assert!((sum - tally.total_virial()[k]).abs() < 1e-8 * (100.0 + sum.abs()));
        }
    }
}

/// Tests ghosts with and without images along closed directions, in boxes that do and do not fit a sweep, and listed pairs.
#[test]
fn all_surroundings_give_the_same_forces() {
    for fluid in [warren(), two_densities(), two_passes()] {
        for lengths in [[4.0, 3.5, 3.1], [4.0, 1.3, 3.1]] {
            let cloud = Cloud::new(lengths, 200, fluid.species.len() as i32);
            let mut engine = engine(&fluid);
            let want = Want { densities: true, ..Want::TOTALS };
            let expected = in_box(&mut engine, &cloud, want);
            let forces = (expected.0, expected.1.clone(), Vec::new());
            let (all, images) = cloud.with_ghosts([true; 3]);
            let origin = cloud.domain.origin();
            let closed = PeriodicBox::orthogonal(origin, lengths, [true, true, false]).unwrap();
            // Ghosts along z only are no images along x and y.
            let (along_z, images_along_z) = cloud.with_ghosts([false, false, true]);
            let is_image: Vec<bool> = (cloud.x.len()..all.x.len())
                .map(|k| {
                    let s = closed.fraction(all.x[k]);
                    s[..2].iter().any(|s| !(0.0..1.0).contains(s))
                })
                .collect();
            for pair_sums_only in [false, true] {
                engine.use_pair_sums_only(pair_sums_only);
                for newton in [Newton::On, Newton::Off] {
                    let free = Surroundings::ghosts(newton);
                    agree(&with_ghosts(&mut engine, free, &all, &images, want), &expected);
                    let found = with_ghosts(&mut engine, free, &all, &images, Want::TOTALS);
                    let swept = engine.path() == Some(Path::Sweep);
                    assert_eq!(swept, !pair_sums_only);
                    if swept {
                        agree(&found, &forces);
                    }
                    let told = Around { domain: &closed, images: &is_image };
                    agree(
                        &with_ghosts(&mut engine, Surroundings::Ghosts(told, newton), &all, &images, want),
                        &expected,
                    );
                    let none = Around { domain: &closed, images: &[] };
                    let surroundings = Surroundings::Ghosts(none, newton);
                    agree(
                        &with_ghosts(&mut engine, surroundings, &along_z, &images_along_z, want),
                        &expected,
                    );
                    // If forces on ghosts return to their owners half of the pairs with ghosts are redundant, but harmless.
                    let (i, j): (Vec<i32>, Vec<i32>) = (0..cloud.x.len() as i32)
                        .flat_map(|i| (i + 1..all.x.len() as i32).map(move |j| (i, j)))
                        .unzip();
                    let listed = Surroundings::Listed(PairsOfHost { i: &i, j: &j, factor: &[] }, newton);
                    agree(&with_ghosts(&mut engine, listed, &all, &images, want), &expected);
                    assert_eq!(engine.path(), Some(Path::PairSums(Reason::ListedPairs)));
                }
            }
        }
    }
}

/// A first half is of one evaluation of one engine.
#[test]
fn a_first_half_is_finished_by_its_own_evaluation_only() {
    let cloud = Cloud::new([4.0, 3.5, 3.1], 200, 1);
    let request = cloud.request(Want::FORCES);
    let mut force = vec![[0.0; 3]; 200];
    for pair_sums_only in [false, true] {
        let mut engines = [0, 1].map(|_| engine(&warren()));
        engines.iter_mut().for_each(|engine| engine.use_pair_sums_only(pair_sums_only));
        let [one, other] = &mut engines;
        let domain = Surroundings::Box(&cloud.domain);
        let [late, foreign, good] = [(); 3].map(|()| one.first(domain, &request, &mut force).unwrap());
        assert!(late.finish(one, &request, &mut force).is_err());
        assert!(foreign.finish(other, &request, &mut force).is_err());
        assert!(good.finish(one, &request, &mut force).is_ok());
        let stale = one.first(domain, &request, &mut force).unwrap();
        in_box(one, &cloud, Want::ALL);
        assert!(stale.finish(one, &request, &mut force).is_err());
        // Values of particles that a later evaluation was not asked for are gone.
        in_box(one, &cloud, Want::FORCES);
        assert!(one.results().particle_energy.is_empty() && one.results().particle_virial.is_empty());
    }
}

/// Densities that the request did not include can be computed afterwards, and change nothing.
#[test]
fn densities_can_be_asked_for_afterwards() {
    for fluid in [warren(), two_densities(), two_passes()] {
        let cloud = Cloud::new([4.0, 3.5, 3.1], 200, fluid.species.len() as i32);
        let mut engine = engine(&fluid);
        let (_, _, expected) = in_box(&mut engine, &cloud, Want { densities: true, ..Want::TOTALS });
        for pair_sums_only in [false, true] {
            engine.use_pair_sums_only(pair_sums_only);
            let (_, forces, _) = in_box(&mut engine, &cloud, Want::FORCES);
            let path = engine.path();
            let excess = engine.excess().to_vec();
            let particles = cloud.request(Want::FORCES).particles;
            let found = engine.sum_densities(Surroundings::Box(&cloud.domain), &particles).unwrap();
            assert_eq!(found.len(), expected.len());
            for (a, b) in found.iter().zip(&expected) {
                assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
            }
            assert_eq!(engine.path(), path);
            assert_eq!(engine.excess(), excess);
            assert_eq!(in_box(&mut engine, &cloud, Want::FORCES).1, forces);
        }
    }
}

/// A notebook passes no tags and no velocities, and positions outside the box.
#[test]
fn a_configuration_is_evaluated_at_a_stroke() {
    let fluid = two_densities();
    for lengths in [[4.0, 3.5, 3.1], [1.1, 3.5, 0.7]] {
        let cloud = Cloud::new(lengths, 90, 2);
        let mut engine = engine(&fluid);
        let species: Vec<usize> = cloud.kind.iter().map(|k| *k as usize).collect();
        let truth = crate::truth::conservative(&fluid, &cloud.x, &species, &cloud.domain).unwrap();
        let mut x = cloud.x.clone();
        for (k, x) in x.iter_mut().enumerate() {
            (0..3).for_each(|c| x[c] += lengths[c] * ((k + c) % 3) as f64 - lengths[c]);
        }
        let found = engine.evaluate(&x, &cloud.domain, &cloud.kind).unwrap();
        assert!((found.energy - truth.energy).abs() < 1e-9 * (1.0 + truth.energy.abs()));
        for (a, b) in found.forces.as_flattened().iter().zip(truth.forces.as_flattened()) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
        for (a, b) in found.virial.iter().zip(truth.virial) {
            assert!((a - b).abs() < 1e-8 * (1.0 + b.abs()), "{a} {b}");
        }
        for (a, b) in found.densities.iter().zip(&truth.densities) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert!(engine.evaluate(&x, &cloud.domain, &cloud.kind[1..]).is_err());
    }
}

/// Time that long pairs take is that of finding pairs and their forces.
#[test]
fn the_time_of_long_pairs_is_that_of_pairs() {
    let text = "title = \"m\"\nspecies = [\"S\", \"B\"]\n[[pair]]\nbetween = [\"S\", \"S\"]\nform = \"soft\"\nstrength = 25.0\n\
        range = 1.0\n[[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 9.0\nrange = 2.5\n\
        [[pair]]\nbetween = [\"S\", \"B\"]\nform = \"soft\"\nstrength = 9.0\nrange = 1.7\n";
    let fluid = Model::parse("m", text).unwrap().at(1.0).unwrap();
    for every in [2, 50] {
        let mut cloud = Cloud::new([9.0; 3], 2000, 1);
        cloud.kind = (1..=2000).map(|k| i32::from(k % every == 0)).collect();
        let mut engine = Engine::new(&fluid, Settings::default()).unwrap();
        engine.evaluate(&cloud.x, &cloud.domain, &cloud.kind).unwrap();
        let (all, of_sweep) = (engine.statistics().times, engine.sweep.sweep.times());
        assert_eq!(engine.potentials_apart() > 0, every == 50);
        assert_eq!(all.first > of_sweep.first, every == 50, "{all:?} {of_sweep:?}");
        assert_eq!(Times { first: of_sweep.first, ..all }, of_sweep);
    }
}
