//! Formulas that are singular, and species that are not there.

use super::case::{Case, Inputs, Must};
use crate::models::{HUGGINS, VAN_DER_WAALS};

/// A fluid with a logarithm of its density and a quotient; `bounds` as in a model file.
fn logarithm(bounds: &str) -> String {
    format!(
        "title = \"ln n\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n{bounds}\n\
         [excess_free_energy]\nA = \"kT*ln(n) + 0.1/n\"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n"
    )
}

pub fn cases() -> Vec<Case> {
    // b n is 1.3 on average.
    let flat = |model: String| Inputs::new(model, 2.5, "box = 3.0\ndensity = 80.0\n", 0.002, [50, 150]);
    let unbounded: String = VAN_DER_WAALS
        .lines()
        .filter(|l| !l.starts_with("bounds"))
        .fold(String::new(), |all, l| all + l + "\n");
    // Two particles in a large box, out of each other's reach.
    let lone = "box = 20.0\n[initial]\nkind = \"lattice\"\ncount = 2\n";
    let thin = |bounds: &str| Inputs::new(logarithm(bounds), 1.0, lone, 0.01, [20, 40]);
    let huggins = |composition: &str, scene: &str| {
        let scene = format!("{scene}[initial]\nkind = \"lattice\"\n{composition}\n");
        Inputs::new(HUGGINS, 1.0, scene, 0.01, [1000, 2000])
    };
    vec![
        Case::new("bn beyond 1 where psi has a pole, no bounds", flat(unbounded), Must::Stops),
        Case::new("bn beyond 1, bounds", flat(VAN_DER_WAALS.into()), Must::Counted),
        Case::new("n = 0 with ln n and 1/n, no bounds", thin(""), Must::Stops),
        Case::new("n = 0 with ln n and 1/n, bounds", thin("bounds = [0.5, 20.0]"), Must::Counted),
        Case::new(
            "n = 0 with ln n and 1/n, constant slope below the bound",
            thin("bounds = [0.5, 20.0]\nbelow = \"constant\""),
            Must::Counted,
        ),
        Case::new(
            "an evaporated Huggins particle",
            huggins("count = 2", "box = 20.0\n"),
            Must::RightOrSaid(0.06),
        ),
        Case::new(
            "a species absent from every neighbourhood",
            huggins("density = 3.0\nspecies = \"A\"", "box = 4.0\n"),
            Must::RightOrSaid(0.06),
        ),
    ]
}
