//! H. J. C. Berendsen, Simulating the Physical World (2007), chapter 11.

mod collision;
mod compressibility;
mod lowe_andersen;

use super::Paper;
use super::context::Fluid;
use crate::models::STANDARD;

const IMMISCIBLE: &str = include_str!("../../../../models/drop-collision.toml");

pub const PAPER: Paper = (
    "berendsen",
    "H. J. C. Berendsen, Simulating the Physical World, Cambridge (2007), chapter 11",
    &[
        ("alpha", "standard DPD: p = rho kT + alpha a rho^2 with alpha = 0.101(1)", compressibility::alpha),
        (
            "water",
            "standard DPD: a rho = 75 kT has the compressibility of water, 1/kappa = 16",
            compressibility::water,
        ),
        ("lowe-andersen", "Lowe and Andersen's thermostat: temperature and pressure", lowe_andersen::compare),
        ("tension", "like 14.5, unlike 41.5, density 10: tension 28", collision::tension),
        ("fig11.1", "two drops that meet at a Weber number of 4 become one", collision::merge),
        ("size", "3.75 million particles (quick: a hundredth): memory of a few steps", collision::size),
    ],
);

fn fluid() -> Fluid<'static> {
    Fluid { model: STANDARD, kt: 1.0, dt: 0.01, edge: 10.0, observe: "" }
}
