//! Compares pairs with reduced strength, on every path, with a list of all pairs and their factors.

use super::*;
use crate::engine::{Around, Instructions, Mark, Newton, PairsOfHost, Precision};
use std::collections::HashMap;
use std::num::NonZeroUsize;

/// Factors of some pairs that are within the cut-off.
fn factors(cloud: &Cloud) -> HashMap<(usize, usize), f64> {
    let count = cloud.x.len();
    let all = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    let near = all.filter(|&(i, j)| {
        let d = cloud.domain.minimum_image(cloud.x[i], cloud.x[j]);
        d.iter().map(|c| c * c).sum::<f64>() < 1.0
    });
    near.step_by(4).enumerate().map(|(k, pair)| (pair, [0.0, 0.3, 1.7][k % 3])).collect()
}

fn factor(factors: &HashMap<(usize, usize), f64>, i: usize, j: usize) -> f64 {
    factors.get(&(i.min(j), i.max(j))).copied().unwrap_or(1.0)
}

/// The special pairs of particles and ghosts, each of an owned particle with every image of the other.
fn special(factors: &HashMap<(usize, usize), f64>, owned: usize, owner: &[usize]) -> Vec<SpecialPair> {
    let all = (0..owned).flat_map(|i| (i + 1..owner.len()).map(move |j| (i, j)));
    let all =
        all.map(|(i, j)| SpecialPair { i: i as u32, j: j as u32, factor: factor(factors, i, owner[j]) });
    all.filter(|pair| pair.factor != 1.0).collect()
}

#[test]
fn special_pairs_act_as_listed_pairs_with_factors() {
    let want = Want { densities: true, ..Want::TOTALS };
    for fluid in [warren(), two_densities(), two_passes()] {
        let cloud = Cloud::new([4.0, 3.5, 3.1], 260, fluid.species.len() as i32);
        let count = cloud.x.len();
        let factors = factors(&cloud);
        assert!(factors.len() > 300, "{}", factors.len());
        let (all, images) = cloud.with_ghosts([true; 3]);
        let owner: Vec<usize> = (0..all.x.len()).map(|k| images.owner_of(k)).collect();

        let pairs = (0..count).flat_map(|i| (i + 1..all.x.len()).map(move |j| (i, j)));
        let pairs = pairs.map(|(i, j)| (i as i32, j as i32, factor(&factors, i, owner[j])));
        let (mut i, mut j, mut scale) = (vec![], vec![], vec![]);
        for pair in pairs.filter(|pair| pair.2 != 0.0) {
            i.push(pair.0);
            j.push(pair.1);
            scale.push(pair.2);
        }
        let listed = Surroundings::Listed(PairsOfHost { i: &i, j: &j, factor: &scale }, Newton::Off);
        let expected = with_ghosts(&mut engine(&fluid), listed, &all, &images, want);
        // The special pairs change the result.
        let plain = in_box(&mut engine(&fluid), &cloud, want);
        assert!((plain.0.energy() / expected.0.energy() - 1.0).abs() > 1e-3);

        let closed =
            PeriodicBox::orthogonal(cloud.domain.origin(), [4.0, 3.5, 3.1], [true, true, false]).unwrap();
        let is_image: Vec<bool> = (count..all.x.len())
            .map(|k| closed.fraction(all.x[k])[..2].iter().any(|s| !(0.0..1.0).contains(s)))
            .collect();
        let in_hand = special(&factors, count, &owner[..count]);
        let with_images = special(&factors, count, &owner);
        for threads in [1, 3] {
            let threads = NonZeroUsize::new(threads).unwrap();
            for (name, instructions) in Instructions::ALL {
                if !instructions.available() {
                    continue;
                }
                let settings = Settings { precision: Precision::Double, instructions, threads };
                let mut engine = Engine::new(&fluid, settings).unwrap();
                for pair_sums_only in [false, true] {
                    println!("{name}, {threads} threads, reference only: {pair_sums_only}");
                    engine.use_pair_sums_only(pair_sums_only);
                    engine.set_special_pairs(in_hand.iter().copied());
                    agree(&in_box(&mut engine, &cloud, want), &expected);
                    assert_eq!(engine.path() == Some(Path::Sweep), !pair_sums_only && fluid.variables() != 4);
                    let forces = in_box(&mut engine, &cloud, Want::TOTALS);
                    agree(&(forces.0, forces.1, vec![]), &(expected.0, expected.1.clone(), vec![]));
                    engine.set_special_pairs(with_images.iter().copied());
                    for newton in [Newton::On, Newton::Off] {
                        let free = Surroundings::ghosts(newton);
                        agree(&with_ghosts(&mut engine, free, &all, &images, want), &expected);
                        let told =
                            Surroundings::Ghosts(Around { domain: &closed, images: &is_image }, newton);
                        agree(&with_ghosts(&mut engine, told, &all, &images, want), &expected);
                    }
                }
            }
        }
    }
}

/// Subtracting a pair in single precision leaves an error no larger than that of any other pair.
#[test]
fn special_pairs_in_mixed_precision() {
    for fluid in [warren(), two_densities(), two_passes()] {
        let cloud = Cloud::new([4.0, 3.5, 3.1], 260, fluid.species.len() as i32);
        let pairs = special(&factors(&cloud), cloud.x.len(), &(0..cloud.x.len()).collect::<Vec<_>>());
        let mut exact = engine(&fluid);
        let mut mixed =
            Engine::new(&fluid, Settings { precision: Precision::Mixed, ..Settings::default() }).unwrap();
        let [plain, special] = [&[][..], &pairs].map(|pairs| {
            let [exact, mixed] = [&mut exact, &mut mixed].map(|engine| {
                engine.set_special_pairs(pairs.iter().copied());
                let (_, force, _) = in_box(engine, &cloud, Want::TOTALS);
                assert_eq!(engine.path(), Some(Path::Sweep));
                force
            });
            let square = |f: &[[f64; 3]]| f.as_flattened().iter().map(|f| f * f).sum::<f64>();
            let off: Vec<[f64; 3]> =
                exact.iter().zip(&mixed).map(|(a, b)| std::array::from_fn(|c| a[c] - b[c])).collect();
            (square(&off) / square(&exact)).sqrt()
        });
        assert!(special < 2.0 * plain && plain < 1e-6, "{special:e} {plain:e}");
    }
}

#[test]
fn values_of_single_particles_and_densities_see_special_pairs() {
    let fluid = two_densities();
    let cloud = Cloud::new([4.0, 3.5, 3.1], 260, 2);
    let mut engine = engine(&fluid);
    engine.set_special_pairs(special(&factors(&cloud), 260, &(0..260).collect::<Vec<_>>()));
    let (swept, ..) = in_box(&mut engine, &cloud, Want::TOTALS);
    let particles = cloud.request(Want::FORCES).particles;
    let densities = engine.sum_densities(Surroundings::Box(&cloud.domain), &particles).unwrap().to_vec();
    let (tally, _, expected) = in_box(&mut engine, &cloud, Want::ALL);
    assert_eq!(engine.path(), Some(Path::PairSums(Reason::ParticleValues)));
    let energy: f64 = engine.results().particle_energy.iter().sum();
    for energy in [tally.energy(), energy] {
        assert!((energy / swept.energy() - 1.0).abs() < 1e-11, "{energy} {}", swept.energy());
    }
    assert_eq!(densities.len(), expected.len());
    assert!(densities.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-11));
}

#[test]
fn special_pairs_that_make_no_sense_are_refused() {
    let cloud = Cloud::new([4.0, 3.5, 3.1], 260, 1);
    let mut engine = engine(&warren());
    let mut force = vec![[0.0; 3]; 260];
    for (i, j) in [(0, 260), (260, 0), (u32::MAX, u32::MAX)] {
        engine.set_special_pairs([SpecialPair { i, j, factor: 0.5 }]);
        let found = engine.forces(&cloud.domain, &cloud.request(Want::FORCES), &mut force, false);
        assert!(matches!(found, Err(EngineError::Host(_))), "{found:?}");
    }
    engine.set_special_pairs([SpecialPair { i: 0, j: 1, factor: 0.5 }]);
    assert!(engine.forces(&cloud.domain, &cloud.request(Want::ALL), &mut force, false).is_ok());
    let narrow = Cloud::new([4.0, 1.9, 3.1], 260, 1);
    assert!(engine.forces(&narrow.domain, &narrow.request(Want::FORCES), &mut force, false).is_err());
    let listed = Surroundings::Listed(PairsOfHost { i: &[], j: &[], factor: &[] }, Newton::On);
    assert!(engine.first(listed, &cloud.request(Want::FORCES), &mut []).is_err());
    // A special pair with a factor of 1 is an ordinary pair.
    engine.set_special_pairs([SpecialPair { i: 7, j: 300, factor: 1.0 }]);
    assert!(engine.forces(&cloud.domain, &cloud.request(Want::FORCES), &mut force, false).is_ok());
}

/// Marks of types that exclude each other, of molecules without internal pairs, and of molecules that exclude each other.
#[test]
fn marked_particles_act_as_those_of_a_list_without_their_pairs() {
    let want = Want { densities: true, ..Want::TOTALS };
    let fluid = two_passes();
    let cloud = Cloud::new([4.0, 3.5, 3.1], 260, fluid.species.len() as i32);
    let count = cloud.x.len();
    let factors = factors(&cloud);
    let (all, images) = cloud.with_ghosts([true; 3]);
    let owner: Vec<usize> = (0..all.x.len()).map(|k| images.owner_of(k)).collect();
    let by_rule = |k: usize| Mark { sides: [1, 2 | 1 << 16, 1 << 17, 0][k % 4], molecule: 0 };
    let by_molecule = |k: usize| Mark { sides: 0, molecule: (k / 5 % 7) as u32 };
    let rules: [(&dyn Fn(usize) -> Mark, bool); 3] =
        [(&by_rule, false), (&by_molecule, false), (&by_molecule, true)];
    let plain = in_box(&mut engine(&fluid), &cloud, want);
    for (mark, between) in rules {
        let scale = |i: usize, j: usize| match mark(i).excludes(mark(j), between) {
            true => 0.0,
            false => factor(&factors, i, j),
        };
        let pairs = (0..count).flat_map(|i| (i + 1..all.x.len()).map(move |j| (i, j)));
        let pairs: Vec<_> =
            pairs.map(|(i, j)| (i, j, scale(i, owner[j]))).filter(|pair| pair.2 != 0.0).collect();
        let [i, j] = [
            pairs.iter().map(|p| p.0 as i32).collect::<Vec<_>>(),
            pairs.iter().map(|p| p.1 as i32).collect(),
        ];
        let strengths: Vec<f64> = pairs.iter().map(|p| p.2).collect();
        let listed = Surroundings::Listed(PairsOfHost { i: &i, j: &j, factor: &strengths }, Newton::Off);
        let expected = with_ghosts(&mut engine(&fluid), listed, &all, &images, want);
        assert!((plain.0.energy() / expected.0.energy() - 1.0).abs() > 1e-3);
        for (name, instructions) in Instructions::ALL {
            if !instructions.available() {
                continue;
            }
            let threads = NonZeroUsize::new(2).unwrap();
            let mut engine =
                Engine::new(&fluid, Settings { precision: Precision::Double, instructions, threads })
                    .unwrap();
            engine.set_exclusions(owner.iter().map(|k| mark(*k)), between);
            for pair_sums_only in [false, true] {
                println!("{name}, reference only: {pair_sums_only}");
                engine.use_pair_sums_only(pair_sums_only);
                engine.set_special_pairs(special(&factors, count, &owner[..count]));
                agree(&in_box(&mut engine, &cloud, want), &expected);
                engine.set_special_pairs(special(&factors, count, &owner));
                agree(
                    &with_ghosts(&mut engine, Surroundings::ghosts(Newton::Off), &all, &images, want),
                    &expected,
                );
            }
            let too_few = engine.plan().species.len();
            engine.set_exclusions((0..too_few).map(mark), between);
            let mut force = vec![[0.0; 3]; count];
            for pair_sums_only in [false, true] {
                engine.use_pair_sums_only(pair_sums_only);
                assert!(
                    engine.forces(&cloud.domain, &cloud.request(Want::FORCES), &mut force, false).is_err()
                );
            }
        }
    }
}
