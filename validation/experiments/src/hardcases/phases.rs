//! Fluids where they cease to be simple.

use super::case::{Case, Inputs, Must};
use crate::models::{LINEAR, SET6, VAN_DER_WAALS};

pub fn cases() -> Vec<Case> {
    let run = |model: String, kt, scene: &str, dt| Inputs::new(model, kt, scene, dt, [200, 400]);
    // What separates or freezes is hot until it has.
    let long = |run: Inputs| Inputs { steps: [1000, 800], ..run };
    let bell = SET6.replace("kernel = \"quadratic\"", "kernel = \"bell\"");
    // φ = a [A W(r, 0.8) − B W(r, 1)] attracts more than it repels, and has no thermodynamic limit.
    let collapsing = "title = \"spline\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"spline\"\n\
                      strength = 9.5\nA = 0.5\nB = 1.0\nrange_A = 0.8\nrange_B = 1.0\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
    vec![
        Case::new(
            "a quench far below the critical point",
            long(run(VAN_DER_WAALS.into(), 0.3, "box = 4.0\ndensity = 20.0\n", 0.005)),
            Must::RightOrSaid(0.1),
        ),
        Case::new(
            "the linear kernel past freezing",
            long(run(LINEAR.into(), 1.0, "box = 3.0\ndensity = 14.0\n", 0.01)),
            Must::RightOrSaid(0.06),
        ),
        Case::new(
            "the bell kernel, in which particles pair",
            run(bell, 1.0, "box = 3.5\ndensity = 6.0\n", 0.005),
            Must::RightOrSaid(0.06),
        ),
        Case::new(
            "a spline whose integral is negative: collapse",
            run(collapsing.into(), 0.5, "box = 4.0\ndensity = 5.0\n", 0.005),
            Must::RightOrSaid(0.1),
        ),
    ]
}
