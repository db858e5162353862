use super::CurveBlock;
use super::primitive::Primitive;
use crate::expression::{Formula, Program, TooLarge};

/// `ψ` from an equation of state: `ψ′(ρ) = (p(ρ) − ρkT)/ρ²` (the pressure of a fluid with excess free
/// energy ψ per particle is `p = ρkT + ρ²ψ′`; Trofimov, Nies and Michels, section IV B).
///
/// `ψ′` and `ψ″` are exact. `ψ` is the integral of `ψ′` from a density where it is finite, chosen once,
/// by Gauss–Legendre quadrature on panels that are checked against their halves, and within a panel by a polynomial; it is
/// undefined beyond a singularity of `ψ′`. Near `ρ = 0` a pressure that starts as that of an ideal gas is expanded in
/// powers of `ρ`, where the difference `p − ρkT` would lose its digits. Where the pressure has no such expansion,
/// as with `ρ^2.6`, and `ψ′` has a limit nevertheless, it goes to it as a power of `ρ`.
#[derive(Debug, Clone)]
pub struct Pressure {
    /// The pressure as the model file states it.
    pub(super) text: String,
    /// Computes `ψ′` and `ψ″` from the one variable ρ.
    program: Program,
    slope: Program,
    /// Ends of the panels, rising, and ψ at each.
    anchors: Vec<[f64; 2]>,
    /// ψ in the panel above each anchor, minus ψ at the anchor.
    panels: Vec<Primitive>,
    dilute: Option<Dilute>,
}

/// ψ at low densities, where the formula itself loses its digits, and may be 0/0 at ρ = 0.
#[derive(Debug, Clone)]
struct Dilute {
    law: Law,
    /// The law holds from this density, and below that one.
    from: f64,
    below: f64,
    /// Constant of integration that makes ψ continuous where the law ends.
    constant: f64,
}

#[derive(Debug, Clone)]
enum Law {
    /// `ψ′ = Σ_k c_k ρ^k`.
    Series([f64; TERMS]),
    /// `ψ′ = limit + factor ρ^power`.
    Power { limit: f64, factor: f64, power: f64 },
}

const TERMS: usize = 7;

/// Points of the quadrature in each panel.
const POINTS: usize = 8;

/// Panels extend from the first density by this many factors of e downwards and upwards.
const REACH: f64 = 60.0;

/// Largest width of a panel in ln ρ, and smallest width that is tried before a singularity is assumed.
const WIDEST: f64 = 0.25;
const NARROWEST: f64 = 1e-7;

/// Relative accuracy of each panel, and the weight of rounding errors of ρ in units of it.
const ACCURACY: f64 = 3e-14;
const ROUNDING: f64 = 8.0 * f64::EPSILON / ACCURACY;

/// Most panels below, and above, the first density.
const MOST_PANELS: usize = 1000;

impl Pressure {
    /// Builds ψ from the pressure as a formula of variable 0, which is ρ. Among `start`, its doubles
    /// and its halves, the first density at which ψ′ is finite has ψ = 0.
    ///
    /// # Errors
    /// Fails if a derivative grows beyond the limits of the formula engine.
    pub fn new(pressure: &Formula, kt: f64, start: f64) -> Result<Pressure, TooLarge> {
        let rho = Formula::variable(0);
        let excess = pressure.minus(&rho.times(&Formula::constant(kt))?)?;
        let slope = excess.over(&rho.times(&rho)?)?;
        let curvature = slope.derivative(0)?;
        let mut curve = Pressure {
            text: pressure.with_names(&["rho"]).to_string(),
            program: Program::new(&[&slope, &curvature]),
            slope: Program::new(&[&slope]),
            anchors: Vec::new(),
            panels: Vec::new(),
            dilute: None,
        };
        let powers = (0..100).map(|k| start * 2f64.powi(if k % 2 == 0 { k / 2 } else { -(k + 1) / 2 }));
        let first = powers.into_iter().find(|n| curve.slope_at(*n).is_finite());
        if let Some(first) = first {
            curve.anchors = curve.anchors_from(first, -1.0, kt);
            curve.anchors.reverse();
            curve.anchors.push([first, 0.0]);
            let up = curve.anchors_from(first, 1.0, kt);
            curve.anchors.extend(up);
            let slopes = |n: &[f64; _]| {
                let mut out = [0.0; _];
                curve.slope.eval_block(n.len(), n, &mut out, &mut Vec::new());
                out
            };
            let panel = |ends: &[[f64; 2]]| Primitive::of(slopes, ends[0][0], ends[1][0]);
            curve.panels = curve.anchors.windows(2).map(panel).collect();
        }
        let power = || Dilute::power(&|n| curve.slope_at(n), start);
        if let Some(mut dilute) = Dilute::series(pressure, kt, start).or_else(power) {
            let constant = curve.integral(dilute.below) - dilute.value(dilute.below);
            dilute.constant = if constant.is_finite() { constant } else { 0.0 };
            curve.dilute = Some(dilute);
        }
        Ok(curve)
    }

    fn slope_at(&self, n: f64) -> f64 {
        let mut out = [0.0];
        self.slope.eval(&[n], &mut out, &mut Vec::new());
        out[0]
    }

    /// The far ends of panels from `first` towards lower (`direction` −1) or higher densities, and ψ there.
    fn anchors_from(&self, first: f64, direction: f64, kt: f64) -> Vec<[f64; 2]> {
        let mut found: Vec<[f64; 2]> = Vec::new();
        let (mut from, mut psi, mut width) = (first, 0.0, WIDEST);
        while found.len() < MOST_PANELS && (from / first).ln().abs() < REACH && width > NARROWEST {
            let to = from * (direction * width).exp();
            let middle = from * (0.5 * direction * width).exp();
            let (whole, _) = self.quadrature(from, to);
            let (near, size_near) = self.quadrature(from, middle);
            let (far, size_far) = self.quadrature(middle, to);
            let size = size_near + size_far + kt * width;
            if ((near + far) - whole).abs() <= ACCURACY * size {
                psi += near + far;
                from = to;
                found.push([to, psi]);
                width = (2.0 * width).min(WIDEST);
            } else {
                // The panel is also halved where the integral is not finite.
                width *= 0.5;
            }
        }
        found
    }

    /// `∫ψ′`, and the quantity that its accuracy is relative to: `∫|ψ′|`, and more where ψ′ is so steep
    /// that the rounding error of ρ matters.
    fn quadrature(&self, from: f64, to: f64) -> (f64, f64) {
        let (nodes, weights) = RULE;
        let at: [f64; POINTS] = std::array::from_fn(|k| from + (to - from) * nodes[k]);
        let mut out = [0.0; 2 * POINTS];
        self.program.eval_block(POINTS, &at, &mut out, &mut Vec::new());
        let (mut sum, mut size) = (0.0, 0.0);
        for k in 0..POINTS {
            let (slope, curvature) = (out[k], out[POINTS + k]);
            sum += weights[k] * slope;
            size += weights[k] * (slope.abs() + ROUNDING * (at[k] * curvature).abs());
        }
        ((to - from) * sum, (to - from).abs() * size)
    }

    /// ψ, by quadrature from the nearest anchor below.
    fn integral(&self, n: f64) -> f64 {
        let after = self.anchors.partition_point(|a| a[0] <= n);
        let Some([from, value]) = after.checked_sub(1).map(|k| self.anchors[k]) else { return f64::NAN };
        match self.panels.get(after - 1) {
            Some(panel) => value + panel.at(n),
            None if from == n => value,
            // Beyond the panels there is a singularity, or no pressure.
            None => f64::NAN,
        }
    }

    /// Computes [`Curve::block`](super::Curve::block); the lists have the length of `n`.
    pub(super) fn block(&self, n: &[f64], to: &mut CurveBlock) {
        to.psi.iter_mut().zip(n).for_each(|(psi, n)| *psi = self.integral(*n));
        let out = [&mut to.slope[..], &mut to.curvature[..]];
        self.program.eval_block_into(n.len(), n, out.into_iter(), &mut to.work);
        let Some(dilute) = &self.dilute else { return };
        for (lane, n) in n.iter().enumerate() {
            if *n < dilute.below && *n >= dilute.from {
                [to.slope[lane], to.curvature[lane]] = dilute.slope(*n);
                to.psi[lane] = dilute.value(*n) + dilute.constant;
            }
        }
    }
}

/// Nodes and weights of Gauss–Legendre quadrature on [0, 1].
const RULE: ([f64; POINTS], [f64; POINTS]) = rule(
    [0.1834346424956498, 0.525532409916329, 0.7966664774136267, 0.9602898564975363],
    [0.362683783378362, 0.3137066458778873, 0.22238103445337448, 0.10122853629037626],
);

/// Builds the rule from the positive half of the rule on [−1, 1].
const fn rule(x: [f64; 4], w: [f64; 4]) -> ([f64; POINTS], [f64; POINTS]) {
    let (mut nodes, mut weights) = ([0.0; POINTS], [0.0; POINTS]);
    let mut k = 0;
    while k < 4 {
        (nodes[k], weights[k]) = (0.5 - 0.5 * x[k], 0.5 * w[k]);
        (nodes[k + 4], weights[k + 4]) = (0.5 + 0.5 * x[k], 0.5 * w[k]);
        k += 1;
    }
    (nodes, weights)
}

/// A power holds below this fraction of the first density: low enough that only one power is left, and
/// high enough that `p − ρkT` keeps its digits.
const PART: f64 = 1e-4;

impl Dilute {
    /// The limit of `slope` as its argument goes to 0, if its values at halved densities converge: with
    /// `s(n) = L + C n^q`, each difference of values at n and n/2 is `2^−q` times the previous
    /// difference. The differences of a logarithm stay equal; those of a pole grow.
    fn power(slope: &dyn Fn(f64) -> f64, start: f64) -> Option<Dilute> {
        let below = PART * start;
        let values: [f64; 5] = std::array::from_fn(|k| slope(below * 0.5f64.powi(k as i32)));
        let steps: [f64; 4] = std::array::from_fn(|k| values[k] - values[k + 1]);
        if steps.iter().any(|step| !step.is_finite() || *step == 0.0) {
            return None;
        }
        let ratios: [f64; 3] = std::array::from_fn(|k| steps[k + 1] / steps[k]);
        let ratio = ratios[0];
        // A power below 0.05 cannot be distinguished from a logarithm.
        let closes_in = ratio > 0.0 && ratio < 0.5f64.powf(0.05);
        if !closes_in || ratios.iter().any(|r| (r - ratio).abs() > 0.02 * ratio) {
            return None;
        }
        let limit = values[0] - steps[0] / (1.0 - ratio);
        let power = -ratio.log2();
        let law = Law::Power { limit, factor: (values[0] - limit) / below.powf(power), power };
        Some(Dilute { law, from: 0.0, below, constant: 0.0 })
    }

    /// Expands ψ at ρ = 0 if the pressure begins with ρkT.
    fn series(pressure: &Formula, kt: f64, start: f64) -> Option<Dilute> {
        let mut derivative = pressure.clone();
        let mut factorial = 1.0;
        let mut taylor = Vec::new();
        for order in 0..TERMS + 2 {
            let value = derivative.value(&[0.0]) / factorial;
            if !value.is_finite() {
                return None;
            }
            taylor.push(value);
            derivative = derivative.derivative(0).ok()?;
            factorial *= (order + 1) as f64;
        }
        if taylor[0] != 0.0 || (taylor[1] - kt).abs() > 4.0 * f64::EPSILON * kt {
            return None;
        }
        let coefficients: [f64; TERMS] = std::array::from_fn(|k| taylor[k + 2]);
        // The last terms estimate the error of the truncated series.
        let negligible = |below: f64| {
            let term = |k: usize| coefficients[k].abs() * below.powi(k as i32);
            let largest = (0..TERMS).map(term).fold(0.0, f64::max);
            term(TERMS - 1) <= 1e-15 * largest && term(TERMS - 2) <= 1e-13 * largest
        };
        let below = (0..40).map(|k| 0.01 * start * 0.25f64.powi(k)).find(|b| negligible(*b))?;
        Some(Dilute { law: Law::Series(coefficients), from: f64::NEG_INFINITY, below, constant: 0.0 })
    }

    /// `ψ` without the constant of integration.
    fn value(&self, n: f64) -> f64 {
        n * match self.law {
            Law::Series(c) => {
                c.iter().enumerate().rev().fold(0.0, |sum, (k, c)| sum * n + c / (k + 1) as f64)
            }
            Law::Power { limit, factor, power } => limit + factor * n.powf(power) / (power + 1.0),
        }
    }

    /// Derivatives `ψ′` and `ψ″`.
    fn slope(&self, n: f64) -> [f64; 2] {
        match self.law {
            Law::Series(c) => {
                let fold = |[value, slope]: [f64; 2], c: &f64| [value * n + c, slope * n + value];
                c.iter().rev().fold([0.0; 2], fold)
            }
            Law::Power { limit, factor, power } => {
                [limit + factor * n.powf(power), power * factor * n.powf(power - 1.0)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Curve, CurveForm};
    use super::*;
    use crate::expression::{Ast, Variables};
    use std::sync::Arc;

    fn curve(text: &str, kt: f64, start: f64) -> Curve {
        let variables = Variables { count: 1, names: [("rho".to_owned(), vec![0])].into() };
        let constants = [("kT".to_owned(), kt)].into();
        let p = Formula::compile(&Ast::parse(text).unwrap(), &constants, &variables).unwrap();
        Curve { density: 0, form: CurveForm::Pressure(Arc::new(Pressure::new(&p, kt, start).unwrap())) }
    }

    /// Compares ψ with its closed form, up to a constant, over many decades and up to a pole.
    #[test]
    fn psi_is_the_integral_of_its_slope() {
        type Psi = fn(f64) -> f64;
        let kt = 0.75;
        let cases: [(&str, Psi, Psi, f64, f64); 4] = [
            ("rho*kT + 10*rho^3", |n| 5.0 * n * n, |n| 10.0 * n, 0.0, 1e3),
            ("2*rho*kT", |n| 0.75 * n.ln(), |n| 0.75 / n, 1e-9, 1e9),
            (
                "rho*kT/(1 - 0.016*rho) - 0.03*rho^2",
                |n| -0.75 * (-0.016 * n).ln_1p() - 0.03 * n,
                |n| 0.75 * 0.016 / (1.0 - 0.016 * n) - 0.03,
                0.0,
                62.49,
            ),
            (
                "rho*kT + 3*rho^2*exp(-rho) + 1",
                |n| -3.0 * (-n).exp() - 1.0 / n,
                |n| 3.0 * (-n).exp() + 1.0 / (n * n),
                1e-3,
                40.0,
            ),
        ];
        for (text, psi, slope, low, high) in cases {
            let curve = curve(text, kt, 3.0);
            let [reference, ..] = curve.at(3.0);
            for k in 0..=300 {
                let n = if low == 0.0 && k == 0 {
                    0.0
                } else {
                    let low = f64::max(low, 1e-12);
                    (low * (high / low).powf(k as f64 / 300.0)).min(high)
                };
                let [value, first, _] = curve.at(n);
                let (expected, expected_slope) = (psi(n) - psi(3.0), slope(n));
                let scale = psi(n).abs().max(psi(3.0).abs()).max(kt);
                assert!(
                    ((value - reference) - expected).abs() < 1e-12 * scale,
                    "{text} at {n}: {value} - {reference} against {expected}"
                );
                let scale = expected_slope.abs() + 1e-3;
                assert!((first - expected_slope).abs() < 1e-11 * scale, "{text} at {n}: {first}");
            }
        }
    }

    #[test]
    fn singular_densities_are_not_numbers() {
        let vdw = curve("rho*kT/(1 - 0.016*rho) - 0.03*rho^2", 1.0, 1.0);
        assert!(vdw.at(62.6)[0].is_nan());
        assert!(vdw.at(-1.0)[0].is_finite(), "the series holds on both sides of zero");
        let singular = curve("2*rho*kT", 1.0, 1.0);
        assert!(!singular.at(0.0)[1].is_finite());
        assert!(curve("ln(-1 - rho^2)", 1.0, 1.0).at(1.0)[0].is_nan());
    }

    #[test]
    fn broken_powers_have_their_limit_at_zero() {
        // With ψ′ = 0.9 ρ^0.6 and ψ = 0.9/1.6 ρ^1.6 an isolated particle has a finite energy.
        let broken = curve("rho*kT + 0.9*rho^2.6", 1.0, 1.0);
        let [origin, slope, _] = broken.at(0.0);
        assert!(slope.abs() < 1e-9, "{slope}");
        for n in [1e-9, 1e-6, 9.9e-5, 1.01e-4, 0.01, 3.0f64] {
            let [psi, slope, _] = broken.at(n);
            // The slope has the digits that `p − ρkT` has where the tail begins, and ψ the digits of its constant.
            let expected = 0.9 * n.powf(0.6);
            assert!((slope - expected).abs() < 1e-6 * expected + 1e-10, "{n}: {slope}");
            let expected = 0.9 / 1.6 * n.powf(1.6);
            assert!((psi - origin - expected).abs() < 1e-6 * expected + 1e-14, "{n}: {psi}");
        }
        // The slope has a limit other than zero, and approaches it with two powers.
        let two = curve("rho*kT + 3*rho^2 + rho^2.5 + rho^3.2", 0.7, 1.0);
        assert!((two.at(0.0)[1] - 3.0).abs() < 1e-4, "{:?}", two.at(0.0));
        assert!((two.at(0.9999e-4)[1] - two.at(1.0001e-4)[1]).abs() < 1e-5);
    }

    #[test]
    fn what_has_no_limit_keeps_none() {
        for singular in ["2*rho*kT + rho^2.6", "rho*kT + rho^2*ln(rho)", "rho*kT + rho^1.9"] {
            assert!(!curve(singular, 1.0, 1.0).at(0.0)[1].is_finite(), "{singular}");
        }
    }

    #[test]
    fn curvature_is_the_derivative_of_the_slope() {
        let curve = curve("rho*kT/(1 - 0.05*rho) + rho^2*(2 - rho)", 1.0, 1.0);
        for n in [1e-5, 0.004, 0.3, 2.0, 9.0] {
            let h = 1e-4 * n;
            let numeric = (curve.at(n + h)[1] - curve.at(n - h)[1]) / (2.0 * h);
            assert!((numeric - curve.at(n)[2]).abs() < 1e-6, "{n}: {numeric}");
        }
    }
}
