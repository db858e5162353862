//! P. B. Warren, Phys. Rev. E 68, 066702 (2003): vapour and liquid by many-body repulsion.

use super::Case;
use super::case::{Outcome, line};
use super::context::{Context, Fluid, PaperError, with_parameters};
use crate::observe::Measured;

const PAPER: &str = "P. B. Warren, Phys. Rev. E 68, 066702 (2003)";
const SET5: &str = include_str!("../../models/warren2003-set5.toml");
const SET6: &str = include_str!("../../models/warren2003-set6.toml");
/// α of p = ρkT + αAρ², with its error.
const ALPHA: [f64; 2] = [0.101, 0.001];

pub const CASES: &[Case] = &[
    Case {
        id: "warren-table1",
        paper: PAPER,
        what: "the correction c of the many-body term against its range, eq. (17)",
        run: table1,
    },
    Case {
        id: "warren-fig2",
        paper: PAPER,
        what: "the equation of state of sets 5 and 6, eq. (18)",
        run: fig2,
    },
    Case {
        id: "warren-table2",
        paper: PAPER,
        what: "liquid density, width and tension of sets 5 and 6 at kT = 1",
        run: table2,
    },
    Case {
        id: "warren-fig5",
        paper: PAPER,
        what: "the tension falls and the width grows with kT, set 6",
        run: fig5,
    },
];

fn table1(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let mut points = Vec::new();
    let printed: [(f64, f64, f64); 4] =
        [(0.65, 4.1, 0.1), (0.75, 3.07, 0.05), (0.85, 2.08, 0.05), (1.0, 1.29, 0.05)];
    // In the middle of the paper's ranges, A = 0–50 and B r_d⁴ = 0–10, and over its densities.
    let (a, many) = (25.0, 5.0);
    for (rd, value, error) in printed {
        let model = with_parameters(SET6, &[("A", a), ("B", many / rd.powi(4)), ("rd", rd)])?;
        let fluid = Fluid { model: &model, kt: 1.0, dt: 0.01, edge: 10.0, observe: "" };
        let mut pressures = Vec::new();
        for rho in [3.0, 6.0, 9.0] {
            let name = format!("rd{rd}-rho{rho}");
            pressures.push((rho, context.bulk(&name, &fluid, &[rho])?.pressure()));
        }
        // The slope of F = (p − ρ − αAρ² − 2αBr_d⁴ρ³)/Br_d⁴ against ρ² is −2αc.
        let slope = |alpha: f64, shift: usize| -> f64 {
            let (mut fx, mut xx) = (0.0, 0.0);
            for (k, (rho, p)) in pressures.iter().enumerate() {
                let p = if k + 1 == shift { p.value + p.error } else { p.value };
                let x: f64 = rho * rho;
                fx += x * (p - rho - alpha * a * x - 2.0 * alpha * many * x * rho) / many;
                xx += x * x;
            }
            -fx / xx / (2.0 * alpha)
        };
        let c = slope(ALPHA[0], 0);
        let noise: f64 = (1..=pressures.len()).map(|k| (slope(ALPHA[0], k) - c).powi(2)).sum();
        let c = Measured { value: c, error: noise.sqrt().hypot(slope(ALPHA[0] + ALPHA[1], 0) - c) };
        outcome.equal(format!("c at r_d = {rd}"), c, value, error);
        points.push((rd, c));
    }
    let published = printed.iter().map(|(rd, c, _)| (*rd, *c)).collect();
    outcome.plot(
        "c",
        "Correction of the many-body term",
        ["r_d", "c"],
        &[("measured", points)],
        &[("Table 1", published)],
    );
    Ok(outcome)
}

/// Eq. (18) and its error from those of α, c and d.
fn eq18(a: f64, b: f64, rho: f64) -> Measured {
    let rd4 = 0.75f64.powi(4);
    let p = |alpha: f64, c: f64, d: f64| {
        rho + alpha * a * rho * rho + 2.0 * alpha * b * rd4 * (rho.powi(3) - c * rho * rho + d)
    };
    let [alpha, c, d] = [ALPHA[0], 4.16, 18.0];
    let value = p(alpha, c, d);
    let parts = [p(alpha + ALPHA[1], c, d), p(alpha, c + 0.02, d), p(alpha, c, d + 1.0)];
    let error = parts.iter().map(|q| (q - value).powi(2)).sum::<f64>().sqrt();
    Measured { value, error }
}

fn fig2(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    for (set, model, b, densities) in
        [("set 5", SET5, 40.0, [5.5, 6.5, 7.5]), ("set 6", SET6, 25.0, [6.5, 7.0, 7.5])]
    {
        let fluid = Fluid { model, kt: 1.0, dt: 0.01, edge: 10.0, observe: "" };
        let mut points = Vec::new();
        for rho in densities {
            let name = format!("{}-{rho}", set.replace(' ', ""));
            let p = context.bulk(&name, &fluid, &[rho])?.pressure();
            let eq = eq18(-40.0, b, rho);
            outcome.equal(format!("pressure of {set} at density {rho}"), p, eq.value, eq.error);
            points.push((rho, p));
        }
        let file = if b == 40.0 { "pressure-set5" } else { "pressure-set6" };
        let published = line(5.0, 8.0, |rho| eq18(-40.0, b, rho).value);
        let title = format!("Warren, {set}");
        outcome.plot(
            file,
            &title,
            ["density", "pressure"],
            &[("measured", points)],
            &[("eq. (18)", published)],
        );
    }
    Ok(outcome)
}

/// A slab between two surfaces.
fn slab(
    context: &Context,
    name: &str,
    model: &str,
    kt: f64,
    rho: f64,
) -> Result<crate::bulk::Observed, PaperError> {
    let [edge, height] = context.pick([7.0, 18.0], [10.0, 30.0]);
    let scene = format!(
        "title = \"slab\"\nkT = {kt:?}\nseed = 1\nbox = [{edge:?}, {edge:?}, {height:?}]\ndt = 0.01\nequilibrate = {}\n\
         steps = {}\n[initial]\nkind = \"slab\"\naxis = \"z\"\nthickness = {:?}\ndensity = {rho:?}\n[output]\n\
         thermo = 0\n[observe]\nevery = 10\ntemperature = true\ndensity_profile = true\nsurface_tension = \
         {{ every = 20 }}\ninterface_width = true\n",
        context.pick(1500, 10_000),
        context.pick(8000, 100_000),
        0.5 * height,
    );
    context.scene(name, model, &scene)
}

fn table2(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let printed = [
        ("set 5", SET5, [5.08, 0.01], [0.78, 0.05], [4.95, 0.03]),
        ("set 6", SET6, [6.05, 0.01], [0.66, 0.03], [7.45, 0.04]),
    ];
    for (set, model, liquid, width, tension) in printed {
        let observed = slab(context, &set.replace(' ', ""), model, 1.0, liquid[0])?;
        let shape = |column| observed.scalar("interface_width", column);
        outcome.equal(format!("liquid density of {set}"), shape("liquid"), liquid[0], liquid[1]);
        outcome.equal(format!("width of {set}"), shape("width"), width[0], width[1]);
        let measured = observed.scalar("surface_tension", "stress");
        outcome.equal(format!("tension of {set}"), measured, tension[0], tension[1]);
    }
    Ok(outcome)
}

fn fig5(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let mut found = Vec::new();
    for (kt, rho) in [(0.5, 6.3), (1.0, 6.05), (2.0, 5.6)] {
        let observed = slab(context, &format!("kT{kt}"), SET6, kt, rho)?;
        let tension = observed.scalar("surface_tension", "stress");
        found.push((kt, tension, observed.scalar("interface_width", "width")));
    }
    for pair in found.windows(2) {
        let [(from, before, narrow), (to, after, wide)] = [pair[0], pair[1]];
        let change =
            |a: Measured, b: Measured| Measured { value: b.value - a.value, error: a.error.hypot(b.error) };
        outcome.at_most(
            format!("change of the tension from kT = {from} to {to}"),
            change(before, after),
            0.0,
        );
        outcome.at_least(format!("change of the width from kT = {from} to {to}"), change(narrow, wide), 0.0);
    }
    let column =
        |f: fn(&(f64, Measured, Measured)) -> (f64, Measured)| found.iter().map(f).collect::<Vec<_>>();
    let measured = [("tension", column(|f| (f.0, f.1))), ("width", column(|f| (f.0, f.2)))];
    outcome.plot("temperature", "Warren, set 6", ["kT", "tension, width"], &measured, &[]);
    Ok(outcome)
}
