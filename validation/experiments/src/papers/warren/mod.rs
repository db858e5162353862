//! P. B. Warren, Phys. Rev. E 68, 066702 (2003): vapour and liquid by many-body repulsion.

mod interface;
mod pendant;
mod state;

use super::Case;

const PAPER: &str = "P. B. Warren, Phys. Rev. E 68, 066702 (2003)";
/// α of p = ρkT + αAρ², with its error.
const ALPHA: [f64; 2] = [0.101, 0.001];

const fn case(id: &'static str, what: &'static str, run: super::Run) -> Case {
    Case { id, paper: PAPER, what, run }
}

pub const CASES: &[Case] = &[
    case("warren-fig1", "pressures of many strengths fall on one line, eqs (5) and (17)", state::fig1),
    case(
        "warren-table1",
        "the correction c of the many-body term against its range, eq. (17)",
        state::table1,
    ),
    case("warren-fig2", "the equation of state of sets 5 and 6, eq. (18)", state::fig2),
    case("warren-table2", "liquid density, width and tension of sets 5 and 6 at kT = 1", interface::table2),
    case("warren-fig3", "densities of vapour and liquid at kT = 0.5, 1 and 2", interface::fig3),
    case(
        "warren-fig4",
        "profiles at kT = 0.5, 1 and 2: layers beside the surface when it is cold",
        interface::fig4,
    ),
    case("warren-fig5", "the tension falls and the width grows with kT", interface::fig5),
    case("warren-fig6", "hanging drop 6h: its profile is that of Young and Laplace", pendant::fig6),
    case("warren-table3", "hanging drops 5a, 6f, 6h, 6g: tension from the shape", pendant::table3),
];
