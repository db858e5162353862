use super::*;

/// Near T_c, with `τ = 1 − T/T_c`, the square-gradient theory of the symmetric mixture gives
/// `γ = 2ρkT_c √([r²w]τ³/d)` and `ξ² = [r²w]/(dτ)` for a profile tanh(z/ξ): from
/// `κ = (2/d)[r²w]ρkT_c`, `f″ = 8ρkT_cτ`, `Δc² = 3τ` and `γ = Δc² √(κf″)/6`.
#[test]
fn interface_of_the_symmetric_mixture_near_its_critical_point() {
    for (dimensions, moment) in [(2, 0.2), (3, 2.0 / 7.0)] {
        let (rho, kt_c, tau) = (10.0, 8.0, 1e-4);
        let mf = theory(&mixture(dimensions, 1.0, 0.2, 0.2), (1.0 - tau) * kt_c);
        let found = mf.composition_interface(rho, 201).unwrap();
        let d = dimensions as f64;
        close(found.tension, 2.0 * rho * kt_c * (moment * tau.powi(3) / d).sqrt(), 1e-3);
        let xi = (moment / (d * tau)).sqrt();
        close(found.width, 2.0 * xi, 1e-3);
        close(found.decay[0], xi / 2.0, 1e-3);
        // Pagonabarraga–Frenkel eq. (37) agrees for d = 2, as ξ = 2 decay.
        let c = found.phases[0];
        let eq37 = (moment / ((1.0 - tau) / (4.0 * c * (1.0 - c)) - 1.0)).sqrt();
        close(2.0 * found.decay[0], eq37 * (2.0 / d).sqrt(), 1e-6);
        let half = 0.5 * (found.phases[1] - found.phases[0]);
        for [z, c] in &found.profile {
            assert!((c - 0.5 - half * (z / xi).tanh()).abs() < 2e-3 * half, "{z} {c}");
        }
    }
}

/// Compares the interface far from T_c with quadrature of the closed forms.
#[test]
fn interface_of_the_symmetric_mixture_far_from_its_critical_point() {
    let (rho, kt_c, kt) = (10.0, 8.0, 4.0);
    let mf = theory(&mixture(2, 1.0, 0.2, 0.2), kt);
    let found = mf.composition_interface(rho, 101).unwrap();
    let f = |c: f64| rho * kt * (c * c.ln() + (1.0 - c) * (1.0 - c).ln()) + 2.0 * rho * kt_c * c * (1.0 - c);
    let kappa = 0.2 * rho * kt_c;
    let [c1, c2] = found.phases;
    let tension = integral(&|c| (2.0 * kappa * (f(c) - f(c1)).max(0.0)).sqrt(), &spaced(c1, c2, 64));
    close(found.tension, tension, 1e-7);
    close(found.width, (c2 - c1) / (2.0 * (f(0.5) - f(c1)) / kappa).sqrt(), 1e-9);
}

#[test]
fn interface_of_the_van_der_waals_fluid() {
    let (a, b, alpha3) = (1.9 * 0.0156, 0.0156, 5.0);
    let model = van_der_waals(2, a, b, alpha3);
    let mf = theory(&model, 0.75);
    for rho in [1.0, 20.0, 45.0f64] {
        // κ is twice the bracket of eq. (29), with [r²w] = 1/5.
        let bracket = -0.75 * b / (1.0 - b * rho).powi(2) + a + 2.0 * alpha3 * a * b * rho;
        close(mf.gradient_coefficients(&[rho])[0], 0.2 / 2.0 * bracket, 1e-12);
    }
    // Close to the critical point γ = Δρ² √(κf″)/6.
    let critical = critical_point(&|kt| Ok(model.at(kt)?), [0.1, 10.0]).unwrap();
    let mf = theory(&model, critical.parameter * (1.0 - 1e-4));
    let found = mf.interface(101).unwrap();
    let delta = found.phases[1] - found.phases[0];
    let middle = 0.5 * (found.phases[0] + found.phases[1]);
    let second =
        0.5 * (mf.second_derivatives(&found.phases[..1])[0] + mf.second_derivatives(&found.phases[1..])[0]);
    let kappa = mf.gradient_coefficients(&[middle])[0];
    close(found.tension, delta * delta * (kappa * second).sqrt() / 6.0, 2e-3);
    // Each phase has its own length of decay √(κ/f″).
    let deep = theory(&model, 0.99 * critical.parameter);
    let found = deep.interface(101).unwrap();
    let lengths = found
        .phases
        .map(|rho| (deep.gradient_coefficients(&[rho])[0] / deep.second_derivatives(&[rho])[0]).sqrt());
    assert!((lengths[0] / lengths[1] - 1.0).abs() > 0.02, "{lengths:?}");
    (0..2).for_each(|k| close(found.decay[k], lengths[k], 1e-9));
    // Repulsion and attraction have one range: without α₃ and far below T_c gradients are favoured.
    let cold = theory(&van_der_waals(2, 1.0, 1.0, 0.0), 0.1).interface(51);
    assert!(matches!(cold, Err(TheoryError::GradientNotPositive { .. })), "{cold:?}");
}
