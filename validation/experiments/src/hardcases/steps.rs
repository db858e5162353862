//! Steps that are long for the forces, the drag or the masses.

use super::case::{Case, Inputs, Must, cube};
use crate::shipped::{SET6, SPLINE};

/// A gas that has a thermostat alone.
const IDEAL: &str = "title = \"ideal gas\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

/// An ideal gas of two species.
const IDEAL_TWO: &str =
    "title = \"ideal gas\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

pub fn cases() -> Vec<Case> {
    let case = |name, run, must, exact| Case { exact, ..Case::new(name, run, must) };
    let liquid = |dt: f64| Inputs::new(SET6, 1.0, cube(4.0, 6.05), dt, [200, 1000]);
    // γ Δt is told; Σ w² over neighbours is about 1.3 at this density.
    let gas =
        |model: &str, dt: f64, rest: &str| Inputs::new(model, 1.0, cube(4.0, 3.0) + rest, dt, [100, 400]);
    let strong = |gamma: f64| IDEAL.replace("gamma = 4.5", &format!("gamma = {gamma:?}"));
    // The watch has more samples of a longer stage.
    let long = |run: Inputs| Inputs { steps: [100, 3000], ..run };
    let drops = "box = [7.0, 7.0, 12.0]\n[[part]]\nshape = \"sphere\"\nradius = 1.8\ncenter = [3.5, 3.5, 3.0]\n\
                 density = 12.0\nvelocity = [0.0, 0.0, 8.0]\n[[part]]\nshape = \"sphere\"\nradius = 1.8\n\
                 center = [3.5, 3.5, 9.0]\ndensity = 12.0\nvelocity = [0.0, 0.0, -8.0]\n";
    let collision = Inputs::new(SPLINE, 0.5, drops, 0.005, [1500, 800]);
    let cold = Inputs { kt: 0.0, steps: [10, 10], ..gas(IDEAL, 0.01, "") };
    let [said, vaguely] = [0.06, 0.15].map(Must::RightOrSaid);
    let right = |part: f64| Some(Must::Right(part));
    vec![
        case("the stability limit: dt = 0.04 in Warren's liquid", liquid(0.04), said, None),
        case("past it: dt = 0.1", liquid(0.1), said, None),
        case("far past it: dt = 0.5", liquid(0.5), said, None),
        case("gamma dt = 1", long(gas(&strong(10.0), 0.1, "")), said, right(0.02)),
        case("gamma dt = 100", long(gas(&strong(1000.0), 0.1, "")), said, right(0.02)),
        // The heavy half keeps the velocities that it began with, which are 8 % of kT off by chance.
        case("masses of 1 and 10^6", gas(IDEAL_TWO, 0.02, "[masses]\nB = 1e6\n"), vaguely, right(0.15)),
        case("masses of 1 and 10^-3", gas(IDEAL_TWO, 0.02, "[masses]\nB = 1e-3\n"), said, right(0.04)),
        case("kT = 0", cold, Must::Refused, None),
        case("a fast collision of drops", collision, vaguely, None),
    ]
}
