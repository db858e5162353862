use super::radial::integral;
use super::search::spaced;
use super::*;
use crate::model::kernel::{Kernel, KernelKind};
use crate::model::{ForceLaw, Model, WarrenPair, warren_ab};
use std::f64::consts::PI;

fn model(text: &str) -> Model {
    Model::parse("test.toml", text).unwrap()
}

fn theory(model: &Model, kt: f64) -> MeanField {
    MeanField::new(&model.at(kt).unwrap()).unwrap()
}

#[track_caller]
fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found}, expected {expected}");
}

/// Pagonabarraga–Frenkel's van der Waals fluid.
fn van_der_waals(dimensions: usize, a: f64, b: f64, alpha3: f64) -> Model {
    model(&format!(
        "title = 'vdW'\ndimensions = {dimensions}\nspecies = ['F']\n\
         [parameters]\na = {a:?}\nb = {b:?}\nalpha3 = {alpha3:?}\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nF = '-kT*ln(1 - b*n) - a*n - 0.5*alpha3*a*b*n^2'\n"
    ))
}

/// Pagonabarraga–Frenkel's binary mixture.
fn mixture(dimensions: usize, lambda: f64, lambda_a: f64, lambda_b: f64) -> Model {
    model(&format!(
        "title = 'mixture'\ndimensions = {dimensions}\nspecies = ['A', 'B']\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nA = '{lambda:?}*n_B + {lambda_a:?}*n_A'\nB = '{lambda:?}*n_A + {lambda_b:?}*n_B'\n"
    ))
}

/// Trofimov et al.'s compressible Huggins fluid.
fn huggins(epsilon: f64) -> Model {
    let psi = |own: &str, other: &str| {
        format!(
            "kT/(n0*n)*(1-n0*Nm*n)*ln(1-n0*Nm*n) + Nm*kT*ln(n0*Nm*n_{own}) \
             - Nm^2*n0*(e*n_{own} + e/4*n_{other}) - kT*ln(n_{own})"
        )
    };
    model(&format!(
        "title = 'CHF'\nspecies = ['A', 'B']\n[parameters]\nn0 = 0.001\nNm = 50\ne = {epsilon:?}\n\
         [density.n]\nkernel = 'quadratic'\nrange = 1\n\
         [excess_free_energy]\nA = '{}'\nB = '{}'\n",
        psi("A", "B"),
        psi("B", "A"),
    ))
}

fn warren(a: f64, b: f64, dimensions: usize) -> Model {
    let pair = WarrenPair { a, b, gamma: 18.0, rc: 1.0, rd: 0.75 };
    warren_ab(&["F".into()], &[Some(pair)], dimensions, ForceLaw::Conservative).unwrap()
}

/// Wang–Chen's spline potential `first W(0.8) − second W(1.0)`.
fn spline(first: f64, second: f64) -> Model {
    model(&format!(
        "title = 'spline'\nspecies = ['F']\n[[pair]]\nbetween = ['F', 'F']\nform = 'spline'\n\
         strength = 1\nA = {first:?}\nB = {second:?}\nrange_A = 0.8\nrange_B = 1.0\n"
    ))
}

#[test]
fn pressure_of_the_van_der_waals_fluid_and_its_compressibility() {
    let (a, b, alpha3, kt) = (1.9, 0.1, 5.0, 0.75);
    let mf = theory(&van_der_waals(2, a, b, alpha3), kt);
    for rho in [0.01, 1.0, 4.0, 9.9] {
        let p = rho * kt / (1.0 - b * rho) - a * rho * rho - alpha3 * a * b * rho.powi(3);
        close(mf.pressure(&[rho]), p, 1e-12);
        let by_definition = rho * mf.chemical_potentials(&[rho])[0] - mf.free_energy_density(&[rho]);
        close(by_definition, p, 1e-11);
        // Pagonabarraga–Frenkel eq. (17).
        let inverse = kt / rho + kt * b * (2.0 - b * rho) / (1.0 - b * rho).powi(2)
            - 2.0 * a
            - 3.0 * alpha3 * a * b * rho;
        close(mf.second_derivatives(&[rho])[0], inverse, 1e-12);
        close(mf.pressure_slope(&[rho]), rho * inverse, 1e-12);
        close(mf.inverse_structure_factor(&[rho], 0.0)[0], rho * inverse / kt, 1e-12);
        close(mf.inverse_structure_factor(&[rho], 1e-5)[0], rho * inverse / kt, 1e-8);
    }
    assert!(mf.pressure(&[10.5]).is_nan());
}

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

#[test]
fn warrens_equation_of_state() {
    for (a, b) in [(-40.0, 40.0), (-40.0, 25.0), (25.0, 0.0)] {
        let mf = theory(&warren(a, b, 3), 1.0);
        for rho in [0.5, 3.0, 6.0] {
            let p = rho + PI / 30.0 * (a + 2.0 * b * 0.75f64.powi(4) * rho) * rho * rho;
            close(mf.pressure(&[rho]), p, 1e-12);
        }
    }
    // Standard DPD has α = π/30, and π/24 in the plane.
    close(theory(&warren(1.0, 0.0, 3), 1.0).pair_integrals[0] / 2.0, PI / 30.0, 1e-13);
    close(theory(&warren(1.0, 0.0, 2), 1.0).pair_integrals[0] / 2.0, PI / 24.0, 1e-13);
    let phases = theory(&warren(-40.0, 25.0, 3), 1.0).binodal().unwrap();
    assert!(phases.liquid > 2.0 && phases.vapour < 0.1, "{phases:?}");
}

#[test]
fn quadratic_kernel_and_soft_potential_are_one_fluid() {
    let by_pairs = theory(&warren(25.0, 0.0, 3), 1.0);
    let by_psi = theory(
        &model(
            "title = 'GW'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n\
             [excess_free_energy]\nF = 'pi/30*25*n'\n",
        ),
        1.0,
    );
    for k in [0.0, 1.0, 7.0, 30.0] {
        close(
            by_psi.inverse_structure_factor(&[3.0], k)[0],
            by_pairs.inverse_structure_factor(&[3.0], k)[0],
            1e-12,
        );
    }
    let kappa = [&by_psi, &by_pairs].map(|mf| mf.gradient_coefficients(&[3.0])[0]);
    close(kappa[0], kappa[1], 1e-12);
    assert!(kappa[0] < 0.0);
    let stability = by_pairs.stability(&[3.0]);
    assert!(stability.stable && !stability.spinodal && stability.k_star.is_none());
    assert_eq!(stability.min_inverse_s, 1.0);
}

#[test]
fn second_moments_of_the_kernels() {
    let moments = |kind: &str, d: usize, range: f64| {
        let text = format!(
            "title = 'm'\ndimensions = {d}\nspecies = ['F']\n[density.n]\nkernel = '{kind}'\nrange = {range:?}\n\
             [excess_free_energy]\nF = 'n'\n"
        );
        theory(&model(&text), 1.0).kernel_moments()[0]
    };
    // The moment [r²w] of the quadratic kernel is 2/7 R² in space and 1/5 R² in the plane; that of
    // the linear kernel 2/5 and 3/10.
    close(moments("quadratic", 3, 1.3)[0], 2.0 / 7.0 * 1.69, 1e-13);
    close(moments("quadratic", 2, 1.3)[0], 0.2 * 1.69, 1e-13);
    close(moments("linear", 3, 1.0)[0], 0.4, 1e-13);
    close(moments("linear", 2, 1.0)[0], 0.3, 1e-13);
    // The moment [r⁴w] of the quadratic kernel in space is 30 (1/7 − 2/8 + 1/9) = 5/42.
    close(moments("quadratic", 3, 1.0)[1], 5.0 / 42.0, 1e-13);
    // The moments are the coefficients of the expansion of ŵ in k, for every kernel.
    for kind in KernelKind::ALL {
        for d in [2usize, 3] {
            let w = Kernel::new(*kind, 0.9, d);
            let radial = radial::Radial::new(d, 0.9, |r| w.value(r)).unwrap();
            close(radial.moment(0), 1.0, 1e-12);
            let (k, df) = (0.02f64, d as f64);
            let series = 1.0 - k * k * radial.moment(2) / (2.0 * df)
                + k.powi(4) * radial.moment(4) / (8.0 * df * (df + 2.0));
            assert!((radial.transform(k) - series).abs() < 1e-12, "{} {d}", kind.name());
        }
    }
}

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

#[test]
fn self_term_and_correction() {
    let text = |extra: &str| {
        format!(
            "title = 's'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n{extra}\n\
             [excess_free_energy]\nF = 'n^2'\n"
        )
    };
    let w0 = 15.0 / (2.0 * PI);
    close(
        theory(&model(&text("self = true")), 1.0).excess_free_energy_density(&[2.0]),
        2.0 * (2.0 + w0).powi(2),
        1e-14,
    );
    for extra in ["", "correction = [1.54, 1.047]", "self = true\ncorrection = [1.54, 1.047]"] {
        close(theory(&model(&text(extra)), 1.0).excess_free_energy_density(&[2.0]), 8.0, 1e-14);
    }
}

#[test]
fn several_densities_add_up() {
    let mf = theory(
        &model(
            "title = 'two'\nspecies = ['A', 'B']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n\
             [density.m]\nkernel = 'lucy'\nrange = 0.7\n\
             [excess_free_energy]\nA = 'n_A*m_B + m^2'\nB = 'n^3 + exp(0.1*m_A)'\n\
             [[pair]]\nbetween = ['A', 'B']\nform = 'soft'\nstrength = 3\nrange = 0.9\n",
        ),
        1.2,
    );
    let at = [0.7, 1.1];
    let f = |rho: [f64; 2]| mf.free_energy_density(&rho);
    let h = 1e-4;
    let mu = mf.chemical_potentials(&at);
    let second = mf.second_derivatives(&at);
    let step = |i: usize, h: f64| {
        let mut rho = at;
        rho[i] += h;
        rho
    };
    for i in 0..2 {
        close((f(step(i, h)) - f(step(i, -h))) / (2.0 * h), mu[i], 1e-6);
        for j in 0..2 {
            let [up, down] = [h, -h].map(|h| mf.chemical_potentials(&step(j, h))[i]);
            close((up - down) / (2.0 * h), second[2 * i + j], 1e-6);
        }
    }
    close(at[0] * mu[0] + at[1] * mu[1] - f(at), mf.pressure(&at), 1e-12);
    let scaled = |s: f64| mf.pressure(&[at[0] * s, at[1] * s]);
    close((scaled(1.0 + h) - scaled(1.0 - h)) / (2.0 * h * (at[0] + at[1])), mf.pressure_slope(&at), 1e-6);
    // The gradient coefficients are the k² term of the interaction.
    let k = 1e-2;
    let (zero, wave) = (mf.interaction_kernel(&at, 0.0), mf.interaction_kernel(&at, k));
    for (i, kappa) in mf.gradient_coefficients(&at).iter().enumerate() {
        close((wave[i] - zero[i]) / (k * k), *kappa, 1e-4);
    }
}

#[test]
fn which_fluids_have_a_thermodynamic_limit() {
    let limit = |model: &Model| thermodynamic_limit(&model.at(1.0).unwrap()).unwrap();
    let collapse = limit(&spline(17.0, 9.5)).unwrap_err();
    assert_eq!(collapse.structure, Structure::Uniform);
    assert!(collapse.pair < 0.0 && collapse.energy < 0.0);
    assert_eq!(limit(&spline(19.0, 9.5)), Ok(()));
    // For the model of the paper's equation of state ∫φ > 0, but the sum of φ over a simple cubic
    // lattice of spacing 0.3075 is −0.0474, so that enough particles on its sites collapse.
    let lattice = limit(&spline(8.0, 4.08)).unwrap_err();
    assert!(matches!(lattice.structure, Structure::Cubic { .. }) && !lattice.is_uniform());
    close(lattice.pair, -0.0237, 1e-2);
    assert_eq!(limit(&warren(-40.0, 25.0, 3)), Ok(()));
    assert_eq!(limit(&warren(25.0, 0.0, 3)), Ok(()));
    assert!(limit(&warren(-40.0, 0.0, 3)).is_err());
    assert_eq!(limit(&van_der_waals(2, 1.9, 0.1, 5.0)), Ok(()));
    assert_eq!(limit(&huggins(1.6)), Ok(()));
    assert_eq!(limit(&mixture(2, 1.0, 0.2, 0.2)), Ok(()));
    // This ψ has no pole.
    let linear = "title = 'l'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n\
                  [excess_free_energy]\nF = '-0.1*n'\n";
    assert!(limit(&model(linear)).is_err());
    assert!(limit(&model(&linear.replace("-0.1*n", "0.1*ln(1 - 0.1*n)"))).is_err());
    assert_eq!(limit(&model(&linear.replace("-0.1*n", "-0.1*ln(1 + n)"))), Ok(()));
}

#[test]
fn mixtures_collapse_in_the_worst_composition() {
    let two = |like: f64, unlike: f64| {
        let pair = |a: f64| Some(WarrenPair { a, b: 0.0, gamma: 4.5, rc: 1.0, rd: 1.0 });
        let pairs = [pair(like), pair(unlike), None, pair(25.0)];
        warren_ab(&["A".into(), "B".into()], &pairs, 3, ForceLaw::Conservative).unwrap().at(1.0).unwrap()
    };
    // The pair energies are copositive as long as the attraction is below the geometric mean.
    assert_eq!(thermodynamic_limit(&two(1.0, -4.99)).unwrap(), Ok(()));
    let collapse = thermodynamic_limit(&two(1.0, -5.01)).unwrap().unwrap_err();
    close(collapse.composition[0], 5.0 / 6.0, 1e-2);
    assert!(thermodynamic_limit(&two(-1.0, 100.0)).unwrap().is_err());
}

#[test]
fn an_integral_above_zero_is_not_enough() {
    // The potential attracts in a shell: close-packed sites at its radius collapse although ∫φ > 0.
    let shell = model(
        "title = 'shell'\nspecies = ['F']\n[[pair]]\nbetween = ['F', 'F']\nform = 'expression'\n\
         phi = '4*max(0, 1 - 2*r)^2 - 6*max(0, 1 - 25*(r - 0.75)^2) + 5*max(0, 1 - 25*(r - 1.0)^2)'\nrange = 1.2\n",
    );
    let fluid = shell.at(1.0).unwrap();
    assert!(MeanField::new(&fluid).unwrap().pair_integrals[0] > 0.0);
    let collapse = thermodynamic_limit(&fluid).unwrap().unwrap_err();
    assert_ne!(collapse.structure, Structure::Uniform);
}

/// A particle of a body-centred lattice with neighbours at 0.9 has eight of them, and six at 1.0392: fourteen in the two narrow
/// wells. Twelve at most are in other lattices, whose closer neighbours would repel. So a core of 13 makes a body-centred
/// lattice alone collapse, and a core of 15 none.
#[test]
fn a_body_centred_lattice_is_tried_too() {
    let limit = |core: f64| {
        let text = format!(
            "title = 'wells'\nspecies = ['F']\n[[pair]]\nbetween = ['F', 'F']\nform = 'expression'\nrange = 1.2\n\
             phi = '{core:?}*max(0, 1 - 4*r)^2 + 15*max(0, 1 - 11*(r - 0.5)^2) - max(0, 1 - 625*(r - 0.9)^2) \
             - max(0, 1 - 625*(r - 1.0392)^2)'\n"
        );
        thermodynamic_limit(&model(&text).at(1.0).unwrap()).unwrap()
    };
    let collapse = limit(13.0).unwrap_err();
    assert!(matches!(collapse.structure, Structure::BodyCentred { .. }), "{collapse:?}");
    assert_eq!(limit(15.0), Ok(()));
}

#[test]
fn stability_finds_clustering() {
    // A bell-shaped force repels strongly: its kernel's transform is negative somewhere.
    let text = |kernel: &str| {
        format!(
            "title = 'c'\nspecies = ['F']\n[density.n]\nkernel = '{kernel}'\nrange = 1\n\
             [excess_free_energy]\nF = '50*n'\n"
        )
    };
    let bell = theory(&model(&text("bell")), 1.0).stability(&[20.0]);
    assert!(!bell.stable && !bell.spinodal && bell.min_inverse_s < 0.0, "{bell:?}");
    let k = bell.k_star.unwrap();
    assert!(k > 4.0 && k < 12.0, "{k}");
    for kernel in ["quadratic", "wendland-c2"] {
        let positive = theory(&model(&text(kernel)), 1.0).stability(&[20.0]);
        assert!(positive.stable && positive.min_inverse_s > 0.99, "{kernel} {positive:?}");
    }
    let spinodal = theory(&van_der_waals(3, 1.0, 1.0, 0.0), 0.2).stability(&[0.3]);
    assert!(spinodal.spinodal && !spinodal.stable);
    let beyond = theory(&van_der_waals(3, 1.0, 1.0, 0.0), 0.2).stability(&[1.3]);
    assert!(!beyond.stable);
}

#[test]
fn singularities_are_found() {
    let fluid = van_der_waals(2, 1.9, 0.016, 5.0).at(1.0).unwrap();
    let found = singular_densities(&fluid, &[1.0], [0.0, 100.0]).unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].kind, SingularityKind::Edge);
    close(found[0].density, 62.5, 1e-12);
    assert!(singular_densities(&fluid, &[1.0], [0.0, 60.0]).unwrap().is_empty());
    let at = |psi: &str| {
        let text = format!(
            "title = 's'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n\
             [excess_free_energy]\nF = '{psi}'\n"
        );
        singular_densities(&model(&text).at(1.0).unwrap(), &[1.0], [0.0, 10.0]).unwrap()
    };
    assert_eq!(at("ln(n)")[0].kind, SingularityKind::Origin);
    let pole = at("1/(3.3333 - n)");
    assert_eq!((pole.len(), pole[0].kind), (1, SingularityKind::Pole));
    close(pole[0].density, 3.3333, 1e-8);
    let pole = at("1/(5 - n)");
    assert_eq!((pole.len(), pole[0].kind), (1, SingularityKind::Pole));
    assert!(at("n^2 + abs(n - 2) + exp(n)").is_empty());
    let mixture = singular_densities(&huggins(1.6).at(1.0).unwrap(), &[0.5, 0.5], [0.0, 30.0]).unwrap();
    assert!(mixture.iter().any(|s| s.kind == SingularityKind::Edge && (s.density - 20.0).abs() < 1e-9));
}

/// Mean field continues ψ beyond the bounds of a density as a run does: compares value, slopes and
/// curvatures with the rule, for one variable, for two at once, and for a curve.
#[test]
fn bounds_continue_the_free_energy() {
    let text = |bounds: &str| {
        model(&format!(
            "title = 'b'\nspecies = ['A', 'B']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n{bounds}\n\
             [excess_free_energy]\nA = 'n_A^3 * n_B^2 + 3*n_B'\nB = 'ln(n_A) + n_B^2'\n"
        ))
    };
    let linear = theory(&text("bounds = [1.0, 2.0]"), 1.0);
    let constant = theory(&text("bounds = [1.0, 2.0]\nbelow = 'constant'"), 1.0);
    // n_A = 3 is above its bound, n_B = 0.5 below: (8 + 12 + 6)(1 − 1 + ¼) and (8 + 12 + 6)(1 − 1).
    let psi = linear.psi(0, &[3.0, 0.5]);
    close(psi.value, 26.0 * 0.25 + 1.5, 1e-14);
    close(psi.gradient[0], 24.0 * 0.25, 1e-14);
    close(psi.gradient[1], 26.0 * 1.0 + 3.0, 1e-14);
    for (found, expected) in psi.hessian.iter().zip([12.0 * 0.25, 24.0, 24.0, 26.0 * 2.0]) {
        close(*found, expected, 1e-14);
    }
    let psi = constant.psi(0, &[3.0, 0.5]);
    assert!((psi.value - 1.5).abs() < 1e-13, "{}", psi.value);
    close(psi.gradient[1], 26.0 * 2.0 + 3.0, 1e-14);
    assert!(psi.hessian[3].abs() < 1e-13);
    // One variable is within its bounds, the other beyond.
    let psi = linear.psi(0, &[1.5, 3.0]);
    close(psi.gradient[0], 3.0 * 2.25 * 9.0, 1e-14);
    close(psi.hessian[1], 3.0 * 2.25 * 6.0, 1e-14);
    close(psi.hessian[0], 6.0 * 1.5 * 9.0, 1e-14);
    // Below its bound the logarithm continues from 1: −1 − ½, plus 1.5².
    close(linear.psi(1, &[0.0, 1.5]).value, 0.75, 1e-14);
    let curve = model(
        "title = 'c'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\nbounds = [1.0, 2.0]\n\
         [excess_free_energy]\nF = { pressure = 'rho*kT + rho^3' }\n",
    );
    // The slope is ψ′ = n, at 3 as within the bounds; p = ρkT + ρ²ψ′.
    close(theory(&curve, 1.0).pressure(&[3.0]), 3.0 + 27.0, 1e-9);
    close(theory(&curve, 1.0).pressure(&[1.5]), 1.5 + 1.5f64.powi(3), 1e-9);
}

#[test]
fn wrong_number_of_species() {
    let mf = theory(&mixture(2, 1.0, 0.2, 0.2), 1.0);
    assert_eq!(mf.spinodal(), Err(TheoryError::Species { expected: 1, found: 2 }));
    assert_eq!(mf.binodal(), Err(TheoryError::Species { expected: 1, found: 2 }));
    let mf = theory(&van_der_waals(2, 1.0, 1.0, 0.0), 1.0);
    assert!(mf.composition_binodal(1.0).is_err() && mf.composition_interface(1.0, 11).is_err());
}
