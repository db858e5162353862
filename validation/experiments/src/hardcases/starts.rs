//! Starts that are unusual, and boxes.

use super::case::Must::{Refused, Right, RightOrSaid};
use super::case::{Case, Inputs, cube, data};
use crate::shipped::{SET6, STANDARD};

pub fn cases() -> Vec<Case> {
    let set6 = |scene: &str| Inputs::new(SET6, 1.0, scene, 0.005, [200, 400]);
    // Temperatures of few particles need many samples.
    let dpd = |scene: &str| Inputs::new(STANDARD, 1.0, scene, 0.02, [200, 2000]);
    let from_data = |x: &[[f64; 3]]| Inputs {
        data: Some(data(x, 4.2)),
        ..dpd("[initial]\nkind = \"data\"\nfile = \"start.data\"\nvelocities = \"thermal\"\n")
    };
    // On faces, edges and corners of the box, and in its middle.
    let at = |i: usize| if i == 5 { 4.2f64.next_down() } else { i as f64 * 0.84 };
    let faces: Vec<_> = (0..216usize).map(|k| [k % 6, k / 6 % 6, k / 36].map(at)).collect();
    let narrow = Inputs { steps: [200, 12_000], ..dpd(&cube(2.02, 3.0)) };
    let of = |count| set6(&format!("box = 4.0\n[initial]\nkind = \"random\"\ncount = {count}\n"));
    let dense = "random overlapping start at three times the density of the liquid";
    let case = Case::new;
    vec![
        case("coincident particles: every place taken twice", from_data(&twice()), Right(0.06)),
        case("particles exactly on faces, edges and corners", from_data(&faces), Right(0.06)),
        case(dense, set6(&cube(3.0, 18.0)), RightOrSaid(0.1)),
        case("a box barely two cut-offs wide", narrow, Right(0.06)),
        case("a box less than two cut-offs wide", dpd(&cube(1.9, 3.0)), Refused),
        case("a lone particle", of(1), Right(0.06)),
        case("an empty box", of(0), Refused),
    ]
}

/// Every site of a lattice twice: 216 particles on 108 places.
fn twice() -> Vec<[f64; 3]> {
    let place = |site: usize| {
        let [a, b, c] = [site % 6, site / 6 % 6, site / 36];
        [a as f64 * 0.7 + 0.1, b as f64 * 0.7 + 0.1, c as f64 * 1.4 + 0.1]
    };
    (0..216).map(|k| place(k / 2)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two particles at each place, which are 0.7 or more apart, also across the box of 4.2.
    #[test]
    fn places_are_taken_twice() {
        let all = twice();
        assert_eq!(all.len(), 216);
        for (k, a) in all.iter().enumerate() {
            let square = |b: &[f64; 3]| -> f64 {
                (0..3).map(|c| (a[c] - b[c]) - 4.2 * ((a[c] - b[c]) / 4.2).round()).map(|d| d * d).sum()
            };
            let others = all.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, b)| square(b));
            let (same, rest): (Vec<f64>, Vec<f64>) = others.partition(|square| *square < 1e-20);
            let nearest = rest.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
            assert!(same.len() == 1 && (nearest - 0.7).abs() < 1e-9, "{k}: {} {nearest}", same.len());
        }
    }
}
