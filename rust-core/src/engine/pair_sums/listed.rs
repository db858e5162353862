//! Pairs that the host lists, because it knows which particles interact.

use super::pairs::Pairs;
use crate::engine::error::EngineError;
use crate::engine::particles::Particles;
use crate::engine::surroundings::PairsOfHost;

/// Adds the listed pairs within `cutoff` to `pairs`.
///
/// # Errors
/// Fails for arrays of different lengths, and for an index out of range.
pub fn add_listed(
    listed: &PairsOfHost,
    particles: &Particles,
    species: &[i32],
    dimensions: usize,
    cutoff: f64,
    pairs: &mut Pairs,
) -> Result<(), EngineError> {
    let PairsOfHost { i, j, factor } = listed;
    if i.len() != j.len() || (!factor.is_empty() && factor.len() != i.len()) {
        return Err(EngineError::Host("the arrays of a pair list have different lengths"));
    }
    let cutoff_squared = cutoff * cutoff;
    for (k, (i, j)) in i.iter().zip(*j).enumerate() {
        let (i, j) = (*i as usize, *j as usize);
        if i >= particles.owned || j >= particles.x.len() {
            return Err(EngineError::Host("a pair list names a particle that does not exist"));
        }
        if species[i] < 0 || species[j] < 0 {
            continue;
        }
        let (a, b) = (particles.x[i], particles.x[j]);
        let d = std::array::from_fn(|c| if c < dimensions { a[c] - b[c] } else { 0.0 });
        if d.iter().map(|c: &f64| c * c).sum::<f64>() >= cutoff_squared {
            continue;
        }
        pairs.push(i, j, d, particles.tag, species).factor.extend(factor.get(k));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::evaluate::Evaluate;
    use crate::engine::pair_sums::PairSums;
    use crate::engine::{Around, Newton, PeriodicBox, Plan, Request, Surroundings, Tally, Want};
    use crate::model::{ForceLaw, Model, WarrenPair, warren_ab};

    fn model() -> Model {
        let pair = Some(WarrenPair { a: -40.0, b: 25.0, gamma: 18.0, rc: 1.0, rd: 0.75, weight: None });
        warren_ab(&["F".into()], &[pair], 3, ForceLaw::Conservative).unwrap()
    }

    /// Points in a box of length 2, of which the first `owned` are owned.
    fn points() -> Vec<[f64; 3]> {
        (0..60u32)
            .map(|k| [k * 7 % 19, k * 11 % 17, k * 5 % 13].map(|n| n as f64 / 9.0 + 0.01 * (k % 3) as f64))
            .collect()
    }

    fn sums() -> PairSums {
        PairSums::of_plan(Plan::new(&model().at(1.0).unwrap()).unwrap())
    }

    fn request<'a>(particles: &Particles<'a>) -> Request<'a> {
        Request { particles: *particles, v: &[], step: None, want: Want::TOTALS }
    }

    type Forces = (Tally, Vec<[f64; 3]>);

    fn forces(engine: &mut PairSums, particles: &Particles) -> Forces {
        let mut f = vec![[0.0; 3]; particles.x.len()];
        let tally = engine.second(&request(particles), &mut f).unwrap();
        (tally, f)
    }

    fn search(engine: &mut PairSums, particles: &Particles, newton: Newton) {
        let open = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [false; 3]).unwrap();
        let around = Around { domain: &open, images: &[] };
        engine.first(Surroundings::Ghosts(around, newton), &request(particles), &mut []).unwrap();
    }

    fn agree(a: &Forces, b: &Forces) {
        assert!((a.0.energy() - b.0.energy()).abs() < 1e-9);
        for (a, b) in a.1.as_flattened().iter().zip(b.1.as_flattened()) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn all_pairs_listed_are_the_search_and_factors_scale() {
        let mut engine = sums();
        let x = points();
        let tag: Vec<i32> = (1..=60).collect();
        let kind = vec![0; 60];
        for newton in [Newton::On, Newton::Off] {
            // Without ghosts the host has no slopes to copy.
            let particles = Particles { owned: 60, x: &x, tag: &tag, kind: &kind };
            let (i, j): (Vec<i32>, Vec<i32>) = (0..60).flat_map(|i| (0..i).map(move |j| (i, j))).unzip();
            search(&mut engine, &particles, newton);
            let searched = forces(&mut engine, &particles);
            let listed = PairsOfHost { i: &i, j: &j, factor: &[] };
            engine.first(Surroundings::Listed(listed, newton), &request(&particles), &mut []).unwrap();
            agree(&forces(&mut engine, &particles), &searched);
            let ones = vec![1.0; i.len()];
            engine
                .first(
                    Surroundings::Listed(PairsOfHost { factor: &ones, ..listed }, newton),
                    &request(&particles),
                    &mut [],
                )
                .unwrap();
            agree(&forces(&mut engine, &particles), &searched);
            assert!(engine.memory() > 60 * 8);

            // Forces are the gradient of the energy for any factors.
            let factor: Vec<f64> = (0..i.len()).map(|k| [0.0, 0.3, 1.0][k % 3]).collect();
            let listed = PairsOfHost { factor: &factor, ..listed };
            engine.first(Surroundings::Listed(listed, newton), &request(&particles), &mut []).unwrap();
            let (_, f) = forces(&mut engine, &particles);
            for (k, c) in [(3, 0), (20, 1), (59, 2)] {
                let energy = [1e-5, -1e-5].map(|h| {
                    let mut x = x.clone();
                    x[k][c] += h;
                    let moved = Particles { x: &x, ..particles };
                    let mut engine = sums();
                    engine.first(Surroundings::Listed(listed, newton), &request(&moved), &mut []).unwrap();
                    forces(&mut engine, &moved).0.energy()
                });
                let slope = -(energy[0] - energy[1]) / 2e-5;
                assert!((slope - f[k][c]).abs() < 1e-5 * (1.0 + slope.abs()), "{slope} {}", f[k][c]);
            }
        }
    }

    #[test]
    fn single_pairs_add_up_to_the_forces() {
        let mut engine = sums();
        let x = points();
        let (tag, kind): (Vec<i32>, Vec<i32>) = ((1..=60).collect(), vec![0; 60]);
        let particles = Particles { owned: 60, x: &x, tag: &tag, kind: &kind };
        search(&mut engine, &particles, Newton::On);
        let (tally, f) = forces(&mut engine, &particles);
        let mut sum = vec![[0.0; 3]; 60];
        let mut phi = 0.0;
        for i in 0..60 {
            for j in 0..i {
                let d: [f64; 3] = std::array::from_fn(|c| x[i][c] - x[j][c]);
                let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
                let (energy, force) = engine.single([0, 0], r, &engine.slopes, [i, j]);
                phi += energy;
                for (c, d) in d.iter().enumerate() {
                    sum[i][c] += force * d / r;
                    sum[j][c] -= force * d / r;
                }
            }
        }
        agree(&(Tally { excess: 0.0, pair: phi, ..tally }, sum), &(Tally { excess: 0.0, ..tally }, f));
        assert_eq!(engine.single([0, 1], 0.5, &[], [0, 0]), (0.0, 0.0));
        let alone = engine.single([0, 0], 0.5, &[], [0, 0]);
        assert_eq!(alone, engine.single([0, 0], 0.5, &engine.slopes, [3, 400]));
        assert!((alone.1 + 20.0).abs() < 1e-12);
    }

    #[test]
    fn lists_that_make_no_sense_are_refused() {
        let mut engine = sums();
        let mut x = points();
        let (tag, kind): (Vec<i32>, Vec<i32>) = ((1..=60).collect(), vec![0; 60]);
        for (i, j, factor) in [(0, 60, 1.0), (50, 0, 1.0), (-1, 0, 1.0)] {
            let particles = Particles { owned: 50, x: &x, tag: &tag, kind: &kind };
            let listed = PairsOfHost { i: &[i], j: &[j], factor: &[factor] };
            assert!(
                engine
                    .first(Surroundings::Listed(listed, Newton::On), &request(&particles), &mut [])
                    .is_err()
            );
            let uneven = PairsOfHost { factor: &[1.0, 1.0], ..listed };
            assert!(
                engine
                    .first(Surroundings::Listed(uneven, Newton::On), &request(&particles), &mut [])
                    .is_err()
            );
        }
        x[7][1] = f64::NAN;
        let particles = Particles { owned: 60, x: &x, tag: &tag, kind: &kind };
        let error = engine
            .first(
                Surroundings::Listed(PairsOfHost { i: &[], j: &[], factor: &[] }, Newton::On),
                &request(&particles),
                &mut [],
            )
            .unwrap_err();
        assert_eq!(error, EngineError::Position { tag: 8 });
    }
}
