//! ψ with first and second derivatives, one particle at a time, by the definition. Tests compare
//! [`ExcessPlan`](crate::engine::excess::ExcessPlan), which evaluates blocks of particles, with it.

use crate::model::expression::{Formula, Program, TooLarge};
use crate::model::{Bounds, Continuation, ExcessFreeEnergy, Fluid};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// The free energies of a fluid and their derivatives.
#[derive(Debug)]
pub struct FreeEnergies {
    species: Vec<Excess>,
}

/// The free energy ψ of one species.
#[derive(Debug)]
struct Excess {
    /// Computes ψ, its slopes, then its second derivatives row by row, the upper triangle; `None`
    /// for a curve and for stated slopes.
    program: Option<Program>,
    /// Derivatives by the order in each variable; used for variables out of bounds.
    derivatives: RefCell<BTreeMap<Vec<u8>, Formula>>,
}

/// ψ of particles with derivatives by their uncorrected densities, particle by particle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Psi {
    /// Values ψ.
    pub value: Vec<f64>,
    /// Slopes ∂ψ/∂n_v.
    pub slopes: Vec<f64>,
    /// Second derivatives ∂²ψ/∂n_v∂n_u, a full matrix by rows.
    pub second: Vec<f64>,
}

/// Scratch arrays for one particle.
#[derive(Default)]
struct Scratch {
    /// Corrected densities, and their first two derivatives by the uncorrected ones.
    corrected: Vec<[f64; 3]>,
    at: Vec<f64>,
    values: Vec<f64>,
    work: Vec<f64>,
}

impl FreeEnergies {
    /// Computes the derivatives of the fluid's formulas.
    ///
    /// # Errors
    /// Fails if a derivative grows beyond the limits of the formula engine.
    pub fn new(fluid: &Fluid) -> Result<FreeEnergies, TooLarge> {
        let count = fluid.variables();
        let mut species = Vec::new();
        for excess in &fluid.excess {
            let (program, derivatives) = match excess {
                ExcessFreeEnergy::Curve(_) | ExcessFreeEnergy::Slopes(_) => (None, BTreeMap::new()),
                ExcessFreeEnergy::Formula(psi) => {
                    let slopes =
                        (0..count).map(|v| psi.derivative(v)).collect::<Result<Vec<_>, TooLarge>>()?;
                    let mut outputs = vec![psi.clone()];
                    outputs.extend(slopes.iter().cloned());
                    for (v, slope) in slopes.iter().enumerate() {
                        for u in v..count {
                            outputs.push(slope.derivative(u)?);
                        }
                    }
                    let program = Program::new(&outputs.iter().collect::<Vec<_>>());
                    (Some(program), BTreeMap::from([(vec![0; count], psi.clone())]))
                }
            };
            species.push(Excess { program, derivatives: RefCell::new(derivatives) });
        }
        Ok(FreeEnergies { species })
    }

    /// ψ of particles with one species each, at their uncorrected densities, density-major.
    pub fn psi(&self, fluid: &Fluid, species: &[i32], densities: &[f64]) -> Psi {
        let (variables, mut scratch) = (fluid.variables(), Scratch::default());
        let mut psi = Psi {
            value: vec![0.0; species.len()],
            slopes: vec![0.0; species.len() * variables],
            second: vec![0.0; species.len() * variables * variables],
        };
        for (k, alpha) in species.iter().enumerate() {
            let of = k * variables..(k + 1) * variables;
            let second = of.start * variables..of.end * variables;
            let (slopes, second) = (&mut psi.slopes[of.clone()], &mut psi.second[second]);
            psi.value[k] = self.one(fluid, *alpha as usize, &densities[of], [slopes, second], &mut scratch);
        }
        psi
    }

    /// Computes ψ of one particle; slopes and second derivatives must be zero before.
    fn one(
        &self,
        fluid: &Fluid,
        alpha: usize,
        n: &[f64],
        [slopes, second]: [&mut [f64]; 2],
        scratch: &mut Scratch,
    ) -> f64 {
        let (count, variables) = (fluid.species.len(), n.len());
        let correction = |v: usize| &fluid.densities[v / count].correction[alpha * count + v % count];
        scratch.corrected.clear();
        scratch.corrected.extend((0..variables).map(|v| polynomial(&correction(v).0, n[v])));
        scratch.at.clear();
        scratch.at.extend(scratch.corrected.iter().map(|c| c[0]));
        let at = &scratch.at[..];
        let value = match &fluid.excess[alpha] {
            ExcessFreeEnergy::Curve(curve) => {
                let range = curve.density * count..(curve.density + 1) * count;
                let total = at[range.clone()].iter().sum();
                let [value, slope, curvature] =
                    continued_curve(|x| curve.at(x), fluid.densities[curve.density].bounds, total);
                for v in range.clone() {
                    slopes[v] = slope;
                    range.clone().for_each(|u| second[v * variables + u] = curvature);
                }
                value
            }
            ExcessFreeEnergy::Formula(_) => {
                let Scratch { values, work, .. } = scratch;
                self.species[alpha].formula(fluid, at, [slopes, second], [values, work])
            }
            // There is no ψ: the energy and the slopes are stated. Measurements of such models need no second derivatives.
            ExcessFreeEnergy::Slopes(law) => {
                slopes.iter_mut().zip(&law.slopes).for_each(|(to, slope)| *to = slope.value(at));
                law.energy.value(at)
            }
        };
        let corrected = &scratch.corrected;
        for v in 0..variables {
            for u in 0..variables {
                second[v * variables + u] *= corrected[v][1] * corrected[u][1];
            }
            second[v * variables + v] += slopes[v] * corrected[v][2];
        }
        slopes.iter_mut().zip(corrected).for_each(|(slope, c)| *slope *= c[1]);
        value
    }
}

impl Excess {
    fn formula(
        &self,
        fluid: &Fluid,
        at: &[f64],
        [slopes, second]: [&mut [f64]; 2],
        [values, work]: [&mut Vec<f64>; 2],
    ) -> f64 {
        let variables = at.len();
        let inside = (0..variables).all(|v| beyond(fluid, v, at).0 == 0.0);
        if let Some(program) = self.program.as_ref().filter(|_| inside) {
            values.resize(program.outputs(), 0.0);
            program.eval(at, values, work);
            slopes.copy_from_slice(&values[1..=variables]);
            let mut next = 1 + variables;
            for v in 0..variables {
                for u in v..variables {
                    second[v * variables + u] = values[next];
                    second[u * variables + v] = values[next];
                    next += 1;
                }
            }
            return values[0];
        }
        let mut order = vec![0u8; variables];
        let value = self.continued(fluid, &mut order.clone(), at, 0);
        for v in 0..variables {
            order[v] += 1;
            slopes[v] = self.continued(fluid, &mut order.clone(), at, 0);
            for u in 0..variables {
                order[u] += 1;
                second[v * variables + u] = self.continued(fluid, &mut order.clone(), at, 0);
                order[u] -= 1;
            }
            order[v] -= 1;
        }
        value
    }

    /// The derivative `order` of ψ, continued in the variables from `v` on: outside a bound ψ is `Σ_k
    /// δ^k/k! ∂^kψ`, k up to 1 or 2, with the derivatives at the bound.
    fn continued(&self, fluid: &Fluid, order: &mut Vec<u8>, at: &[f64], v: usize) -> f64 {
        if v == at.len() {
            let edge: Vec<f64> = (0..at.len()).map(|v| at[v] - beyond(fluid, v, at).0).collect();
            return derivative(&self.derivatives, order).map_or(f64::NAN, |f| f.value(&edge));
        }
        let (delta, highest) = beyond(fluid, v, at);
        if delta == 0.0 {
            return self.continued(fluid, order, at, v + 1);
        }
        let asked = order[v];
        let (mut sum, mut weight) = (0.0, 1.0);
        for k in asked..=highest {
            order[v] = k;
            sum += weight * self.continued(fluid, order, at, v + 1);
            weight *= delta / (k - asked + 1) as f64;
        }
        order[v] = asked;
        sum
    }
}

/// The distance of variable `v` from its bounds, and the highest power of this distance in ψ.
fn beyond(fluid: &Fluid, v: usize, at: &[f64]) -> (f64, u8) {
    let Some(bounds) = fluid.densities[v / fluid.species.len()].bounds else { return (0.0, 2) };
    let delta = bounds.beyond(at[v]);
    (delta, if delta < 0.0 && bounds.below == Continuation::Constant { 1 } else { 2 })
}

/// ψ, ψ′ and ψ″ of a curve, continued outside the bounds of its density.
fn continued_curve(curve: impl Fn(f64) -> [f64; 3], bounds: Option<Bounds>, total: f64) -> [f64; 3] {
    let Some(bounds) = bounds else { return curve(total) };
    let [psi, slope, mut second] = curve(bounds.clamp(total));
    let delta = bounds.beyond(total);
    if delta < 0.0 && bounds.below == Continuation::Constant {
        second = 0.0;
    }
    [psi + delta * slope + 0.5 * delta * delta * second, slope + delta * second, second]
}

fn derivative(known: &RefCell<BTreeMap<Vec<u8>, Formula>>, order: &[u8]) -> Option<Formula> {
    if let Some(formula) = known.borrow().get(order) {
        return Some(formula.clone());
    }
    let v = order.iter().rposition(|m| *m > 0)?;
    let mut less = order.to_vec();
    less[v] -= 1;
    let formula = derivative(known, &less)?.derivative(v).ok()?;
    known.borrow_mut().insert(order.to_vec(), formula.clone());
    Some(formula)
}

/// The value and the first two derivatives of a polynomial.
fn polynomial(coefficients: &[f64], x: f64) -> [f64; 3] {
    coefficients.iter().rev().fold([0.0; 3], |[value, slope, second], c| {
        [value * x + c, slope * x + value, second * x + 2.0 * slope]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    /// Compares slopes and second derivatives with differences, within bounds, beyond one and beyond both.
    #[test]
    fn derivatives_of_psi_are_derivatives() {
        let model = Model::parse(
            "m.toml",
            r#"
title = "m"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 1.0
bounds = [0.5, 3.0]
correction = { "A|A" = [0.1, 1.1, 0.02], "A|B" = [0.0, 1.0], "B|A" = [0.2, 0.9], "B|B" = [0.0, 1.0, 0.01] }
[excess_free_energy]
A = "kT*n_A*ln(n_A) + 0.3*n_A^2*n_B + n_B^3"
B = "n^3 + sqrt(n_A)*n_B^2"
"#,
        )
        .unwrap();
        let fluid = model.at(1.3).unwrap();
        let energies = FreeEnergies::new(&fluid).unwrap();
        for alpha in 0..2 {
            for n in [[1.0, 1.2], [0.1, 1.0], [5.0, 0.2], [4.0, 6.0], [0.2, 0.1]] {
                let psi = energies.psi(&fluid, &[alpha], &n);
                let h = 1e-5;
                for v in 0..2 {
                    let moved = |h: f64| {
                        let mut n = n;
                        n[v] += h;
                        energies.psi(&fluid, &[alpha], &n)
                    };
                    let (up, down) = (moved(h), moved(-h));
                    let slope = (up.value[0] - down.value[0]) / (2.0 * h);
                    assert!((slope - psi.slopes[v]).abs() < 1e-7 * (1.0 + slope.abs()), "{alpha} {n:?} {v}");
                    for u in 0..2 {
                        let second = (up.slopes[u] - down.slopes[u]) / (2.0 * h);
                        let found = psi.second[v * 2 + u];
                        assert!((second - found).abs() < 1e-6 * (1.0 + second.abs()), "{alpha} {n:?} {v}{u}");
                    }
                }
            }
        }
    }
}
