//! H. J. C. Berendsen, Simulating the Physical World (2007), chapter 11.

use super::Case;
use super::case::{Outcome, line};
use super::context::{Context, Fluid, PaperError};

const PAPER: &str = "H. J. C. Berendsen, Simulating the Physical World, Cambridge (2007), chapter 11";
const STANDARD: &str = include_str!("../../models/standard-dpd.toml");
/// a r_c⁴ of the model.
const A: f64 = 25.0;

pub const CASES: &[Case] = &[
    Case {
        id: "berendsen-alpha",
        paper: PAPER,
        what: "standard DPD: p = rho kT + alpha a rho^2 with alpha = 0.101(1)",
        run: alpha,
    },
    Case {
        id: "berendsen-water",
        paper: PAPER,
        what: "standard DPD: a rho = 75 kT has the compressibility of water, 1/kappa = 16",
        run: water,
    },
];

fn fluid() -> Fluid<'static> {
    Fluid { model: STANDARD, kt: 1.0, dt: 0.01, edge: 10.0, observe: "" }
}

fn alpha(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let mut points = Vec::new();
    for rho in [4.0, 6.0, 8.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid(), &[rho])?.pressure();
        let scale = 1.0 / (A * rho * rho);
        let mut excess = p;
        excess.value -= rho;
        outcome.equal(format!("alpha at density {rho}"), excess.times(scale), 0.101, 0.001);
        points.push((rho, p));
    }
    let published = line(3.0, 9.0, |rho| rho + 0.101 * A * rho * rho);
    outcome.plot(
        "pressure",
        "Standard DPD",
        ["density", "pressure"],
        &[("measured", points)],
        &[("rho kT + 0.101 a rho²", published)],
    );
    Ok(outcome)
}

fn water(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let [low, high] = [2.5, 3.5];
    let a = context.bulk("below", &fluid(), &[low])?.pressure();
    let b = context.bulk("above", &fluid(), &[high])?.pressure();
    let slope = crate::observe::Measured {
        value: (b.value - a.value) / (high - low),
        error: a.error.hypot(b.error) / (high - low),
    };
    // 1 + 2 alpha a rho/kT with alpha = 0.101(1) is 16.15(15); water has 15.98.
    outcome.equal("dp/drho / kT at density 3", slope, 16.15, 0.15);
    Ok(outcome)
}
