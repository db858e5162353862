//! Pair potentials of rare species with long ranges, which the engine computes apart from the sweep.

use psidpd_core::engine::noise::threefry2x32;
use psidpd_core::engine::{
    Engine, EngineError, Evaluated, Particles, Path, PeriodicBox, Precision, Reason, Request, Settings,
    SpecialPair, Want,
};
use psidpd_core::model::wall::{Surface, Wall};
use psidpd_core::model::{Fluid, Model};
use std::num::NonZeroUsize;

/// A solvent S with small solutes B and C, of ranges up to three times that of the solvent; `density` makes all of it a many-body fluid.
fn model(dimensions: usize, density: bool) -> Model {
    let soft = |pair: &str, strength: f64, range: f64| {
        format!("[[pair]]\nbetween = {pair}\nform = \"soft\"\nstrength = {strength:?}\nrange = {range:?}\n")
    };
    let mut text = format!("title = \"m\"\nspecies = [\"S\", \"B\", \"C\"]\ndimensions = {dimensions}\n")
        + &soft("[\"S\", \"S\"]", 25.0, 1.0)
        + &soft("[\"S\", \"B\"]", 21.0, 2.1)
        + &soft("[\"S\", \"C\"]", 12.0, 0.8)
        + &soft("[\"B\", \"C\"]", 3.0, 2.6)
        + &soft("[\"B\", \"S\"]", -2.0, 1.7)
        + "[[pair]]\nbetween = [\"B\", \"B\"]\nform = \"expression\"\nphi = \"5*(3 - r)^2*exp(-r)\"\nrange = 3.0\n\
               [[pair]]\nbetween = [\"C\", \"C\"]\nform = \"spline\"\nstrength = 3.0\nA = 2.0\nB = 1.0\nrange_A = 0.8\nrange_B = 1.2\n";
    if density {
        text += "[density.n]\nkernel = \"lucy\"\nrange = 0.9\n[excess_free_energy]\nS = \"0.2*n^2\"\nB = \"0.1*n^1.5\"\nC = \"0\"\n";
    }
    Model::parse("m.toml", &text).unwrap()
}

fn fluid(dimensions: usize, density: bool) -> Fluid {
    model(dimensions, density).at(1.0).unwrap()
}

fn uniform(k: u32) -> f64 {
    f64::from(threefry2x32::<20>([k, 0], [7, 4])[0]) / 2f64.powi(32)
}

/// Particles at random places, some of them outside along periods, every 80th of species 1, every 31st of species 2.
fn particles(domain: &PeriodicBox, dimensions: usize, count: u32) -> (Vec<[f64; 3]>, Vec<i32>) {
    let place = |k: u32| {
        let s = [0, 1, 2].map(|c| uniform(4 * k + c));
        let image = |c: u32| f64::from(u32::from(domain.periodic()[c as usize]) * ((k + c) % 7 / 6));
        let images = [0, 1, 2].map(image);
        let third = if dimensions == 2 { 0.5 } else { s[2] + images[2] };
        domain.point([s[0] + images[0], s[1] - images[1], third])
    };
    let kind = |k: u32| if k.is_multiple_of(80) { 1 } else { 2 * i32::from(k.is_multiple_of(31)) };
    ((0..count).map(place).collect(), (0..count).map(kind).collect())
}

fn engine(fluid: &Fluid, precision: Precision, threads: usize) -> Engine {
    let settings =
        Settings { precision, threads: NonZeroUsize::new(threads).unwrap(), ..Settings::default() };
    Engine::new(fluid, settings).unwrap()
}

/// The evaluation by sums over pairs.
fn plain(
    fluid: &Fluid,
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    kinds: &[i32],
    map: Option<&[i32]>,
) -> Evaluated {
    let mut engine = engine(fluid, Precision::Double, 1);
    map.iter().for_each(|map| engine.map_kinds(map).unwrap());
    engine.use_pair_sums_only(true);
    engine.evaluate(x, domain, kinds).unwrap()
}

fn agree(found: &Evaluated, expected: &Evaluated, bound: f64, what: &str) {
    let largest = expected.forces.as_flattened().iter().fold(0.0f64, |a, f| a.max(f.abs()));
    for (k, (f, e)) in found.forces.iter().zip(&expected.forces).enumerate() {
        let off = (0..3).map(|c| (f[c] - e[c]).abs()).fold(0.0, f64::max);
        assert!(off < bound * largest, "{what}: particle {k} has {f:?}, expected {e:?}");
    }
    let scale = expected.virial.iter().fold(expected.energy.abs(), |a, w| a.max(w.abs()));
    let off = (found.energy - expected.energy).abs();
    assert!(off < bound * scale, "{what}: energy {} {}", found.energy, expected.energy);
    for (found, expected) in found.virial.iter().zip(expected.virial) {
        assert!((found - expected).abs() < bound * scale, "{what}: virial {found} {expected}");
    }
}

/// In boxes with periods, tilted and open ones, in the plane and in space, forces, energy and virial are those of sums over pairs, the
/// same bits for any number of threads.
#[test]
fn forces_are_those_of_sums_over_pairs() {
    let skew = nalgebra::Matrix3::new(9.0, 1.5, -2.0, 0.0, 8.0, 2.5, 0.0, 0.0, 7.0);
    let boxes = [
        (3, PeriodicBox::orthogonal([-1.0, 2.0, 0.5], [9.0, 6.1, 8.0], [true; 3]).unwrap()),
        (3, PeriodicBox::orthogonal([0.0; 3], [7.0, 9.0, 8.0], [true, false, false]).unwrap()),
        (3, PeriodicBox::orthogonal([0.0; 3], [9.0; 3], [false; 3]).unwrap()),
        (3, PeriodicBox::new([1.0, 0.0, -4.0], skew, [true; 3]).unwrap()),
        (2, PeriodicBox::orthogonal([0.0; 3], [27.0, 31.0, 1.0], [true, true, false]).unwrap()),
    ];
    for (dimensions, domain) in boxes {
        for density in [false, true] {
            let fluid = fluid(dimensions, density);
            let (x, kinds) = particles(&domain, dimensions, 1600);
            let expected = plain(&fluid, &x, &domain, &kinds, None);
            for (precision, bound) in [(Precision::Double, 1e-12), (Precision::Mixed, 2e-6)] {
                let what = format!("{dimensions}-D {density} {:?} {precision}", domain.periodic());
                let found = [1, 3].map(|threads| {
                    let mut engine = engine(&fluid, precision, threads);
                    let found = engine.evaluate(&x, &domain, &kinds).unwrap();
                    assert_eq!(engine.path(), Some(Path::Sweep), "{what}");
                    assert_eq!(engine.potentials_apart(), 5, "{what}");
                    found
                });
                agree(&found[0], &expected, bound, &what);
                assert_eq!(found[0], found[1], "{what}");
            }
        }
    }
}

/// What is rare is decided by the particles that there are, also after a change of types; where no species is, or pairs are
/// special, the sweep has all.
#[test]
fn who_is_rare_is_decided_by_the_particles() {
    let domain = PeriodicBox::orthogonal([0.0; 3], [8.0, 9.0, 7.5], [true; 3]).unwrap();
    let fluid = fluid(3, true);
    let (x, kinds) = particles(&domain, 3, 1600);
    let none_rare: Vec<i32> = (0..1600).map(|k| k % 3).collect();
    let mut engine = engine(&fluid, Precision::Double, 2);
    for (kinds, map, apart) in [
        (&kinds, [0, 1, 2], 5),
        (&none_rare, [0, 1, 2], 0),
        (&kinds, [0, 1, -1], 5),
        // Without large particles nothing is far, and the solute is the solvent.
        (&kinds, [0, -1, 0], 5),
        (&kinds, [1, 0, 0], 0),
        (&kinds, [0, 1, 2], 5),
    ] {
        engine.map_kinds(&map).unwrap();
        let found = engine.evaluate(&x, &domain, kinds).unwrap();
        assert_eq!(engine.potentials_apart(), apart, "{map:?}");
        agree(&found, &plain(&fluid, &x, &domain, kinds, Some(&map)), 1e-12, &format!("{map:?}"));
    }
    engine.set_special_pairs([SpecialPair { i: 0, j: 80, factor: 0.5 }]);
    engine.evaluate(&x, &domain, &kinds).unwrap();
    assert_eq!(engine.potentials_apart(), 0);
    engine.set_special_pairs([]);
    engine.evaluate(&x, &domain, &kinds).unwrap();
    assert_eq!(engine.potentials_apart(), 5);
    // In a narrow box particles would meet two images of each other.
    let narrow = PeriodicBox::orthogonal([0.0; 3], [5.9, 9.0, 9.0], [true; 3]).unwrap();
    let found = engine.evaluate(&x, &narrow, &kinds).unwrap();
    assert_eq!(engine.path(), Some(Path::PairSums(Reason::Box)));
    agree(&found, &plain(&fluid, &x, &narrow, &kinds, None), 1e-12, "narrow");
}

/// Large particles are apart unless they are half of all, with so many pairs that the whole sweep is as fast.
#[test]
fn large_particles_are_apart_if_they_are_few() {
    let domain = PeriodicBox::orthogonal([0.0; 3], [9.0; 3], [true; 3]).unwrap();
    let fluid = fluid(3, false);
    let (x, _) = particles(&domain, 3, 2000);
    let mut engine = engine(&fluid, Precision::Mixed, 1);
    for (every, is_apart) in [(100, true), (20, true), (10, true), (5, true), (2, false)] {
        let kinds: Vec<i32> = (0..2000).map(|k| i32::from(k % every == 0)).collect();
        engine.evaluate(&x, &domain, &kinds).unwrap();
        assert_eq!(engine.potentials_apart() > 0, is_apart, "one of {every}");
    }
}

/// A wall adds to densities and forces beside long pairs as it does to sums over pairs.
#[test]
fn walls_beside_long_pairs_have_their_forces() {
    let domain = PeriodicBox::orthogonal([0.0; 3], [8.0, 9.0, 7.5], [true, true, false]).unwrap();
    let wall = Wall {
        surface: Surface::Face { axis: 2, high: true },
        species: 1,
        density: 2.0,
        local_densities: Vec::new(),
        strength: 0.7,
        velocity: [0.0; 3],
        drag: [None; 2],
    };
    let fluid = model(3, true).with_walls(vec![wall]).at(1.0).unwrap();
    let (x, kinds) = particles(&domain, 3, 1600);
    let mut engine = engine(&fluid, Precision::Double, 2);
    let found = engine.evaluate(&x, &domain, &kinds).unwrap();
    assert_eq!(engine.potentials_apart(), 5);
    agree(&found, &plain(&fluid, &x, &domain, &kinds, None), 1e-12, "a wall");
}

/// Two particles by hand, at one point and across a period; energy and virial are those asked for, and a force that is not finite names
/// the particle.
#[test]
fn two_particles_by_hand() {
    let text = |phi: &str| {
        format!(
            "title = \"m\"\nspecies = [\"S\", \"B\"]\n[[pair]]\nbetween = [\"S\", \"S\"]\nform = \"soft\"\nstrength = 1.0\nrange = 1.0\n\
             [[pair]]\nbetween = [\"B\", \"S\"]\nform = \"expression\"\nphi = \"{phi}\"\nrange = 3.0\n\
             [[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 0.0\nrange = 1.0\n"
        )
    };
    let domain = PeriodicBox::orthogonal([0.0; 3], [10.0; 3], [true; 3]).unwrap();
    // The solvent is far away, and further apart than its range.
    let far =
        (0..60).map(|k| [1.1 * f64::from(k % 5), 1.1 * f64::from(k / 5 % 4), 5.0 + 1.1 * f64::from(k / 20)]);
    let x: Vec<[f64; 3]> =
        [[9.0, 1.0, 1.0], [1.0, 1.0, 1.0], [9.0, 1.0, 1.0]].into_iter().chain(far).collect();
    let kinds: Vec<i32> = (0..x.len()).map(|k| i32::from(k == 0)).collect();
    let tag: Vec<i32> = (11..).take(x.len()).collect();
    let particles = Particles { x: &x, tag: &tag, kind: &kinds, owned: x.len() };
    let run = |phi: &str, want: Want| {
        let fluid = Model::parse("m.toml", &text(phi)).unwrap().at(1.0).unwrap();
        let mut engine = engine(&fluid, Precision::Double, 1);
        let mut force = vec![[0.0; 3]; x.len()];
        let request = Request { particles, v: &[], step: None, want };
        let tally = engine.forces(&domain, &request, &mut force, false);
        assert_eq!(engine.potentials_apart(), 1);
        (tally, force)
    };
    // The first and the second are 2 apart across the period, the first and the third at one point: φ = 9 and 5, φ′(2) = −4.
    let (tally, force) = run("9 - r^2", Want::TOTALS);
    let tally = tally.unwrap();
    assert!((tally.pair - 14.0).abs() < 1e-12 && (tally.virial[0] - 8.0).abs() < 1e-12, "{tally:?}");
    assert!((force[0][0] + 4.0).abs() < 1e-12 && (force[1][0] - 4.0).abs() < 1e-12 && force[2] == [0.0; 3]);
    let (tally, _) = run("9 - r^2", Want::FORCES);
    assert_eq!(tally.unwrap().energy(), 0.0);
    // At half a box of edge 6 single precision does not tell which image is within the range: the pair acts once, φ = 9 − (3 − 10⁻⁹)².
    let domain = PeriodicBox::orthogonal([0.0; 3], [6.0 + 1e-9, 6.0 + 1e-9, 10.0], [true; 3]).unwrap();
    let mut half = x.clone();
    (half[0], half[1], half[2]) = ([0.5, 1.0, 1.0], [3.5 - 1e-9, 1.0, 1.0], [0.5, 1.0, 4.5]);
    let mut engine =
        engine(&Model::parse("m.toml", &text("9 - r^2")).unwrap().at(1.0).unwrap(), Precision::Double, 1);
    // Before it has met long pairs an engine has sums over pairs there.
    let wide = PeriodicBox::orthogonal([0.0; 3], [10.0; 3], [true; 3]).unwrap();
    engine.evaluate(&half, &wide, &kinds).unwrap();
    let found = engine.evaluate(&half, &domain, &kinds).unwrap();
    assert_eq!(engine.path(), Some(Path::Sweep));
    assert!(
        (found.forces[0][0] + 6.0).abs() < 1e-6 && (found.forces[1][0] - 6.0).abs() < 1e-6,
        "{:?}",
        &found.forces[..2]
    );
    // 1/(r − 2) at 2.
    let (tally, _) = run("1/(r - 2)", Want::FORCES);
    assert_eq!(tally, Err(EngineError::Force { tag: 11 }));
}
