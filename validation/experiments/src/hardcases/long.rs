//! Long runs: momentum, and energy without thermostat.

use super::case::{Case, Inputs, Must};
use crate::models::SET6;

const GROUP: &str = "long runs";

pub fn cases(full: bool) -> Vec<Case> {
    let steps = if full { 1_000_000 } else { 2_000 };
    let run = |dt: f64, scene: &str| Inputs {
        model: SET6.into(),
        kt: 1.0,
        scene: scene.into(),
        data: None,
        dt,
        steps: [500, steps],
    };
    let liquid = "box = 3.0\ndensity = 6.05\n";
    vec![Case {
        group: GROUP,
        name: if full { "10^6 steps without thermostat" } else { "2000 steps without thermostat" },
        run: run(0.002, liquid),
        must: Must::Conserves(0.02),
        exact: None,
    }]
}
