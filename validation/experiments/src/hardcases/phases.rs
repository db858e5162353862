//! Fluids where they cease to be simple.

use super::case::Must::RightOrSaid;
use super::case::{Case, Inputs, cube};
use crate::shipped::{LINEAR, SET6, VAN_DER_WAALS};

pub fn cases() -> Vec<Case> {
    let case = Case::new;
    let run = |model: &str, kt, scene: String, dt| Inputs::new(model, kt, scene, dt, [200, 400]);
    // What separates or freezes is hot until it has.
    let long = |run: Inputs| Inputs { steps: [1000, 800], ..run };
    let quench = long(run(VAN_DER_WAALS, 0.3, cube(4.0, 20.0), 0.005));
    let frozen = long(run(LINEAR, 1.0, cube(3.0, 14.0), 0.01));
    let bell = SET6.replace("kernel = \"quadratic\"", "kernel = \"bell\"");
    let bell = run(&bell, 1.0, cube(3.5, 6.0), 0.005);
    // φ = a [A W(r, 0.8) − B W(r, 1)] attracts more than it repels, and has no thermodynamic limit.
    let collapsing = "title = \"spline\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"spline\"\n\
                      strength = 9.5\nA = 0.5\nB = 1.0\nrange_A = 0.8\nrange_B = 1.0\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
    let collapsing = run(collapsing, 0.5, cube(4.0, 5.0), 0.005);
    vec![
        case("a quench far below the critical point", quench, RightOrSaid(0.1)),
        case("the linear kernel past freezing", frozen, RightOrSaid(0.06)),
        case("the bell kernel, in which particles pair", bell, RightOrSaid(0.06)),
        case("a spline whose integral is negative: collapse", collapsing, RightOrSaid(0.1)),
    ]
}
