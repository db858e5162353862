//! Starts that are unusual, and boxes.

use super::case::{Case, Inputs, Must, data};
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
    let mut twice = Vec::new();
    for k in 0..216usize {
        let site = k / 2;
        let [a, b, c] = [site % 6, site / 6 % 6, site / 36];
        twice.push([a as f64 * 0.7 + 0.1, b as f64 * 0.7 + 0.1, c as f64 * 1.4 + 0.1]);
    }
    // On faces, edges and corners of the box, and in its middle.
    let mut faces = Vec::new();
    for k in 0..216usize {
        let [a, b, c] = [k % 6, k / 6 % 6, k / 36];
        let at = |i: usize| if i == 5 { 4.2f64.next_down() } else { i as f64 * 0.84 };
        faces.push([at(a), at(b), at(c)]);
    }
    vec![
        Case::new("coincident particles: every place taken twice", from_data(&twice), Must::Right(0.06)),
        Case::new("particles exactly on faces, edges and corners", from_data(&faces), Must::Right(0.06)),
        Case::new(
            "random overlapping start at three times the density of the liquid",
            set6("box = 3.0\ndensity = 18.0\n"),
            Must::RightOrSaid(0.1),
        ),
        Case::new(
            "a box barely two cut-offs wide",
            Inputs { steps: [200, 12_000], ..dpd("box = 2.02\ndensity = 3.0\n") },
            Must::Right(0.06),
        ),
        Case::new("a box less than two cut-offs wide", dpd("box = 1.9\ndensity = 3.0\n"), Must::Refused),
        Case::new(
            "a lone particle",
            set6("box = 4.0\n[initial]\nkind = \"random\"\ncount = 1\n"),
            Must::Right(0.06),
        ),
        Case::new(
            "an empty box",
            set6("box = 4.0\n[initial]\nkind = \"random\"\ncount = 0\n"),
            Must::Refused,
        ),
    ]
}
