//! ψ and its derivatives, as the theory needs them: the one place that knows how a fluid stores its
//! excess free energies.

use super::TheoryError;
use crate::model::curve::Curve;
use crate::model::expression::{Formula, Program};
use crate::model::{ExcessFreeEnergy, Fluid};

/// The `ψ_α` of a fluid with exact first and second derivatives.
#[derive(Debug, Clone)]
pub struct FreeEnergy {
    species: usize,
    variables: usize,
    excess: Vec<Excess>,
}

/// `ψ_α` of one species.
#[derive(Debug, Clone)]
enum Excess {
    /// ψ, its gradient, and the upper triangle of its Hessian.
    Formula(Program),
    /// A function of the total of one density.
    Curve(Curve),
}

/// `ψ_α` at one point.
#[derive(Debug, Clone)]
pub struct Psi {
    /// `ψ_α`.
    pub value: f64,
    /// `∂ψ_α/∂x_v`.
    pub gradient: Vec<f64>,
    /// `∂²ψ_α/∂x_u∂x_v`, row-major.
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
                    .map(Excess::Formula)
                    .map_err(|_| TheoryError::TooLarge(name.clone())),
                ExcessFreeEnergy::Curve(curve) => Ok(Excess::Curve(curve.clone())),
                ExcessFreeEnergy::Slopes(_) => Err(TheoryError::NoFreeEnergy(name.clone())),
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(FreeEnergy { species: fluid.species.len(), variables, excess })
    }

    /// `ψ_α` of species `alpha` at the corrected densities `x`, density-major.
    pub fn at(&self, alpha: usize, x: &[f64]) -> Psi {
        match &self.excess[alpha] {
            Excess::Formula(program) => self.of_formula(program, x),
            Excess::Curve(curve) => self.of_curve(curve, x),
        }
    }

    fn of_curve(&self, curve: &Curve, x: &[f64]) -> Psi {
        let n = self.variables;
        let own = curve.density * self.species..(curve.density + 1) * self.species;
        let [value, slope, curvature] = curve.at(x[own.clone()].iter().sum());
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
        let mut hessian = vec![0.0; n * n];
        let mut next = 1 + n;
        for u in 0..n {
            for v in u..n {
                hessian[u * n + v] = out[next];
                hessian[v * n + u] = out[next];
                next += 1;
            }
        }
        Psi { value: out[0], gradient: out[1..=n].to_vec(), hessian }
    }
}

fn differentiated(psi: &Formula, variables: usize) -> Result<Program, crate::model::expression::TooLarge> {
    let mut formulas = vec![psi.clone()];
    for v in 0..variables {
        formulas.push(psi.derivative(v)?);
    }
    for u in 0..variables {
        for v in u..variables {
            formulas.push(formulas[1 + u].derivative(v)?);
        }
    }
    Ok(Program::new(&formulas.iter().collect::<Vec<_>>()))
}
