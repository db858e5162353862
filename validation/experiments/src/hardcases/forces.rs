//! Forces of configurations in which digits are lost, against the reference.

use super::case::{Case, Inputs, Must, data};
use crate::models::{SET6, STANDARD};

pub fn cases() -> Vec<Case> {
    let scene = "[initial]\nkind = \"data\"\nfile = \"start.data\"\nvelocities = \"zero\"\n";
    let case = |name, model: &str, x: &[[f64; 3]], edge: f64| {
        let run = Inputs { data: Some(data(x, edge)), ..Inputs::new(model, 1.0, scene, 0.01, [1, 1]) };
        Case::new(name, run, Must::Agrees(1e-11))
    };
    // Close pairs: distances of 1e-3 down to 1e-6 of the box.
    let close: Vec<[f64; 3]> = (0..200usize)
        .map(|k| {
            let site = k / 2;
            let shift = if k % 2 == 1 { 5e-3 / 10f64.powi((site % 4) as i32) } else { 0.0 };
            [site % 5, site / 5 % 5, site / 25].map(|i| i as f64 + 0.25 + shift)
        })
        .collect();
    // Pairs whose distance is the range, a little less and a little more.
    let ranges: Vec<[f64; 3]> = (0..200usize)
        .map(|k| {
            let site = k / 2;
            let place = [site % 5, site / 5 % 5, site / 25].map(|i| i as f64 * 2.4);
            let across = [1.0, 1.0 - 1e-7, 1.0 + 1e-7, 0.75][site % 4];
            if k % 2 == 1 { [place[0] + across, place[1], place[2]] } else { place }
        })
        .collect();
    vec![
        case("differences that cancel: close pairs, pair force", STANDARD, &close, 5.0),
        case("differences that cancel: close pairs, many-body force", SET6, &close, 5.0),
        case("pairs at the range and beside it", SET6, &ranges, 12.0),
    ]
}
