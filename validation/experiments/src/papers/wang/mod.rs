//! X. Wang, S. Chen, Acta Phys. Sin. (2010): a pair potential of two splines.

mod demixing;
mod drop;
mod pressure;

use super::Case;

const PAPER: &str = "X. Wang, S. Chen, Acta Phys. Sin. (2010)";
const EOS: &str = include_str!("../../../../models/spline-eos.toml");
const WEAK: &str = include_str!("../../../../models/spline-demixing-b08.toml");
const STRONG: &str = include_str!("../../../../models/spline-demixing-b10.toml");

const fn case(id: &'static str, what: &'static str, run: super::Run) -> Case {
    Case { id, paper: PAPER, what, run }
}

pub const CASES: &[Case] = &[
    case(
        "wang-fig2",
        "equation of state of 8.0 W(0.8) - 4.08 W(1.0) against the van der Waals fit of the paper",
        pressure::fig2,
    ),
    case("wang-fig3", "attraction B = 0.8: no two phases", demixing::fig3),
    case("wang-fig4", "attraction B = 1.0: two phases", demixing::fig4),
    case("wang-limit", "17.0 W(0.8) collapses, 19.0 W(0.8) does not (theory)", demixing::limit),
    case(
        "wang-fig6",
        "drop of 5960 particles: densities inside and outside, tension by Laplace's law",
        drop::fig6,
    ),
    case("wang-fig8", "drop of 5960 particles: P_n - P_t, tension by its integral", drop::fig8),
    case("wang-fig10", "drop of 5960 particles: pressure inside, in the surface, outside", drop::fig10),
    case("wang-fig11", "drops of 2828 to 16312 particles: tension by Laplace's law", drop::fig11),
];
