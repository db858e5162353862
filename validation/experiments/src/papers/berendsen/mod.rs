//! H. J. C. Berendsen, Simulating the Physical World (2007), chapter 11.

mod collision;
mod standard;

use super::Paper;
use collision::{merge, size, tension};
use standard::{alpha, lowe_andersen, water};

const IMMISCIBLE: &str = include_str!("../../../../models/drop-collision.toml");

pub const PAPER: Paper = (
    "berendsen",
    "H. J. C. Berendsen, Simulating the Physical World, Cambridge (2007), chapter 11",
    &[
        ("alpha", "standard DPD: p = rho kT + alpha a rho^2 with alpha = 0.101(1)", alpha),
        ("water", "standard DPD: a rho = 75 kT has the compressibility of water, 1/kappa = 16", water),
        ("lowe-andersen", "Lowe and Andersen's thermostat: temperature and pressure", lowe_andersen),
        ("tension", "like 14.5, unlike 41.5, density 10: tension 28", tension),
        (
            "fig11.1",
            "two drops that start at the printed Weber number, 4: whether they become one, and at 16",
            merge,
        ),
        ("size", "3.75 million particles (quick: a hundredth): memory of a few steps", size),
    ],
);
