//! ψ of particles with first and second derivatives by their uncorrected densities. Tests compare
//! [`ExcessPlan`](crate::engine::excess::ExcessPlan), which evaluates blocks of particles, with it.

use crate::free_energy::{self, FreeEnergy};
use crate::model::Fluid;

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

/// ψ of particles with one species each, at their uncorrected densities, density-major.
pub fn psi(free_energy: &FreeEnergy, fluid: &Fluid, species: &[i32], densities: &[f64]) -> Psi {
    let (count, variables) = (fluid.species.len(), fluid.variables());
    let room = |per_particle: usize| Vec::with_capacity(species.len() * per_particle);
    let mut psi = Psi { value: room(1), slopes: room(variables), second: room(variables * variables) };
    let (mut one, mut work) = (free_energy::Psi::default(), free_energy::Work::default());
    let (mut corrected, mut at) = (Vec::new(), Vec::new());
    for (k, alpha) in species.iter().map(|alpha| *alpha as usize).enumerate() {
        let n = &densities[k * variables..][..variables];
        let correction = |v: usize| &fluid.densities[v / count].correction[alpha * count + v % count];
        corrected.clear();
        corrected.extend((0..variables).map(|v| polynomial(&correction(v).0, n[v])));
        at.clear();
        at.extend(corrected.iter().map(|[value, ..]| *value));
        free_energy.evaluate(alpha, &at, &mut one, &mut work);
        psi.value.push(one.value);
        psi.slopes.extend(one.gradient.iter().zip(&corrected).map(|(slope, [_, first, _])| slope * first));
        for v in 0..variables {
            for u in 0..variables {
                let curved = if u == v { one.gradient[v] * corrected[v][2] } else { 0.0 };
                psi.second
                    .push(one.hessian[v * variables + u] * (corrected[v][1] * corrected[u][1]) + curved);
            }
        }
    }
    psi
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
        let energies = FreeEnergy::new(&fluid, usize::MAX).unwrap();
        for alpha in 0..2 {
            for n in [[1.0, 1.2], [0.1, 1.0], [5.0, 0.2], [4.0, 6.0], [0.2, 0.1]] {
                let here = psi(&energies, &fluid, &[alpha], &n);
                let h = 1e-5;
                for v in 0..2 {
                    let moved = |h: f64| {
                        let mut n = n;
                        n[v] += h;
                        psi(&energies, &fluid, &[alpha], &n)
                    };
                    let (up, down) = (moved(h), moved(-h));
                    let slope = (up.value[0] - down.value[0]) / (2.0 * h);
                    assert!((slope - here.slopes[v]).abs() < 1e-7 * (1.0 + slope.abs()), "{alpha} {n:?} {v}");
                    for u in 0..2 {
                        let second = (up.slopes[u] - down.slopes[u]) / (2.0 * h);
                        let found = here.second[v * 2 + u];
                        assert!((second - found).abs() < 1e-6 * (1.0 + second.abs()), "{alpha} {n:?} {v}{u}");
                    }
                }
            }
        }
    }
}
