//! Starts that are unusual, and boxes.

use super::case::Must::{Refused, Right, RightOrSaid};
use super::case::{Case, Inputs, cube, data};
use crate::models::{SET6, STANDARD};

pub fn cases() -> Vec<Case> {
    let set6 = |scene: &str| Inputs::new(SET6, 1.0, scene, 0.005, [200, 400]);
    // Temperatures of few particles need many samples.
    let dpd = |scene: &str| Inputs::new(STANDARD, 1.0, scene, 0.02, [200, 2000]);
    let from_data = |x: &[[f64; 3]]| Inputs {
        data: Some(data(x, 4.2)),
        ..dpd("[initial]\nkind = \"data\"\nfile = \"start.data\"\nvelocities = \"thermal\"\n")
    };
    // Every site of a lattice twice: 216 particles on 108 places.
    let twice = (0..216usize).map(|k| k / 2).map(|site| {
        let [a, b, c] = [site % 6, site / 6 % 6, site / 36];
        [a as f64 * 0.7 + 0.1, b as f64 * 0.7 + 0.1, c as f64 * 1.4 + 0.1]
    });
    let twice: Vec<[f64; 3]> = twice.collect();
    // On faces, edges and corners of the box, and in its middle.
    let at = |i: usize| if i == 5 { 4.2f64.next_down() } else { i as f64 * 0.84 };
    let faces: Vec<_> = (0..216usize).map(|k| [k % 6, k / 6 % 6, k / 36].map(at)).collect();
    let narrow = Inputs { steps: [200, 12_000], ..dpd(&cube(2.02, 3.0)) };
    let of = |count| set6(&format!("box = 4.0\n[initial]\nkind = \"random\"\ncount = {count}\n"));
    let dense = "random overlapping start at three times the density of the liquid";
    let case = Case::new;
    vec![
        case("coincident particles: every place taken twice", from_data(&twice), Right(0.06)),
        case("particles exactly on faces, edges and corners", from_data(&faces), Right(0.06)),
        case(dense, set6(&cube(3.0, 18.0)), RightOrSaid(0.1)),
        case("a box barely two cut-offs wide", narrow, Right(0.06)),
        case("a box less than two cut-offs wide", dpd(&cube(1.9, 3.0)), Refused),
        case("a lone particle", of(1), Right(0.06)),
        case("an empty box", of(0), Refused),
    ]
}
