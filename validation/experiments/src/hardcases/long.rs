//! Long runs: momentum, and energy without thermostat.

use super::case::{Case, Inputs, Must};
use crate::models::SET6;

const GROUP: &str = "long runs";

pub fn cases(full: bool) -> Vec<Case> {
    let steps = if full { 1_000_000 } else { 2_000 };
    vec![Case {
        group: GROUP,
        name: if full { "10^6 steps without thermostat" } else { "2000 steps without thermostat" },
        run: Inputs::new(SET6, 1.0, "box = 3.0\ndensity = 6.05\n", 0.002, [500, steps]),
        must: Must::Conserves(0.02),
        exact: None,
    }]
}
