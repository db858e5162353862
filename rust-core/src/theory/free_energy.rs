//! ψ and its derivatives, as the theory needs them: the one place that knows how a fluid stores its
//! excess free energies.

use super::TheoryError;
use crate::model::expression::{Formula, Program};
use crate::model::{ExcessFreeEnergy, Fluid};

/// The `ψ_α` of a fluid with exact first and second derivatives.
#[derive(Debug, Clone)]
pub struct FreeEnergy {
    variables: usize,
    /// Of each species: ψ, its gradient, and the upper triangle of its Hessian.
    programs: Vec<Program>,
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
        let programs = fluid
            .excess
            .iter()
            .zip(&fluid.species)
            .map(|(excess, name)| {
                let ExcessFreeEnergy::Formula(psi) = excess;
                differentiated(psi, variables).map_err(|_| TheoryError::TooLarge(name.clone()))
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(FreeEnergy { variables, programs })
    }

    /// `ψ_α` of species `alpha` at the corrected densities `x`, density-major.
    pub fn at(&self, alpha: usize, x: &[f64]) -> Psi {
        let n = self.variables;
        let mut out = vec![0.0; 1 + n + n * (n + 1) / 2];
        self.programs[alpha].eval(x, &mut out, &mut Vec::new());
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
