//! Formulas that are singular, and species that are not there.

use super::case::Must::{Counted, RightOrSaid, Stops};
use super::case::{Case, Inputs, cube};
use crate::shipped::{HUGGINS, VAN_DER_WAALS};

/// A fluid with a logarithm of its density and a quotient; `bounds` as in a model file.
fn logarithm(bounds: &str) -> String {
    format!(
        "title = \"ln n\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n{bounds}\n\
         [excess_free_energy]\nA = \"kT*ln(n) + 0.1/n\"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n"
    )
}

pub fn cases() -> Vec<Case> {
    // b n is 1.3 on average.
    let flat = |model: String| Inputs::new(model, 2.5, cube(3.0, 80.0), 0.002, [50, 150]);
    let unbounded = VAN_DER_WAALS.split_inclusive('\n').filter(|line| !line.starts_with("bounds")).collect();
    // Two particles in a large box, out of each other's reach.
    let lone = "box = 20.0\n[initial]\nkind = \"lattice\"\ncount = 2\n";
    let thin = |bounds: &str| Inputs::new(logarithm(bounds), 1.0, lone, 0.01, [20, 40]);
    let huggins = |composition: &str, scene: &str| {
        let scene = format!("{scene}[initial]\nkind = \"lattice\"\n{composition}\n");
        Inputs::new(HUGGINS, 1.0, scene, 0.01, [1000, 2000])
    };
    let evaporated = huggins("count = 2", "box = 20.0\n");
    let alone = huggins("density = 3.0\nspecies = \"A\"", "box = 4.0\n");
    let bounded = thin("bounds = [0.5, 20.0]");
    let constant = thin("bounds = [0.5, 20.0]\nbelow = \"constant\"");
    let case = Case::new;
    vec![
        case("bn beyond 1 where psi has a pole, no bounds", flat(unbounded), Stops),
        case("bn beyond 1, bounds", flat(VAN_DER_WAALS.into()), Counted),
        case("n = 0 with ln n and 1/n, no bounds", thin(""), Stops),
        case("n = 0 with ln n and 1/n, bounds", bounded, Counted),
        case("n = 0 with ln n and 1/n, constant slope below the bound", constant, Counted),
        case("an evaporated Huggins particle", evaporated, RightOrSaid(0.06)),
        case("a species absent from every neighbourhood", alone, RightOrSaid(0.06)),
    ]
}
