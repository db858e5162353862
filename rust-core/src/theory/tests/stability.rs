use super::*;

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
