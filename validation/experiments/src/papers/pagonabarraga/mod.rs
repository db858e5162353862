//! I. Pagonabarraga, D. Frenkel, J. Chem. Phys. 115, 5015 (2001): forces from a local free energy.

mod binary;
mod groot_warren;
mod slab;
mod van_der_waals;

use super::Paper;
use binary::{fig10, fig11, fig12};
use groot_warren::{fig3, fig4, fig5, minimum};
use slab::{fig7, fig8, fig9};
use van_der_waals::{fig1, fig2, fig6};

const SLAB: &str = include_str!("../../../../models/van-der-waals-2d-slab.toml");
const QUADRATIC: &str = include_str!("../../../../models/groot-warren-quadratic.toml");
const BINARY: &str = include_str!("../../../../models/binary-2d.toml");

pub const PAPER: Paper = (
    "pagonabarraga",
    "I. Pagonabarraga, D. Frenkel, J. Chem. Phys. 115, 5015 (2001)",
    &[
        ("fig1", "van der Waals with alpha_3 = 0 and 5: critical point and compressibility (theory)", fig1),
        ("fig2", "van der Waals with alpha_3 = 0 and 5: where pressure and tension vanish (theory)", fig2),
        ("fig3", "Groot-Warren by psi, linear and quadratic kernel: pressure", fig3),
        ("fig4", "g(r) at density 3: a linear kernel makes less structure than a quadratic one", fig4),
        ("fig5", "g(r) at density 14: a linear kernel makes more structure than a quadratic one", fig5),
        ("fig6", "van der Waals in two dimensions: pressure against the equation of state", fig6),
        ("fig7", "slab: temperature, mean-square displacement, tension by the mean pressures", fig7),
        ("fig8", "slab: densities of gas and liquid, and their profile", fig8),
        ("fig9", "slab: profile of the difference of the pressures, tension by two routes", fig9),
        ("fig10", "binary mixture at half of T_c: temperature and displacements of both species", fig10),
        ("fig11", "binary mixture at half of T_c: profiles of concentration and of density", fig11),
        ("fig12", "binary mixture: critical temperature, tension of mean field near it, and measured", fig12),
        ("structure", "Groot-Warren: the length l_0 and the minimum of S(k), eq. (31)", minimum),
    ],
);
