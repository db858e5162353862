use super::*;

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
        let pair = |a: f64| Some(WarrenPair { a, b: 0.0, gamma: 4.5, rc: 1.0, rd: 1.0, weight: None });
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
