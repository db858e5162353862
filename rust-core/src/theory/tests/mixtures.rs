use super::*;

#[test]
fn symmetric_mixture() {
    let (lambda, lambda_a, rho) = (1.0, 0.2, 10.0);
    let family = |kt: f64| Ok(mixture(2, lambda, lambda_a, lambda_a).at(kt)?);
    let critical = composition_critical_point(&family, rho, [1.0, 50.0]).unwrap();
    close(critical.parameter, rho * (lambda - lambda_a), 1e-12);
    close(critical.composition, 0.5, 1e-6);
    // The pressure is ρkT + ρ²(2λ c(1−c) + λ_A c² + λ_A (1−c)²).
    close(critical.pressure, rho * 8.0 + rho * rho * (lambda + lambda_a) / 2.0, 1e-9);

    let reduced = 0.5;
    let mf = theory(&mixture(2, lambda, lambda_a, lambda_a), reduced * 8.0);
    let spinodal = mf.composition_spinodal(rho).unwrap();
    // With det f = 0, (kT/cρ + 2λ_A)(kT/(1−c)ρ + 2λ_A) = 4λ², and so c(1−c) = 1/12 here.
    assert_eq!(spinodal.len(), 1);
    close(spinodal[0][0], 0.5 - (1.0f64 / 6.0).sqrt(), 1e-12);
    close(spinodal[0][1], 0.5 + (1.0f64 / 6.0).sqrt(), 1e-12);
    for c in spinodal[0] {
        let f = mf.second_derivatives(&[c * rho, (1.0 - c) * rho]);
        assert!((f[0] * f[3] - f[1] * f[2]).abs() < 1e-10, "{f:?}");
    }
    let phases = mf.composition_binodal(rho).unwrap();
    // The phases fulfil ln((1−c)/c) = 2 T_c/T (1 − 2c).
    let c = phases.composition[0];
    close(((1.0 - c) / c).ln(), 2.0 / reduced * (1.0 - 2.0 * c), 1e-11);
    close(phases.composition[1], 1.0 - c, 1e-11);
    close(phases.pressure[0], phases.pressure[1], 1e-11);
    // The symmetric phases have equal pressure too.
    let same = mf.composition_binodal_at_pressure(phases.pressure[0]).unwrap();
    close(same.composition[0], c, 1e-8);
    close(same.density[0], rho, 1e-9);
    close(same.pressure[1], phases.pressure[0], 1e-9);
    // At fixed pressure the spinodal is where the determinant of f is zero.
    for c in mf.composition_spinodal_at_pressure(phases.pressure[0]).unwrap()[0] {
        let total = mf.densities_at_pressure(&[c, 1.0 - c], phases.pressure[0])[0];
        let s = mf.smallest_inverse_structure_factor(&[c * total, (1.0 - c) * total], 0.0);
        assert!(s.abs() < 1e-10, "{s}");
    }
    let unstable = mf.stability(&[5.0, 5.0]);
    assert!(unstable.spinodal && !unstable.stable);
}

#[test]
fn asymmetric_mixture_at_fixed_pressure_has_equal_potentials() {
    let mf = theory(&mixture(3, 1.0, 0.2, 0.4), 2.0);
    let phases = mf.composition_binodal_at_pressure(80.0).unwrap();
    let mu = [0, 1].map(|i| {
        let (c, rho) = (phases.composition[i], phases.density[i]);
        mf.chemical_potentials(&[c * rho, (1.0 - c) * rho])
    });
    for (first, second) in mu[0].iter().zip(&mu[1]) {
        close(*first, *second, 1e-10);
    }
    close(phases.pressure[0], 80.0, 1e-10);
    close(phases.pressure[1], 80.0, 1e-10);
    assert!((phases.density[0] - phases.density[1]).abs() > 0.1);
}

/// With ψ linear, `f_αβ = kT δ_αβ/ρ_α + 2λ_αβ`. Its eigenvector v of eigenvalue zero has `v_A/v_B = −2λ/(kT/ρ_A + 2λ_A)`, and
/// `Σ kT v³/ρ²` is zero on it at the critical point; together `λr − λ_A r³ = λr² − λ_B` with `r³ = ρ_A/ρ_B`.
#[test]
fn critical_point_of_an_asymmetric_mixture_is_where_both_phases_become_one() {
    let (lambda, lambda_a, lambda_b, rho) = (1.0, 0.2, 0.4, 10.0);
    let cubic = |r: f64| lambda * r - lambda_a * r.powi(3) - lambda * r * r + lambda_b;
    let r = super::search::turning_point(0.5, 2.0, |r| cubic(r) > 0.0);
    let composition = r.powi(3) / (1.0 + r.powi(3));
    let kt = composition * rho * (2.0 * lambda / (r * r) - 2.0 * lambda_a);
    let family = |kt: f64| Ok(mixture(3, lambda, lambda_a, lambda_b).at(kt)?);
    let critical = composition_critical_point(&family, rho, [1.0, 50.0]).unwrap();
    close(critical.parameter, kt, 1e-6);
    close(critical.composition, composition, 1e-3);
    assert!(critical.limit >= critical.parameter);
    // Just below the critical point the two phases are near it, and near each other.
    let mf = theory(&mixture(3, lambda, lambda_a, lambda_b), kt * (1.0 - 1e-5));
    let phases = mf.coexistence([composition * rho, (1.0 - composition) * rho]).unwrap();
    let [low, high] = phases.composition();
    assert!(high - low < 0.05 && low < composition && composition < high, "{phases:?}");
}

/// At a fixed total density the phases of an asymmetric mixture are not in equilibrium, and refused.
/// Those of the mixture itself have equal potentials and pressure, and contain all its particles.
#[test]
fn phases_of_an_asymmetric_mixture_are_in_equilibrium_or_refused() {
    let mf = theory(&mixture(3, 1.0, 0.2, 0.4), 2.0);
    assert!(matches!(mf.composition_binodal(10.0), Err(TheoryError::NotInEquilibrium { .. })));
    assert!(matches!(mf.composition_interface(10.0, 11), Err(TheoryError::NotInEquilibrium { .. })));
    let overall = [5.0, 5.0];
    let found = mf.coexistence(overall).unwrap();
    let [p, q] = found.densities.map(|rho| mf.pressure(&rho));
    close(p, q, 1e-9);
    let [mu, nu] = found.densities.map(|rho| mf.chemical_potentials(&rho));
    for s in 0..2 {
        close(mu[s], nu[s], 1e-9);
        let [first, second] = found.densities;
        close(found.share * first[s] + (1.0 - found.share) * second[s], overall[s], 1e-9);
    }
    assert!((found.density()[0] - found.density()[1]).abs() > 0.1, "{found:?}");
    let same = mf.composition_binodal_at_pressure(found.pressure).unwrap();
    close(same.composition[0], found.composition()[0], 1e-7);
    close(same.density[1], found.density()[1], 1e-7);
    assert_eq!(found.more_stable, None);
    // For a symmetric mixture the result is that of Pagonabarraga and Frenkel, who fix the density.
    let mf = theory(&mixture(2, 1.0, 0.2, 0.2), 4.0);
    let (held, free) = (mf.composition_binodal(10.0).unwrap(), mf.coexistence([5.0, 5.0]).unwrap());
    close(free.composition()[0], held.composition[0], 1e-9);
    close(free.density()[0], 10.0, 1e-9);
    close(free.pressure, held.pressure[0], 1e-9);
    assert_eq!(
        theory(&mixture(2, 1.0, 0.2, 0.2), 8.1).coexistence([5.0, 5.0]),
        Err(TheoryError::NoCoexistence)
    );
}

/// Newton's method squares its error in each step, so a last step of 1e-11 leaves rounding alone, from whatever start. From
/// starts at all distances from the solution a tolerance of 1e-5 would leave up to 1e-10.
#[test]
fn phases_do_not_depend_on_the_start_of_the_search() {
    let mf = theory(&mixture(3, 1.0, 0.2, 0.4), 2.0);
    let overall = [5.0, 5.0];
    let found = mf.coexistence(overall).unwrap().densities;
    for k in 0..40 {
        let away = 0.5 * 0.8f64.powi(k);
        let [a, b] = found;
        let start = [[a[0] * (1.0 - away), a[1] * (1.0 + 0.5 * away)], [b[0] * (1.0 + away), b[1]]];
        let again = mf.settle(overall, start).unwrap().densities;
        for (x, y) in again.iter().flatten().zip(found.iter().flatten()) {
            close(*x, *y, 1e-12);
        }
    }
}

/// At ε_AA = 2.3 a thinner mixed phase is more stable than the two of density 16.
#[test]
fn a_third_phase_of_the_huggins_fluid_is_found() {
    for (epsilon, metastable) in [(1.8, false), (2.0, false), (2.3, true)] {
        let mf = theory(&huggins(epsilon), 1.0);
        let held = mf.composition_binodal(16.0).unwrap();
        let found = mf.settle([8.0, 8.0], held.composition.map(|c| [16.0 * c, 16.0 * (1.0 - c)])).unwrap();
        close(found.composition()[0], held.composition[0], 1e-9);
        assert_eq!(found.more_stable.is_some(), metastable, "{epsilon} {found:?}");
    }
}

#[test]
fn huggins_fluid() {
    let mf = theory(&huggins(1.6), 1.0);
    // The value is from Trofimov et al., text after eq. (56).
    assert!((mf.pressure(&[8.0, 8.0]) - 969.4).abs() < 0.05, "{}", mf.pressure(&[8.0, 8.0]));
    let family = |epsilon: f64| Ok(huggins(epsilon).at(1.0)?);
    let critical = composition_critical_point(&family, 16.0, [1.0, 3.0]).unwrap();
    close(critical.parameter, 4.0 / (3.0 * 0.001 * 50.0 * 16.0), 1e-10);
    close(critical.composition, 0.5, 1e-6);
    assert!(mf.composition_spinodal(16.0).unwrap().is_empty());
    let phases = theory(&huggins(1.9), 1.0).composition_binodal(16.0).unwrap();
    // The phases fulfil ln((1−c)/c) = (3/2) ε n0 Nm ρ (1 − 2c).
    let c = phases.composition[0];
    close(((1.0 - c) / c).ln(), 1.5 * 1.9 * 0.8 * (1.0 - 2.0 * c), 1e-10);
    // The mixture is symmetric, so that fixed density and fixed pressure agree, also where the
    // equimolar mixture is locally stable at that pressure (ε_AA = 2.2).
    for epsilon in [1.8, 2.0, 2.2] {
        let mf = theory(&huggins(epsilon), 1.0);
        let phases = mf.composition_binodal(16.0).unwrap();
        let same = mf.composition_binodal_at_pressure(phases.pressure[0]).unwrap();
        close(same.composition[0], phases.composition[0], 1e-9);
        close(same.density[1], 16.0, 1e-9);
    }
    // At ε_AA = 2.3 a thinner mixed phase of the same pressure is between the two.
    let mf = theory(&huggins(2.3), 1.0);
    let symmetric = mf.composition_binodal(16.0).unwrap();
    let phases = mf.composition_binodal_at_pressure(symmetric.pressure[0]).unwrap();
    assert!(phases.composition[1] < 0.6 && phases.density[1] < 12.0, "{phases:?}");
    close(phases.pressure[1], symmetric.pressure[0], 1e-10);
    let mu = [0, 1].map(|i| {
        let (c, rho) = (phases.composition[i], phases.density[i]);
        mf.chemical_potentials(&[c * rho, (1.0 - c) * rho])
    });
    close(mu[0][0], mu[1][0], 1e-10);
    close(mu[0][1], mu[1][1], 1e-10);
    let (c, rho) = (symmetric.composition[0], symmetric.density[0]);
    assert!(mu[0][0] < mf.chemical_potentials(&[c * rho, (1.0 - c) * rho])[0]);
}

/// Far below the critical point the phases are pure to all digits. With `W = 2ρ²(λ − λ_A) c(1 − c) + ρkT Σ c ln c` between them
/// the tension is `∫ √(2κW) dc`.
#[test]
fn interface_of_pure_phases() {
    let (lambda, lambda_a, rho) = (1.0, 0.2, 10.0);
    for kt in [0.2, 0.1, 0.03] {
        let mf = theory(&mixture(2, lambda, lambda_a, lambda_a), kt);
        let kappa = mf.gradient_coefficients(&[0.5 * rho; 2]);
        let kappa = rho * rho * (kappa[0] - kappa[1] - kappa[2] + kappa[3]);
        let height = |c: f64| {
            let ideal = c * c.ln() + (1.0 - c) * (1.0 - c).ln();
            2.0 * rho * rho * (lambda - lambda_a) * c * (1.0 - c) + rho * kt * ideal
        };
        let steps = 100_000;
        let tension: f64 = (0..steps)
            .map(|k| (k as f64 + 0.5) / steps as f64)
            .map(|c| (2.0 * kappa * height(c).max(0.0)).sqrt() / steps as f64)
            .sum();
        let found = mf.composition_interface(rho, 201).unwrap();
        assert!((found.tension / tension - 1.0).abs() < 1e-5, "{kt}: {} {tension}", found.tension);
        assert!(found.width > 0.0 && found.profile.iter().flatten().all(|x| x.is_finite()), "{kt}");
    }
}
