//! X. Wang, S. Chen, Acta Phys. Sin. (2010): a pair potential of two splines.

use super::Case;
use super::case::{Outcome, line};
use super::context::{Context, Fluid, PaperError};

const PAPER: &str = "X. Wang, S. Chen, Acta Phys. Sin. (2010)";
const EOS: &str = include_str!("../../models/spline-eos.toml");
const DROP: &str = include_str!("../../models/spline-attractive.toml");

pub const CASES: &[Case] = &[
    Case {
        id: "wang-fig2",
        paper: PAPER,
        what: "equation of state of 8.0 W(0.8) - 4.08 W(1.0) against the van der Waals fit of the paper",
        run: fig2,
    },
    Case {
        id: "wang-fig6",
        paper: PAPER,
        what: "drop of 5960 particles: densities inside and outside, tension by Laplace's law",
        run: fig6,
    },
];

fn fig2(context: &Context) -> Result<Outcome, PaperError> {
    let fluid = Fluid { model: EOS, kt: 1.0, dt: 0.01, edge: 8.0, observe: "" };
    let published = |rho: f64| rho / (1.0 - 0.0134 * rho) - 0.0333 * rho * rho;
    let mut outcome = Outcome::default();
    let mut points = Vec::new();
    for rho in [2.0, 5.0, 10.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid, &[rho])?.pressure();
        // The last printed digits of b and a.
        let b = 0.00005 * (rho / (1.0 - 0.0134 * rho)).powi(2);
        outcome.equal(format!("pressure at density {rho}"), p, published(rho), b.hypot(0.00005 * rho * rho));
        points.push((rho, p));
    }
    outcome.plot(
        "pressure",
        "Spline potential",
        ["density", "pressure"],
        &[("measured", points)],
        &[("van der Waals fit of the paper", line(0.0, 11.0, published))],
    );
    Ok(outcome)
}

fn fig6(context: &Context) -> Result<Outcome, PaperError> {
    // 5960 particles in a cube of edge 20, at either size: density and pressure inside depend on the radius.
    let edge = 20.0;
    let radius = (3.0 * 5960.0 / (4.0 * std::f64::consts::PI * 12.5_f64)).cbrt();
    let scene = format!(
        "title = \"drop\"\nkT = 0.5\nseed = 1\nbox = {edge:?}\ndt = 0.01\nequilibrate = {}\nsteps = {}\n[initial]\n\
         kind = \"sphere\"\nradius = {radius:?}\ndensity = 12.5\n[output]\nthermo = 0\n[observe]\nevery = 20\ntemperature = true\ndrop = true\n",
        context.pick(1000, 20_000),
        context.pick(3000, 200_000),
    );
    let observed = context.scene("drop", DROP, &scene)?;
    let mut outcome = Outcome::default();
    // The text has "about 12.5"; the vapour is 1/400 of it.
    outcome.equal("liquid density", observed.scalar("drop", "liquid"), 12.5, 0.05);
    outcome.equal("vapour density", observed.scalar("drop", "vapour"), 0.03, 0.005);
    outcome.equal("tension by Laplace's law", observed.scalar("drop", "tension"), 3.245, 0.0005);
    Ok(outcome)
}
