//! How many pairs a step meets: what the cost of forces is proportional to.

use psidpd_core::engine::pair_sums::for_each_pair;
use psidpd_core::model::Fluid;
use psidpd_dynamics::run::State;

/// Pairs closer than the longest range of their two species, per particle.
pub fn pairs_per_particle(state: &State, fluid: &Fluid) -> f64 {
    let mut pairs = 0u64;
    for_each_pair(&state.x, &state.domain, 3, fluid.cutoff(), |pair| {
        let [a, b] = [pair.i, pair.j].map(|k| state.species[k] as usize);
        pairs += u64::from(pair.r < fluid.conservative_range_between(a, b));
    });
    pairs as f64 / state.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::{DPD, FORMULA, MDPD, MIXTURES, Subject};
    use crate::start::{Filling, SEED, kept, random};

    /// A temperature of 1200 and more degrees of freedom varies by 0.04: five times that is met once in 10⁶
    /// runs. The number of pairs shows whether the liquid fell apart or collapsed.
    #[test]
    fn fluids_are_in_equilibrium() {
        let folder = tempfile::tempdir().unwrap();
        for subject in [MDPD, DPD, FORMULA] {
            let state = kept(&subject, 900, folder.path()).unwrap().state;
            let temperature =
                state.v.iter().flatten().map(|v| v * v).sum::<f64>() / (3 * state.len() - 3) as f64;
            assert!((temperature - 1.0).abs() < 0.2, "{}: {temperature}", subject.name);
            let pairs = pairs_per_particle(&state, &fluid(&subject));
            let ideal = 2.0 / 3.0 * std::f64::consts::PI * subject.density;
            assert!((0.7..1.2).contains(&(pairs / ideal)), "{}: {pairs} of {ideal}", subject.name);
        }
    }

    fn fluid(subject: &Subject) -> Fluid {
        subject.model().unwrap().at(1.0).unwrap()
    }

    /// By all pairs; species alternate, so that a fluid with two has as many of each, unless one is rare.
    #[test]
    fn pairs_are_counted() {
        let state = random(&FORMULA, Filling::of_size(400).unwrap(), SEED).unwrap();
        assert_eq!(state.species.iter().filter(|s| **s == 1).count(), 200);
        let edge = state.domain.lengths()[0];
        let near = |a: &[f64; 3], b: &[f64; 3]| {
            let nearest = |d: f64| (d - edge * (d / edge).round()).powi(2);
            (0..3).map(|k| nearest(a[k] - b[k])).sum::<f64>() < 1.0
        };
        let all = (0..400).map(|i| (0..i).filter(|j| near(&state.x[i], &state.x[*j])).count()).sum::<usize>();
        assert_eq!(pairs_per_particle(&state, &fluid(&FORMULA)), all as f64 / 400.0);
        let state = random(&MIXTURES[1], Filling::of_size(400).unwrap(), SEED).unwrap();
        let count = state.len();
        assert_eq!(state.species.iter().filter(|s| **s == 1).count(), count.div_ceil(10));
        let ranges = [[1.0, 1.5], [1.5, 2.0]];
        let near = |i: usize, j: usize| {
            let nearest = |d: f64| (d - edge * (d / edge).round()).powi(2);
            let square = (0..3).map(|k| nearest(state.x[i][k] - state.x[j][k])).sum::<f64>();
            square.sqrt() < ranges[state.species[i] as usize][state.species[j] as usize]
        };
        let all = (0..count).map(|i| (0..i).filter(|j| near(i, *j)).count()).sum::<usize>();
        assert_eq!(pairs_per_particle(&state, &fluid(&MIXTURES[1])), all as f64 / count as f64);
    }
}
