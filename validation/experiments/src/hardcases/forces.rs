//! Forces of configurations in which digits are lost, against the reference.

use super::case::{Case, Inputs, Must, data};
use crate::shipped::{SET6, STANDARD};

pub fn cases() -> Vec<Case> {
    let scene = "[initial]\nkind = \"data\"\nfile = \"start.data\"\nvelocities = \"zero\"\n";
    let (close, ranges) = (close(), ranges());
    let case = |name, model: &str, x: &[[f64; 3]], edge: f64| {
        let run = Inputs { data: Some(data(x, edge)), ..Inputs::new(model, 1.0, scene, 0.01, [1, 1]) };
        Case::new(name, run, Must::Agrees(1e-11))
    };
    vec![
        case("differences that cancel: close pairs, pair force", STANDARD, &close, 5.0),
        case("differences that cancel: close pairs, many-body force", SET6, &close, 5.0),
        case("pairs at the range and beside it", SET6, &ranges, 12.0),
    ]
}

/// Close pairs: distances of 1e-3 of the box, along each axis, down to 1e-6.
fn close() -> Vec<[f64; 3]> {
    let place = |k: usize| {
        let site = k / 2;
        let shift = if k % 2 == 1 { 5e-3 / 10f64.powi((site % 4) as i32) } else { 0.0 };
        [site % 5, site / 5 % 5, site / 25].map(|i| i as f64 + 0.25 + shift)
    };
    (0..200).map(place).collect()
}

/// Pairs whose distance is the range, a little less and a little more.
fn ranges() -> Vec<[f64; 3]> {
    let place = |k: usize| {
        let site = k / 2;
        let place = [site % 5, site / 5 % 5, site / 25].map(|i| i as f64 * 2.4);
        let across = [1.0, 1.0 - 1e-7, 1.0 + 1e-7, 0.75][site % 4];
        if k % 2 == 1 { [place[0] + across, place[1], place[2]] } else { place }
    };
    (0..200).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::PeriodicBox;
    use psidpd_core::engine::pair_sums::for_each_pair;

    /// The distances below `limit`, each from the number of pairs that have it.
    fn distances(x: &[[f64; 3]], edge: f64, limit: f64) -> Vec<(f64, usize)> {
        let domain = PeriodicBox::orthogonal([0.0; 3], [edge; 3], [true; 3]).unwrap();
        let mut all = Vec::new();
        for_each_pair(x, &domain, 3, limit, |pair| all.push(pair.r));
        all.sort_by(f64::total_cmp);
        all.chunk_by(|a, b| b - a < 1e-9).map(|same| (same[0], same.len())).collect()
    }

    #[test]
    fn configurations_are_what_they_are_called() {
        let near = |found: &[(f64, usize)], expected: &[(f64, usize)]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found.0 / expected.0 - 1.0).abs() < 1e-7 && found.1 == expected.1,
                    "{found:?} {expected:?}"
                );
            }
        };
        // A quarter of a hundred sites each; diagonals of cubes.
        let diagonal = 3f64.sqrt();
        let steps = [5e-6, 5e-5, 5e-4, 5e-3].map(|d| (diagonal * d, 25));
        near(&distances(&close(), 5.0, 0.1), &steps);
        let around = [(0.75, 25), (1.0 - 1e-7, 25), (1.0, 25), (1.0 + 1e-7, 25)];
        near(&distances(&ranges(), 12.0, 1.1), &around);
    }
}
