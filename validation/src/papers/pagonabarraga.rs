//! I. Pagonabarraga, D. Frenkel, J. Chem. Phys. 115, 5015 (2001): forces from a local free energy.

use super::Case;
use super::case::{Outcome, exact, line};
use super::context::{Context, Fluid, PaperError, mean_field, with_parameters};
use crate::bulk::Observed;
use crate::observe::Measured;
use psidpd_core::model::Model;
use psidpd_core::theory::critical_point_of_model;

const PAPER: &str = "I. Pagonabarraga, D. Frenkel, J. Chem. Phys. 115, 5015 (2001)";
const VAN_DER_WAALS: &str = include_str!("../../models/van-der-waals-2d.toml");
const STANDARD: &str = include_str!("../../models/standard-dpd.toml");
const QUADRATIC: &str = include_str!("../../models/groot-warren-quadratic.toml");
const LINEAR: &str = include_str!("../../models/groot-warren-linear.toml");
const BINARY: &str = include_str!("../../models/binary-2d.toml");

pub const CASES: &[Case] = &[
    Case {
        id: "pagonabarraga-fig1",
        paper: PAPER,
        what: "van der Waals with alpha_3 = 0 and 5: critical point and compressibility (theory)",
        run: fig1,
    },
    Case {
        id: "pagonabarraga-fig3",
        paper: PAPER,
        what: "Groot-Warren by psi, linear and quadratic kernel: pressure",
        run: fig3,
    },
    Case {
        id: "pagonabarraga-fig4",
        paper: PAPER,
        what: "g(r) at density 3: a linear kernel makes less structure than a quadratic one",
        run: fig4,
    },
    Case {
        id: "pagonabarraga-fig5",
        paper: PAPER,
        what: "g(r) at density 14: a linear kernel makes more structure than a quadratic one",
        run: fig5,
    },
    Case {
        id: "pagonabarraga-fig6",
        paper: PAPER,
        what: "van der Waals in two dimensions: pressure against the equation of state",
        run: fig6,
    },
    Case {
        id: "pagonabarraga-fig12",
        paper: PAPER,
        what: "binary mixture: critical temperature and tension near it (theory)",
        run: fig12,
    },
];

/// x_c = b ρ_c and kT_c b/a, the paper's eqs (14)–(16).
fn critical(alpha: f64) -> [f64; 2] {
    // x_c = [α − 1 + √(1 + ⅔α + α²)]/(4α); 1/3 in the limit α → 0.
    let x = if alpha == 0.0 {
        1.0 / 3.0
    } else {
        (alpha - 1.0 + (1.0 + 2.0 / 3.0 * alpha + alpha * alpha).sqrt()) / (4.0 * alpha)
    };
    [x, x * (2.0 + 3.0 * alpha * x) * (1.0 - x).powi(2)]
}

fn fig1(_: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let (b, a) = (0.016, 1.9 * 0.016);
    let mut hot = Vec::new();
    let mut lines = Vec::new();
    for alpha in [0.0, 5.0] {
        let text = with_parameters(VAN_DER_WAALS, &[("alpha3", alpha)])?;
        let [x, t] = critical(alpha);
        let (rho, kt) = (x / b, t * a / b);
        let found = critical_point_of_model(&Model::parse("model.toml", &text)?, [0.2 * kt, 3.0 * kt])?;
        outcome.equal(format!("kT_c b/a, alpha_3 = {alpha}"), exact(found.parameter * b / a), t, 1e-6 * t);
        outcome.equal(format!("b rho_c, alpha_3 = {alpha}"), exact(found.density * b), x, 1e-4 * x);
        let inverse = |share: f64, rho: f64| -> Result<f64, PaperError> {
            Ok(rho * mean_field(&text, share * kt)?.pressure_slope(&[rho]))
        };
        let cold = 1.0 / inverse(0.8, rho)?;
        outcome.at_most(format!("compressibility at 0.8 T_c and rho_c, alpha_3 = {alpha}"), exact(cold), 0.0);
        hot.push(1.0 / inverse(1.1, rho)?);
        let theory = mean_field(&text, 1.1 * kt)?;
        let curve = line(0.2, 1.6, |s| 1.0 / (s * rho * theory.pressure_slope(&[s * rho])));
        lines.push((if alpha == 0.0 { "alpha_3 = 0" } else { "alpha_3 = 5" }, curve));
    }
    outcome.at_most("compressibility at 1.1 T_c and rho_c: alpha_3 = 5 over 0", exact(hot[1] / hot[0]), 1.0);
    outcome.plot("compressibility", "1.1 T_c", ["density over rho_c", "compressibility"], &[], &lines);
    Ok(outcome)
}

/// The box has edge 6 in the paper.
fn groot_warren(
    context: &Context,
    name: &str,
    model: &str,
    rho: f64,
    observe: &str,
) -> Result<Observed, PaperError> {
    let fluid = Fluid { model, kt: 1.0, dt: 0.01, edge: 6.0, observe };
    context.bulk(&format!("{name}-{rho}"), &fluid, &[rho])
}

fn fig3(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    // ψ = α a n with the quadratic kernel is the pair force of strength a′ = 30 α a/π, 3.5 % less than a.
    let a = 25.0 * 0.101 * 30.0 / std::f64::consts::PI;
    let pairwise = with_parameters(STANDARD, &[("a", a)])?;
    let [mut quadratic, mut linear, mut pairs] = [Vec::new(), Vec::new(), Vec::new()];
    for rho in [3.0, 8.0, 14.0] {
        let q = groot_warren(context, "quadratic", QUADRATIC, rho, "")?.pressure();
        let l = groot_warren(context, "linear", LINEAR, rho, "")?.pressure();
        let p = groot_warren(context, "pairwise", &pairwise, rho, "")?.pressure();
        outcome.equal(format!("quadratic kernel, density {rho}"), q, p.value, p.error);
        let excess = Measured { value: (q.value - rho) / (a * rho * rho), error: q.error / (a * rho * rho) };
        if rho > 3.0 {
            outcome.equal(format!("alpha of the quadratic kernel, density {rho}"), excess, 0.101, 0.001);
        }
        quadratic.push((rho, q));
        linear.push((rho, l));
        pairs.push((rho, p));
    }
    let measured = [("quadratic kernel", quadratic), ("linear kernel", linear), ("pairwise force", pairs)];
    let published = line(2.0, 15.0, |rho| rho + 0.101 * a * rho * rho);
    outcome.plot(
        "pressure",
        "Groot–Warren",
        ["density", "pressure"],
        &measured,
        &[("rho kT + 0.101 a' rho²", published)],
    );
    Ok(outcome)
}

/// The largest departure of g(r) from 1 beyond half of the range: the first shell of neighbours.
fn structure(observed: &Observed) -> Option<(Measured, Vec<(f64, f64)>)> {
    let rdf = observed.get("rdf")?;
    let (x, g) = (rdf.x.as_ref()?, rdf.get("g")?);
    let at = (0..g.values.len())
        .filter(|k| x.values[*k] > 0.5)
        .max_by(|a, b| g.values[*a].total_cmp(&g.values[*b]))?;
    let peak = Measured { value: g.values[at], error: g.errors[at] };
    Some((peak, x.values.iter().copied().zip(g.values.iter().copied()).collect()))
}

fn peaks(context: &Context, rho: f64) -> Result<(Outcome, Measured), PaperError> {
    let mut outcome = Outcome::default();
    let rdf = "rdf = { range = 1.5, bins = 50 }";
    let observed = [
        groot_warren(context, "linear", LINEAR, rho, rdf)?,
        groot_warren(context, "quadratic", QUADRATIC, rho, rdf)?,
    ];
    let [linear, quadratic] = observed.map(|o| structure(&o).unwrap_or((Measured::NONE, Vec::new())));
    let difference = Measured {
        value: linear.0.value - quadratic.0.value,
        error: linear.0.error.hypot(quadratic.0.error),
    };
    let lines = [("linear kernel", linear.1), ("quadratic kernel", quadratic.1)];
    outcome.plot("rdf", &format!("g(r) at density {rho}"), ["r", "g"], &[], &lines);
    Ok((outcome, difference))
}

fn fig4(context: &Context) -> Result<Outcome, PaperError> {
    let (mut outcome, difference) = peaks(context, 3.0)?;
    outcome.at_most("first peak of g, linear minus quadratic", difference, 0.0);
    Ok(outcome)
}

fn fig5(context: &Context) -> Result<Outcome, PaperError> {
    let (mut outcome, difference) = peaks(context, 14.0)?;
    outcome.at_least("first peak of g, linear minus quadratic", difference, 0.0);
    Ok(outcome)
}

fn fig6(context: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    let kt = 2.5;
    let theory = mean_field(VAN_DER_WAALS, kt)?;
    let fluid = Fluid { model: VAN_DER_WAALS, kt, dt: 0.01, edge: 7.0, observe: "" };
    let mut points = Vec::new();
    for rho in [10.0, 20.0, 30.0, 40.0] {
        let p = context.bulk(&format!("rho{rho}"), &fluid, &[rho])?.pressure();
        // The paper has "only small deviations" and no number: that of reading its figure, 2 % of the ideal part.
        let ideal = rho * kt / (1.0 - 0.016 * rho);
        outcome.equal(format!("pressure at density {rho}"), p, theory.pressure(&[rho]), 0.02 * ideal);
        points.push((rho, p));
    }
    let published = line(2.0, 45.0, |rho| theory.pressure(&[rho]));
    outcome.plot(
        "pressure",
        "Van der Waals, kT = 2.5",
        ["density", "pressure"],
        &[("measured", points)],
        &[("theory", published)],
    );
    Ok(outcome)
}

fn fig12(_: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    // kT_c = rho (lambda - lambda_A) = 10 · 0.8.
    let model = Model::parse("model.toml", BINARY)?;
    let tension = |kt: f64| -> Result<f64, PaperError> {
        Ok(mean_field(BINARY, kt)?.composition_interface(10.0, 400)?.tension)
    };
    let critical =
        psidpd_core::theory::composition_critical_point(&|kt| Ok(model.at(kt)?), 10.0, [2.0, 20.0])?;
    outcome.equal("kT_c", exact(critical.parameter), 8.0, 1e-4);
    // γ ∝ (1 − T/T_c)^(3/2), eq. (40).
    let [near, nearer] = [0.04, 0.02];
    let exponent =
        (tension(8.0 * (1.0 - near))? / tension(8.0 * (1.0 - nearer))?).ln() / (near / nearer).ln();
    outcome.equal("exponent of the tension", exact(exponent), 1.5, 0.02);
    let mut curve = Vec::new();
    for k in 0..20 {
        let kt = 3.0 + 0.25 * f64::from(k);
        curve.push((kt / 8.0, tension(kt)?));
    }
    outcome.plot("tension", "Binary mixture", ["T/T_c", "tension"], &[], &[("mean field", curve)]);
    Ok(outcome)
}
