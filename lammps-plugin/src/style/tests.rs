use super::*;
use crate::bridge::{Atoms, Extent, Listed, Request};
use psidpd_core::model::WarrenPair;

const MODEL: &str = "title = \"t\"\nspecies = [\"A\", \"B\"]\n[[pair]]\nbetween = [\"A\", \"B\"]\n\
    form = \"soft\"\nstrength = 25\nrange = 1\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\n\
    strength = 25\nrange = 1\n[[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n";

fn style(names: &[&str], dimensions: usize) -> Result<Style, StyleError> {
    let names: Vec<String> = names.iter().map(|s| (*s).to_owned()).collect();
    Style::new(Model::parse("m.toml", MODEL).unwrap(), 1.0, &names, dimensions)
}

/// Atoms in the flat arrays of LAMMPS.
fn atoms<'a>(owned: usize, x: &'a [f64], v: &'a [f64], tag: &'a [i32], kind: &'a [i32]) -> Atoms<'a> {
    Atoms { owned, x, v, tag, kind }
}

/// A request for forces, with drag and noise or without.
fn request(thermostat: bool) -> Request {
    let (seed, step, dt) = (1, 1, 0.01);
    Request {
        thermostat,
        seed,
        step,
        dt,
        energy: false,
        virial: false,
        particle_energy: false,
        particle_virial: false,
    }
}

/// A cube, periodic or open.
fn cube(edge: f64, closed: bool) -> Extent {
    let edges = [edge, edge, edge, 0.0, 0.0, 0.0];
    Extent { origin: [0.0; 3], edges, closed: [closed; 3], periodic: [true; 3] }
}

#[test]
fn types_map_to_species_by_name() {
    let mut s = style(&["B", "NULL", "A"], 3).unwrap();
    let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
    let mut f = [0.0; 6];
    let (open, still) = (cube(1.0, false), request(false));
    let apart = atoms(2, &x, &[], &[1, 2], &[1, 2]);
    s.densities(&open, &[], true, &apart, &still, &mut f).unwrap();
    s.forces(&apart, &still, &mut f).unwrap();
    assert_eq!(f, [0.0; 6]);
    let pair = atoms(2, &x, &[], &[1, 2], &[1, 3]);
    s.densities(&open, &[], true, &pair, &still, &mut f).unwrap();
    s.forces(&pair, &still, &mut f).unwrap();
    assert_eq!(f, [-12.5, 0.0, 0.0, 12.5, 0.0, 0.0]);
    // Without ghosts, forces are added to those in `f`.
    s.evaluate(&open, &pair, &still, &mut f).unwrap();
    assert_eq!(f, [-25.0, 0.0, 0.0, 25.0, 0.0, 0.0]);
}

/// A request for densities that no force needs does not slow later steps down.
#[test]
fn densities_of_one_step_leave_later_steps_to_the_sweep() {
    let text = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
        [density.m]\nkernel = \"linear\"\nrange = 1\n[excess_free_energy]\nA = \"n^2 + m\"\n";
    let mut s = Style::new(Model::parse("m.toml", text).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
    let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
    let pair = atoms(2, &x, &[], &[1, 2], &[1, 1]);
    let w = 3.0 / std::f64::consts::PI * 0.5;
    s.sum_densities(&cube(1.0, false), &pair).unwrap();
    assert_eq!(s.engine.results().densities, [0.0; 4]);
    for _ in 0..2 {
        s.evaluate(&cube(1.0, false), &pair, &request(false), &mut [0.0; 6]).unwrap();
        assert_eq!(s.engine.path(), Some(EnginePath::Sweep));
        s.sum_densities(&cube(1.0, false), &pair).unwrap();
        let densities = s.engine.results().densities;
        assert_eq!(densities.len(), 4);
        assert!((densities[1] - w).abs() < 1e-14 && densities[0] > 0.0, "{densities:?}");
        assert_eq!(s.engine.path(), Some(EnginePath::Sweep));
    }
    let text = [false, true].map(|listed| s.description("", listed, listed));
    assert!(text[0].contains("evaluation    cell sweep;"), "{}", text[0]);
    assert!(text[0].contains("half-step") && text[1].contains("those of fix dpd/splitting"));
    assert!(
        text[1].contains("evaluation    sums over pairs one by one, because the host lists"),
        "{}",
        text[1]
    );
}

#[test]
fn mistakes_are_named() {
    assert!(style(&["C"], 3).unwrap_err().to_string().contains("no species \"C\"; the model has A, B"));
    assert!(style(&["A"], 2).unwrap_err().to_string().contains("dimensions = 3, the simulation has 2"));
    let missing = crate::bridge::read_model(b"nowhere.toml").unwrap_err();
    assert!(missing.to_string().contains("nowhere.toml: cannot be read"), "{missing}");
}

#[test]
fn types_without_coefficients_take_no_part() {
    let pair = WarrenPair { a: -40.0, b: 25.0, gamma: 1.0, rc: 1.0, rd: 0.75, weight: None };
    let mut table = vec![None; 9];
    table[4] = Some(pair);
    for masses in [None, Some(&[7.0, 1.0, 2.0][..])] {
        let mut table = table.clone();
        let style = Style::from_coefficients(1.0, &table, 3, 3, masses).unwrap();
        assert_eq!(style.engine.plan().species_of_type(), [-1, -1, 0, -1]);
        table[8] = Some(pair);
        let error = Style::from_coefficients(1.0, &table, 3, 3, masses).unwrap_err();
        assert!(error.to_string().contains("types 2 and 3"), "{error}");
        assert!(Style::from_coefficients(1.0, &[None], 1, 3, masses).is_err());
        for other in [&table[..8], &[]] {
            let error = Style::from_coefficients(1.0, other, 3, 3, masses).unwrap_err().to_string();
            assert!(error.contains("expected coefficients for every pair"), "{error}");
        }
    }
    let short = Style::from_coefficients(1.0, &table, 3, 3, Some(&[1.0])).unwrap_err();
    assert!(short.to_string().contains("as many masses"), "{short}");
}

/// Arguments that no host should pass give an answer or an error.
#[test]
fn hostile_arguments_are_errors() {
    let many = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
        [excess_free_energy]\nA = \"n^2\"\n[[thermostat]]\ngamma = 1\nrange = 1\n";
    let mut s = Style::new(Model::parse("m.toml", many).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
    let (open, closed) = (cube(3.0, false), cube(3.0, true));
    let extremes = [i32::MIN, -1, 0, 1, 2, 3, i32::MAX];
    for threads in [0, 1025, usize::MAX] {
        let error = s.configure(false, threads).unwrap_err().to_string();
        assert!(error.contains("from 1 to 1024"), "{error}");
    }
    // Before the first evaluation no particle is known.
    assert!(extremes.iter().all(|i| s.single([1, 1], 0.5, [*i, 0]).is_err()));
    let (x, v) = ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], [0.0; 6]);
    let (hot, still) = (request(true), request(false));
    let pair = atoms(2, &x, &v, &[1, 2], &[1, 1]);
    let mut f = [0.0; 6];
    s.evaluate(&closed, &pair, &hot, &mut f).unwrap();
    s.engine.fetch_slopes(2);
    assert!(s.single([1, 1], 0.5, [0, 1]).unwrap()[1] > 0.0);
    for i in extremes {
        for pair in [[i, 0], [0, i], [i, i]] {
            assert_eq!(s.single([1, 1], 0.5, pair).is_ok(), pair.iter().all(|k| (0..2).contains(k)));
        }
    }
    for [i, kind] in extremes.into_iter().flat_map(|i| extremes.map(|kind| [i, kind])) {
        let _ = s.single([kind, i], f64::NAN, [0, 1]);
        let kinds = [1, kind];
        let done = s.densities(&open, &[], true, &atoms(2, &x, &v, &[1, 2], &kinds), &hot, &mut f);
        assert!(done.is_ok() == (kind == 1) || kind == 0);
    }
    // The pairs of half an evaluation are not known yet.
    s.densities(&open, &[], true, &pair, &hot, &mut f).unwrap();
    assert!(s.single([1, 1], 0.5, [0, 1]).is_err());
    s.forces(&pair, &hot, &mut f).unwrap();
    assert!(s.single([1, 1], 0.5, [0, 1]).is_ok());
    for owned in [0, 1, 2, 3, usize::MAX] {
        for (tags, kinds) in [(&[1, 2][..], &[1][..]), (&[1], &[1, 1]), (&[], &[])] {
            let short = atoms(owned, &x, &v, tags, kinds);
            assert!(s.densities(&open, &[true], true, &short, &hot, &mut f).is_err());
            assert!(s.forces(&short, &hot, &mut f).is_err());
        }
        for (i, j, factor) in [(-1, 0, 1.0), (0, i32::MAX, 1.0), (7, 7, f64::NAN)] {
            let listed = Listed { i: &[i], j: &[j], factor: &[factor] };
            let all = atoms(owned, &x, &[], &[1, 2], &[1, 1]);
            assert!(s.densities_of_pairs(&listed, true, &all, &still).is_err());
        }
    }
    let wild = [f64::NAN, 0.0, 0.0, f64::INFINITY, 0.0, 1e300];
    assert!(s.evaluate(&closed, &pair, &hot, &mut f[..3]).is_err());
    assert!(s.evaluate(&closed, &atoms(2, &x, &v[..3], &[1, 2], &[1, 1]), &hot, &mut f).is_err());
    assert!(s.evaluate(&closed, &atoms(2, &x, &v, &[0, -2], &[1, 1]), &hot, &mut f).is_err());
    assert!(s.evaluate(&closed, &atoms(2, &wild, &v, &[1, 2], &[1, 1]), &hot, &mut f).is_err());
    // The style still works after these errors.
    s.evaluate(&closed, &pair, &hot, &mut f).unwrap();
}

#[test]
fn panics_become_errors() {
    let error = guard::<()>(|| panic!("lost {}", 7)).unwrap_err();
    assert!(error.to_string().contains("internal error, please report it: lost 7"));
}
