//! How many pairs a step meets: what the cost of forces is proportional to.

use psidpd_core::engine::pair_sums::for_each_pair;
use psidpd_dynamics::run::State;

pub fn pairs_per_particle(state: &State, range: f64) -> f64 {
    let mut pairs = 0u64;
    for_each_pair(&state.x, &state.domain, 3, range, |_| pairs += 1);
    pairs as f64 / state.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::{DPD, FORMULA, MDPD};
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
            let pairs = pairs_per_particle(&state, 1.0);
            let ideal = 2.0 / 3.0 * std::f64::consts::PI * subject.density;
            assert!((0.7..1.2).contains(&(pairs / ideal)), "{}: {pairs} of {ideal}", subject.name);
        }
    }

    /// By all pairs; species alternate, so that a fluid with two has as many of each.
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
        assert_eq!(pairs_per_particle(&state, 1.0), all as f64 / 400.0);
    }
}
