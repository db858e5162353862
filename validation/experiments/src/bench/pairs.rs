//! How many pairs a step meets: what the cost of forces is proportional to.

use psidpd_dynamics::run::State;

pub fn pairs_per_particle(state: &State, range: f64) -> f64 {
    let lengths = state.domain.lengths();
    // At least three cells in each direction, or a neighbour would be met twice.
    let cells = lengths.map(|l| (l / range).floor().max(3.0) as usize);
    let cell_of = |x: &[f64; 3]| -> [usize; 3] {
        let s = state.domain.fraction(*x);
        std::array::from_fn(|k| ((s[k].rem_euclid(1.0) * cells[k] as f64) as usize).min(cells[k] - 1))
    };
    let index = |c: [usize; 3]| (c[2] * cells[1] + c[1]) * cells[0] + c[0];
    let mut members = vec![Vec::new(); cells.iter().product()];
    for (k, x) in state.x.iter().enumerate() {
        members[index(cell_of(x))].push(k);
    }
    let mut pairs = 0u64;
    for (i, x) in state.x.iter().enumerate() {
        let here = cell_of(x);
        for shift in 0..27 {
            let offset = [shift % 3, shift / 3 % 3, shift / 9];
            let there = std::array::from_fn(|k| (here[k] + offset[k] + cells[k] - 1) % cells[k]);
            for &j in &members[index(there)] {
                let square: f64 = (0..3)
                    .map(|k| {
                        let d = state.x[j][k] - x[k];
                        (d - lengths[k] * (d / lengths[k]).round()).powi(2)
                    })
                    .sum();
                pairs += u64::from(j > i && square < range * range);
            }
        }
    }
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
