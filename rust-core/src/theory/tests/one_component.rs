use super::*;

#[test]
fn critical_points_have_their_closed_form() {
    let (a, b) = (1.9 * 0.016, 0.016);
    for alpha3 in [0.0f64, 0.5, 1.0, 5.0] {
        let model = van_der_waals(2, a, b, alpha3);
        let found = critical_point(&|kt| Ok(model.at(kt)?), [0.05, 20.0]).unwrap();
        let x = if alpha3 == 0.0 {
            1.0 / 3.0
        } else {
            (alpha3 - 1.0 + (1.0 + 2.0 / 3.0 * alpha3 + alpha3 * alpha3).sqrt()) / (4.0 * alpha3)
        };
        let y = x * (2.0 + 3.0 * alpha3 * x) * (1.0 - x).powi(2);
        close(found.parameter, y * a / b, 1e-12);
        close(found.density, x / b, 1e-6);
        if alpha3 == 0.0 {
            close(found.parameter, 8.0 * a / (27.0 * b), 1e-12);
            close(found.pressure, a / (27.0 * b * b), 1e-9);
        }
    }
    let model = van_der_waals(2, a, b, 0.0);
    let none = critical_point(&|kt| Ok(model.at(kt)?), [5.0, 20.0]);
    assert_eq!(none, Err(TheoryError::NoCriticalPoint(5.0, 20.0)));
}

#[test]
fn spinodal_and_binodal_of_the_van_der_waals_fluid() {
    let (a, b) = (1.0, 1.0);
    let kt_c = 8.0 / 27.0;
    for reduced in [0.3, 0.7, 0.9, 0.999, 0.99999] {
        let kt = reduced * kt_c;
        let mf = theory(&van_der_waals(3, a, b, 0.0), kt);
        let spinodal = mf.spinodal().unwrap();
        assert_eq!(spinodal.len(), 1);
        for rho in spinodal[0] {
            // The spinodal is kT = 2aρ(1 − bρ)².
            close(2.0 * a * rho * (1.0f64 - b * rho).powi(2), kt, 1e-9);
        }
        let phases = mf.binodal().unwrap_or_else(|e| panic!("{e} {reduced} {spinodal:?}"));
        assert!(phases.vapour < spinodal[0][0] && phases.liquid > spinodal[0][1]);
        close(mf.pressure(&[phases.liquid]), phases.pressure, 1e-9);
        // Maxwell's equal areas: ∫ (p − p₀)/ρ² dρ = 0, with the closed form of p.
        let p = |rho: f64| rho * kt / (1.0 - b * rho) - a * rho * rho;
        let ends = spaced(phases.vapour.ln(), phases.liquid.ln(), 200);
        let area = |f: &dyn Fn(f64) -> f64| integral(&|u| f((p(u.exp()) - phases.pressure) / u.exp()), &ends);
        assert!(area(&|x| x).abs() < 1e-7 * area(&|x| x.abs()) + 1e-16, "{} at {reduced}", area(&|x| x));
    }
    assert_eq!(theory(&van_der_waals(3, a, b, 0.0), 1.01 * kt_c).binodal(), Err(TheoryError::NoCoexistence));
    // Known values at T = 0.9 T_c: densities 0.4257 and 1.6573 of ρ_c, p = 0.6470 p_c.
    let phases = theory(&van_der_waals(3, a, b, 0.0), 0.9 * kt_c).binodal().unwrap();
    close(phases.vapour * 3.0, 0.4257, 2e-4);
    close(phases.liquid * 3.0, 1.6573, 2e-4);
    close(phases.pressure * 27.0, 0.6470, 2e-4);
}

#[test]
fn a_vapour_of_almost_nothing() {
    let mf = theory(&van_der_waals(3, 1.0, 1.0, 0.0), 0.005);
    let phases = mf.binodal().unwrap();
    assert!(phases.vapour > 0.0 && phases.vapour < 1e-70, "{phases:?}");
    close(phases.pressure, phases.vapour * 0.005, 1e-12);
    assert!(mf.pressure(&[phases.liquid]).abs() < 1e-10);
}
