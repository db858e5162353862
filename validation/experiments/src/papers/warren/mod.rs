//! P. B. Warren, Phys. Rev. E 68, 066702 (2003): vapour and liquid by many-body repulsion.

mod interface;
mod pendant;
mod state;

use super::Paper;
use interface::{fig3, fig4, fig5, table2};
use pendant::{fig6, table3};
use state::{fig1, fig2, table1};

/// α of p = ρkT + αAρ², with its error.
const ALPHA: [f64; 2] = [0.101, 0.001];

pub const PAPER: Paper = (
    "warren",
    "P. B. Warren, Phys. Rev. E 68, 066702 (2003)",
    &[
        ("fig1", "pressures of many strengths fall on one line, eqs (5) and (17)", fig1),
        ("table1", "the correction c of the many-body term against its range, eq. (17)", table1),
        ("fig2", "the equation of state of sets 5 and 6, eq. (18)", fig2),
        ("table2", "liquid density, width and tension of sets 5 and 6 at kT = 1", table2),
        ("fig3", "densities of vapour and liquid at kT = 0.5, 1 and 2", fig3),
        ("fig4", "profiles at kT = 0.5, 1 and 2: layers beside the surface when it is cold", fig4),
        ("fig5", "the tension falls and the width grows with kT", fig5),
        ("fig6", "hanging drop 6h: its profile is that of Young and Laplace", fig6),
        ("table3", "hanging drops 5a, 6f, 6h, 6g: tension from the shape", table3),
    ],
);
