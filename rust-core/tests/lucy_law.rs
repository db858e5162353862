//! Compares the law of LAMMPS's `mdpd` with its formula.

use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::{WarrenPair, lucy_mdpd};
use psidpd_core::truth::conservative as evaluate;
use std::f64::consts::PI;

fn pair(a: f64, b: f64, rc: f64, rd: f64) -> Option<WarrenPair> {
    Some(WarrenPair { a, b, gamma: 4.5, rc, rd, weight: None })
}

/// Compares the forces on three particles with the law as it is written above.
#[test]
fn forces_are_those_of_the_formula() {
    let table =
        [pair(-40.0, 25.0, 1.0, 0.75), pair(-30.0, 20.0, 0.9, 0.8), None, pair(-20.0, -15.0, 1.0, 0.75)];
    let masses = [1.0, 2.5];
    for dimensions in [2, 3] {
        let model = lucy_mdpd(&["A".into(), "B".into()], &table, &masses, dimensions).unwrap();
        let fluid = model.at(1.0).unwrap();
        assert!(!fluid.is_conservative());
        assert_eq!(fluid.stated_slopes(), Some("A"));
        let x = [[0.0, 0.0, 0.0], [0.4, 0.3, 0.0], [0.0, 0.6, 0.0]];
        let kinds = [0, 1, 1];
        let domain = PeriodicBox::orthogonal([-5.0; 3], [10.0; 3], [false; 3]).unwrap();
        let found = evaluate(&fluid, &x, &kinds, &domain).unwrap().forces;

        let of = |i: usize, j: usize| match kinds[i] + kinds[j] {
            0 => table[0].unwrap(),
            1 => table[1].unwrap(),
            _ => table[3].unwrap(),
        };
        let distance = |i: usize, j: usize| f64::hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
        let lucy = |r: f64, h: f64| {
            let s = (r / h).min(1.0);
            105.0 / (16.0 * PI * h.powi(3)) * (1.0 + 3.0 * s) * (1.0 - s).powi(3)
        };
        let others = |i: usize| (0..3).filter(move |j| *j != i);
        let rho: Vec<f64> = (0..3)
            .map(|i| others(i).map(|j| masses[kinds[j]] * lucy(distance(i, j), of(i, j).rd)).sum())
            .collect();
        for i in 0..3 {
            let mut force = [0.0; 2];
            for j in others(i) {
                let (c, r) = (of(i, j), distance(i, j));
                let reach = |range: f64| (1.0 - r / range).max(0.0);
                let f = c.a * reach(c.rc) + c.b * (rho[i] + rho[j]) * reach(c.rd);
                (0..2).for_each(|k| force[k] += f * (x[i][k] - x[j][k]) / r);
            }
            for k in 0..2 {
                assert!((found[i][k] - force[k]).abs() < 1e-11, "{:?} {force:?}", found[i]);
            }
        }
    }
}

/// If all coefficients are equal the reported energy is Warren's ψ at these densities.
#[test]
fn equal_coefficients_report_the_energy_of_warren() {
    let names = ["A".into(), "B".into()];
    let model = lucy_mdpd(&names, &[pair(-40.0, 25.0, 1.0, 0.75); 4], &[1.0; 2], 3).unwrap();
    let x = [[0.0; 3], [0.3, 0.1, 0.2], [0.2, -0.3, 0.1]];
    let domain = PeriodicBox::orthogonal([-5.0; 3], [10.0; 3], [false; 3]).unwrap();
    let all = evaluate(&model.at(1.0).unwrap(), &x, &[0, 1, 1], &domain).unwrap();
    let psi = |n: &[f64]| PI / 30.0 * 0.75f64.powi(4) * 25.0 * (n[0] + n[1]).powi(2);
    let mut energy: f64 = all.densities.chunks_exact(2).map(psi).sum();
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let r = (0..3).map(|k| (x[i][k] - x[j][k]).powi(2)).sum::<f64>().sqrt();
        energy += -20.0 * (1.0 - r).powi(2);
    }
    assert!((all.energy - energy).abs() < 1e-11, "{} {energy}", all.energy);
}
