//! ψ and its derivatives for the theory. Only this module of the theory knows how a fluid stores its
//! excess free energies, and how they continue beyond the bounds of a density.

use super::TheoryError;
use crate::model::curve::Curve;
use crate::model::expression::{Expansion, Formula, Program, TooLarge};
use crate::model::{Bounds, ExcessFreeEnergy, Fluid};

/// The `ψ_α` of a fluid with exact first and second derivatives.
#[derive(Debug, Clone)]
pub struct FreeEnergy {
    species: usize,
    variables: usize,
    /// Bounds of each density.
    bounds: Vec<Option<Bounds>>,
    excess: Vec<Excess>,
}

/// The free energy `ψ_α` of one species.
#[derive(Debug, Clone)]
enum Excess {
    /// ψ, its gradient, and the upper triangle of its Hessian.
    Formula { program: Program, outputs: Vec<Formula> },
    /// A function of the total of one density.
    Curve(Curve),
}

/// Value and derivatives of `ψ_α` at one point.
#[derive(Debug, Clone)]
pub struct Psi {
    /// Value `ψ_α`.
    pub value: f64,
    /// Gradient `∂ψ_α/∂x_v`.
    pub gradient: Vec<f64>,
    /// Second derivatives `∂²ψ_α/∂x_u∂x_v`, row-major.
    pub hessian: Vec<f64>,
}

impl FreeEnergy {
    /// The free energies of `fluid`.
    pub fn new(fluid: &Fluid) -> Result<FreeEnergy, TheoryError> {
        let variables = fluid.variables();
        let excess = fluid
            .excess
            .iter()
            .zip(&fluid.species)
            .map(|(excess, name)| match excess {
                ExcessFreeEnergy::Formula(psi) => differentiated(psi, variables)
                    .map(|outputs| Excess::Formula {
                        program: Program::new(&outputs.iter().collect::<Vec<_>>()),
                        outputs,
                    })
                    .map_err(|_| TheoryError::TooLarge(name.clone())),
                ExcessFreeEnergy::Curve(curve) => Ok(Excess::Curve(curve.clone())),
                ExcessFreeEnergy::Slopes(_) => Err(TheoryError::NoFreeEnergy(name.clone())),
            })
            .collect::<Result<Vec<_>, _>>()?;
        let bounds = fluid.densities.iter().map(|d| d.bounds).collect();
        Ok(FreeEnergy { species: fluid.species.len(), variables, bounds, excess })
    }

    /// `ψ_α` of species `alpha` at the corrected densities `x`, density-major, continued where these are out of bounds.
    pub fn at(&self, alpha: usize, x: &[f64]) -> Psi {
        match &self.excess[alpha] {
            Excess::Formula { program, outputs } => {
                let strays = self.strays(outputs, x);
                if strays.is_empty() {
                    self.of_formula(program, x)
                } else {
                    self.continued(outputs, &strays, x)
                }
            }
            Excess::Curve(curve) => self.of_curve(curve, x),
        }
    }

    /// The value of `ψ_α` only.
    pub fn value(&self, alpha: usize, x: &[f64]) -> f64 {
        match &self.excess[alpha] {
            Excess::Formula { outputs, .. } => {
                let strays = self.strays(outputs, x);
                if strays.is_empty() {
                    outputs[0].value(x)
                } else {
                    self.continued(outputs, &strays, x).value
                }
            }
            Excess::Curve(curve) => self.of_curve(curve, x).value,
        }
    }

    fn of_curve(&self, curve: &Curve, x: &[f64]) -> Psi {
        let n = self.variables;
        let own = curve.density * self.species..(curve.density + 1) * self.species;
        let total = x[own.clone()].iter().sum();
        let [value, slope, curvature] = match self.bounds[curve.density] {
            Some(bounds) if bounds.beyond(total) != 0.0 => {
                let [psi, slope, curvature] = curve.at(bounds.clamp(total));
                let delta = bounds.beyond(total);
                let curvature = if bounds.order(delta) == 2 { curvature } else { 0.0 };
                [psi + delta * (slope + 0.5 * delta * curvature), slope + delta * curvature, curvature]
            }
            _ => curve.at(total),
        };
        let mut psi = Psi { value, gradient: vec![0.0; n], hessian: vec![0.0; n * n] };
        for u in own.clone() {
            psi.gradient[u] = slope;
            for v in own.clone() {
                psi.hessian[u * n + v] = curvature;
            }
        }
        psi
    }

    fn of_formula(&self, program: &Program, x: &[f64]) -> Psi {
        let n = self.variables;
        let mut out = vec![0.0; 1 + n + n * (n + 1) / 2];
        program.eval(x, &mut out, &mut Vec::new());
        Psi { value: out[0], gradient: out[1..=n].to_vec(), hessian: symmetric(n, &out[1 + n..]) }
    }

    /// The variables out of bounds in which ψ is not linear.
    fn strays(&self, outputs: &[Formula], x: &[f64]) -> Vec<Stray> {
        let stray = |v: usize| {
            let bounds = self.bounds[v / self.species]?;
            let beyond = bounds.beyond(x[v]);
            // A linear ψ needs no continuation.
            let goes_on = beyond == 0.0 || outputs[1 + v].is_constant().is_some();
            (!goes_on).then(|| Stray { variable: v, beyond, order: bounds.order(beyond) })
        };
        (0..self.variables).filter_map(stray).collect()
    }

    /// The continuation of [`Bounds`]: a polynomial of second order in each variable that is out of
    /// bounds, whose coefficients are ψ and its derivatives at the bounds.
    fn continued(&self, outputs: &[Formula], strays: &[Stray], x: &[f64]) -> Psi {
        let n = self.variables;
        let mut edge = x.to_vec();
        strays.iter().for_each(|s| edge[s.variable] -= s.beyond);
        let along: Vec<usize> = strays.iter().map(|s| s.variable).collect();
        let mut expansion = Expansion::default();
        // Derivatives with respect to strays are those of the polynomial, the others those of its coefficients.
        let mut derivative = |by: &[usize]| -> f64 {
            let others: Vec<usize> = by.iter().copied().filter(|v| !along.contains(v)).collect();
            let output = match others[..] {
                [] => 0,
                [u] => 1 + u,
                [u, v, ..] => 1 + n + u * n - u * (u + 1) / 2 + v,
            };
            let powers: Vec<usize> = along.iter().map(|v| by.iter().filter(|u| *u == v).count()).collect();
            polynomial(expansion.coefficients(&outputs[output], &edge, &along), strays, &powers)
        };
        let value = derivative(&[]);
        let gradient = (0..n).map(|u| derivative(&[u])).collect();
        let pairs = (0..n).flat_map(|u| (u..n).map(move |v| [u, v]));
        let hessian: Vec<f64> = pairs.map(|pair| derivative(&pair)).collect();
        Psi { value, gradient, hessian: symmetric(n, &hessian) }
    }
}

/// A variable that is out of bounds.
struct Stray {
    variable: usize,
    beyond: f64,
    /// The highest power of `beyond` in the continuation.
    order: usize,
}

/// The derivative of `Σ c_m Π δ_k^{m_k}`, of order `derivative[k]` with respect to each `δ_k`.
fn polynomial(coefficients: &[f64], strays: &[Stray], derivative: &[usize]) -> f64 {
    let mut sum = 0.0;
    for (index, coefficient) in coefficients.iter().enumerate() {
        let mut rest = index;
        let mut term = *coefficient;
        for (stray, times) in strays.iter().zip(derivative) {
            let power = rest % 3;
            rest /= 3;
            if power > stray.order || power < *times {
                // The term is set to zero, as 0 times an infinite coefficient would be NaN.
                term = 0.0;
                continue;
            }
            let factor: usize = (power - times + 1..=power).product();
            term *= factor as f64 * stray.beyond.powi((power - times) as i32);
        }
        sum += term;
    }
    sum
}

/// A symmetric matrix from its upper triangle, row by row.
fn symmetric(n: usize, triangle: &[f64]) -> Vec<f64> {
    let mut matrix = vec![0.0; n * n];
    let pairs = (0..n).flat_map(|u| (u..n).map(move |v| [u, v]));
    for ([u, v], entry) in pairs.zip(triangle) {
        matrix[u * n + v] = *entry;
        matrix[v * n + u] = *entry;
    }
    matrix
}

/// Most operations of all second derivatives of one ψ: more take seconds for each state.
const MOST_OPERATIONS: usize = 20_000;

/// ψ, its gradient, and the upper triangle of its Hessian.
fn differentiated(psi: &Formula, variables: usize) -> Result<Vec<Formula>, TooLarge> {
    let mut formulas = vec![psi.clone()];
    for v in 0..variables {
        formulas.push(psi.derivative(v)?);
    }
    let mut operations = 0;
    for u in 0..variables {
        for v in u..variables {
            let second = formulas[1 + u].derivative(v)?;
            operations += second.operations();
            if operations > MOST_OPERATIONS {
                return Err(TooLarge);
            }
            formulas.push(second);
        }
    }
    Ok(formulas)
}
