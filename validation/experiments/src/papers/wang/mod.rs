//! X. Wang, S. Chen, Acta Phys. Sin. (2010): a pair potential of two splines.

mod demixing;
mod drop;
mod pressure;

use super::Paper;
use demixing::{fig3, fig4, limit};
use drop::{fig6, fig8, fig10, fig11};

const EOS: &str = include_str!("../../../../models/spline-eos.toml");
const WEAK: &str = include_str!("../../../../models/spline-demixing-b08.toml");
const STRONG: &str = include_str!("../../../../models/spline-demixing-b10.toml");

pub const PAPER: Paper = (
    "wang",
    "X. Wang, S. Chen, Acta Phys. Sin. (2010)",
    &[
        (
            "fig2",
            "equation of state of 8.0 W(0.8) - 4.08 W(1.0) against the van der Waals fit of the paper",
            pressure::fig2,
        ),
        ("fig3", "attraction B = 0.8: no two phases", fig3),
        ("fig4", "attraction B = 1.0: two phases", fig4),
        ("limit", "17.0 W(0.8), printed for the drops, collapses; 19.0 W(0.8) does not (theory)", limit),
        ("fig6", "drop of 5960 particles: densities inside and outside", fig6),
        ("fig8", "drop of 5960 particles: P_n - P_t, tension by its integral", fig8),
        ("fig10", "drop of 5960 particles: pressure in the surface, and outside over inside", fig10),
        ("fig11", "drops of 2828 to 16312 particles: tension by Laplace's law", fig11),
    ],
);
