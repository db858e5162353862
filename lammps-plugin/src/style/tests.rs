use super::*;
use crate::converted::triples;
use psidpd_core::engine::{Around, PairsOfHost, Step};
use psidpd_core::model::WarrenPair;

const MODEL: &str = "title = \"t\"\nspecies = [\"A\", \"B\"]\n[[pair]]\nbetween = [\"A\", \"B\"]\n\
    form = \"soft\"\nstrength = 25\nrange = 1\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\n\
    strength = 25\nrange = 1\n[[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n";

fn style(names: &[&str], dimensions: usize) -> Result<Style, StyleError> {
    let names: Vec<String> = names.iter().map(|s| (*s).to_owned()).collect();
    Style::new(Model::parse("m.toml", MODEL).unwrap(), 1.0, &names, dimensions)
}

/// A request for forces of atoms in the flat arrays of LAMMPS.
fn request<'a>(
    owned: usize,
    x: &'a [f64],
    v: &'a [f64],
    tag: &'a [i32],
    kind: &'a [i32],
    step: Option<Step>,
) -> Request<'a> {
    let particles = Particles { owned, x: triples(x), tag, kind };
    Request { particles, v: triples(v), step, want: Want::FORCES }
}

#[test]
fn types_map_to_species_by_name() {
    let mut s = style(&["B", "NULL", "A"], 3).unwrap();
    let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
    let mut f = [0.0; 6];
    let open = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [false; 3]).unwrap();
    let around = Surroundings::Ghosts(Around { domain: &open, images: &[] }, Newton::On);
    s.densities(around, &request(2, &x, &[], &[1, 2], &[1, 2], None), &mut f).unwrap();
    s.forces(&request(2, &x, &[], &[1, 2], &[1, 2], None), &mut f).unwrap();
    assert_eq!(f, [0.0; 6]);
    s.densities(around, &request(2, &x, &[], &[1, 2], &[1, 3], None), &mut f).unwrap();
    s.forces(&request(2, &x, &[], &[1, 2], &[1, 3], None), &mut f).unwrap();
    assert_eq!(f, [-12.5, 0.0, 0.0, 12.5, 0.0, 0.0]);
    // Without ghosts, forces are added to those in `f`.
    s.evaluate(&open, &request(2, &x, &[], &[1, 2], &[1, 3], None), &mut f).unwrap();
    assert_eq!(f, [-25.0, 0.0, 0.0, 25.0, 0.0, 0.0]);
}

/// A request for densities that no force needs does not slow later steps down.
#[test]
fn densities_of_one_step_leave_later_steps_to_the_sweep() {
    let text = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
        [density.m]\nkernel = \"linear\"\nrange = 1\n[excess_free_energy]\nA = \"n^2 + m\"\n";
    let mut s = Style::new(Model::parse("m.toml", text).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
    let (x, tag, kind) = ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], [1, 2], [1, 1]);
    let w = 3.0 / std::f64::consts::PI * 0.5;
    s.sum_densities(&request(2, &x, &[], &tag, &kind, None).particles).unwrap();
    assert_eq!(s.engine().results().densities, [0.0; 4]);
    for _ in 0..2 {
        s.evaluate(&PeriodicBox::OPEN, &request(2, &x, &[], &tag, &kind, None), &mut [0.0; 6]).unwrap();
        assert_eq!(s.engine().path(), Some(EnginePath::Sweep));
        s.sum_densities(&request(2, &x, &[], &tag, &kind, None).particles).unwrap();
        let densities = s.engine().results().densities;
        assert_eq!(densities.len(), 4);
        assert!((densities[1] - w).abs() < 1e-14 && densities[0] > 0.0, "{densities:?}");
        assert_eq!(s.engine().path(), Some(EnginePath::Sweep));
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
    let missing = crate::bridge::read_model("nowhere.toml").unwrap_err();
    assert!(missing.to_string().contains("nowhere.toml: cannot be read"), "{missing}");
}

#[test]
fn types_without_coefficients_take_no_part() {
    let pair = WarrenPair { a: -40.0, b: 25.0, gamma: 1.0, rc: 1.0, rd: 0.75 };
    let mut table = vec![None; 9];
    table[4] = Some(pair);
    for masses in [None, Some(&[7.0, 1.0, 2.0][..])] {
        let mut table = table.clone();
        let style = Style::from_coefficients(1.0, &table, 3, 3, masses).unwrap();
        assert_eq!(style.kinds, [-1, -1, 0, -1]);
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
    let open = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [false; 3]).unwrap();
    let closed = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [true; 3]).unwrap();
    let extremes = [i32::MIN, -1, 0, 1, 2, 3, i32::MAX];
    for threads in [0, 1025, usize::MAX] {
        let error = s.configure(false, threads).unwrap_err().to_string();
        assert!(error.contains("from 1 to 1024"), "{error}");
    }
    // Before the first evaluation no particle is known.
    assert!(extremes.iter().all(|i| s.single([1, 1], 0.5, [*i, 0]).is_err()));
    let (x, v) = ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], [0.0; 6]);
    let step = Some(Step { seed: 1, number: 1, dt: 0.01 });
    let mut f = [0.0; 6];
    s.evaluate(&closed, &request(2, &x, &v, &[1, 2], &[1, 1], step), &mut f).unwrap();
    s.engine_mut().fetch_slopes(2);
    assert!(s.single([1, 1], 0.5, [0, 1]).unwrap().1 > 0.0);
    for i in extremes {
        for pair in [[i, 0], [0, i], [i, i]] {
            assert_eq!(s.single([1, 1], 0.5, pair).is_ok(), pair.iter().all(|k| (0..2).contains(k)));
        }
    }
    let around = Surroundings::Ghosts(Around { domain: &open, images: &[] }, Newton::On);
    for [i, kind] in extremes.into_iter().flat_map(|i| extremes.map(|kind| [i, kind])) {
        let _ = s.single([kind, i], f64::NAN, [0, 1]);
        let kinds = [1, kind];
        let done = s.densities(around, &request(2, &x, &v, &[1, 2], &kinds, step), &mut f);
        assert!(done.is_ok() == (kind == 1) || kind == 0);
    }
    // The pairs of half an evaluation are not known yet.
    let whole = request(2, &x, &v, &[1, 2], &[1, 1], step);
    s.densities(around, &whole, &mut f).unwrap();
    assert!(s.single([1, 1], 0.5, [0, 1]).is_err());
    s.forces(&whole, &mut f).unwrap();
    assert!(s.single([1, 1], 0.5, [0, 1]).is_ok());
    let around = Surroundings::Ghosts(Around { domain: &open, images: &[true] }, Newton::On);
    for owned in [0, 1, 2, 3, usize::MAX] {
        for (tags, kinds) in [(&[1, 2][..], &[1][..]), (&[1], &[1, 1]), (&[], &[])] {
            let short = s.densities(around, &request(owned, &x, &v, tags, kinds, step), &mut f);
            assert!(short.is_err());
            assert!(s.forces(&request(owned, &x, &v, tags, kinds, step), &mut f).is_err());
        }
        for (i, j, factor) in [(-1, 0, 1.0), (0, i32::MAX, 1.0), (7, 7, f64::NAN)] {
            let listed = PairsOfHost { i: &[i], j: &[j], factor: &[factor] };
            assert!(
                s.densities(
                    Surroundings::Listed(listed, Newton::On),
                    &request(owned, &x, &[], &[1, 2], &[1, 1], None),
                    &mut []
                )
                .is_err()
            );
        }
    }
    assert!(s.evaluate(&closed, &request(2, &x, &v, &[1, 2], &[1, 1], step), &mut f[..3]).is_err());
    assert!(s.evaluate(&closed, &request(2, &x, &v[..3], &[1, 2], &[1, 1], step), &mut f).is_err());
    assert!(s.evaluate(&closed, &request(2, &x, &v, &[0, -2], &[1, 1], step), &mut f).is_err());
    let wild = [f64::NAN, 0.0, 0.0, f64::INFINITY, 0.0, 1e300];
    assert!(s.evaluate(&closed, &request(2, &wild, &v, &[1, 2], &[1, 1], step), &mut f).is_err());
    // The style still works after these errors.
    s.evaluate(&closed, &request(2, &x, &v, &[1, 2], &[1, 1], step), &mut f).unwrap();
}

#[test]
fn panics_become_errors() {
    let error = guard::<()>(|| panic!("lost {}", 7)).unwrap_err();
    assert!(error.to_string().contains("internal error, please report it: lost 7"));
}
