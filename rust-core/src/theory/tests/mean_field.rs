use super::*;

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
