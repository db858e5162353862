//! Pairs that an evaluation of forces lists on its way.

use super::*;
use crate::engine::{Engine, Path, Request, SpecialPair, Want};

pub fn engine(model: &str, precision: Precision, threads: usize) -> Engine {
    let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
    let threads = NonZeroUsize::new(threads).unwrap();
    Engine::new(&fluid, Settings { precision, threads, ..Settings::default() }).unwrap()
}

/// Conservative forces of these particles.
pub fn request(particles: Particles) -> Request {
    Request { particles, v: &[], step: None, want: Want::FORCES }
}

fn compute_forces(engine: &mut Engine, cloud: &Cloud) -> Vec<[f64; 3]> {
    let Cloud { x, tag, species, .. } = cloud;
    let request = request(Particles { x, tag, kind: species, owned: x.len() });
    let mut force = vec![[0.0; 3]; x.len()];
    engine.forces(&cloud.domain, &request, &mut force, false).unwrap();
    force
}

/// Velocities and virial after an action with listed pairs, and whether there were any.
fn act_on_listed(model: &str, cloud: &Cloud, engine: &mut Engine) -> (Vec<[f64; 3]>, [f64; 6], bool) {
    act_again(&mut thermostat(model, 1.0, cloud.precision), cloud, engine)
}

/// The same with a thermostat that may have acted before. In memory of the engine's evaluations it does the same as in its own, and
/// gives it back; the forces are then the same.
fn act_again(
    thermostat: &mut PairThermostat,
    cloud: &Cloud,
    engine: &mut Engine,
) -> (Vec<[f64; 3]>, [f64; 6], bool) {
    let pool = engine.pool().clone();
    thermostat.ask(engine, DT);
    let force = compute_forces(engine, cloud);
    thermostat.find_pairs_with(engine, &cloud.bodies(), DT, true).unwrap();
    let listed = thermostat.are_of_forces;
    thermostat.draw(11, 5, Stream(0), Law::Gaussian);
    let (mut v, mut same) = (cloud.v.clone(), cloud.v.clone());
    let memory = engine.memory();
    let virial = thermostat.act_with(engine, Update::Midpoint, &mut v);
    assert!(engine.memory() >= memory);
    assert!(virial == thermostat.act(&pool, Update::Midpoint, &mut same) && v == same);
    assert!(force == compute_forces(engine, cloud));
    (v, virial, listed)
}

#[test]
fn listed_pairs_are_those_of_the_search() {
    for (number, (model, cloud)) in clouds().into_iter().enumerate() {
        let pool = pool(1);
        let mut v = cloud.v.clone();
        let virial = ready(model, 1.0, &cloud, &pool).act(&pool, Update::Midpoint, &mut v);
        let [one, two, five] = [1, 2, 5].map(|threads| {
            let mut engine = engine(model, cloud.precision, threads);
            let done = act_on_listed(model, &cloud, &mut engine);
            assert_eq!(done.2, engine.path() == Some(Path::Sweep), "cloud {number}");
            done
        });
        assert!(one == two && one == five, "cloud {number}");
        assert!(one.2 || cloud.domain.lengths() == [2.0; 3], "cloud {number}");
        let bound = rounding(&cloud);
        for (a, b) in one.0.iter().flatten().zip(v.iter().flatten()) {
            assert!((a - b).abs() < bound * (1.0 + b.abs()), "cloud {number}: {a} {b}");
        }
        let size = virial.iter().map(|w| w.abs()).fold(1.0, f64::max);
        for (a, b) in one.1.iter().zip(virial) {
            assert!((a - b).abs() < bound * size, "cloud {number}: {a} {b}");
        }
    }
}

/// The memory of lists goes from the thermostat to the forces and back, and what was in it does not matter: of more planes
/// or fewer, of other threads, of a search.
#[test]
fn lists_that_are_used_again_are_as_new() {
    for (threads, precision) in [(1, Precision::Mixed), (5, Precision::Mixed), (2, Precision::Double)] {
        let mut thermostat = thermostat(ONE, 1.0, precision);
        let clouds = [[3.0, 4.1, 5.3], [3.0, 3.0, 3.0], [5.0, 4.0, 9.0]]
            .map(|edges| Cloud::new(1, nalgebra::Matrix3::from_diagonal(&edges.into()), [true; 3], 6.0))
            .map(|cloud| Cloud { precision, ..cloud });
        for number in [0, 0, 1, 2, 2, 0, 1] {
            let cloud = &clouds[number];
            let mut engine = engine(ONE, precision, threads);
            assert!(act_again(&mut thermostat, cloud, &mut engine) == act_on_listed(ONE, cloud, &mut engine));
        }
        // One engine, and a search in between.
        let mut engine = engine(ONE, precision, threads);
        for number in [2, 2, 1, 0, 2] {
            let expected = act_on_listed(ONE, &clouds[number], &mut engine);
            assert!(act_again(&mut thermostat, &clouds[number], &mut engine) == expected);
            let pool = engine.pool().clone();
            thermostat.find_pairs(&pool, &clouds[number].bodies(), DT, false).unwrap();
            assert!(act_again(&mut thermostat, &clouds[number], &mut engine) == expected);
        }
    }
}

/// The pairs of another evaluation, for another time or without excluded pairs would be wrong.
#[test]
fn only_the_pairs_that_were_asked_for_are_taken() {
    let cloud = clouds().swap_remove(0).1;
    let mut engine = engine(ONE, Precision::Mixed, 1);
    assert!(act_on_listed(ONE, &cloud, &mut engine).2);
    let mut other = thermostat(ONE, 2.0, Precision::Mixed);
    let mut thermostat = thermostat(ONE, 1.0, Precision::Mixed);
    let takes = |thermostat: &mut PairThermostat, engine: &mut Engine, cloud: &Cloud, dt, virial| {
        thermostat.find_pairs_with(engine, &cloud.bodies(), dt, virial).unwrap();
        thermostat.are_of_forces
    };
    compute_forces(&mut engine, &cloud);
    assert!(!takes(&mut thermostat, &mut engine, &cloud, DT, false), "nobody asked");
    thermostat.ask(&mut engine, DT);
    compute_forces(&mut engine, &cloud);
    compute_forces(&mut engine, &cloud);
    assert!(!takes(&mut thermostat, &mut engine, &cloud, DT, false), "another evaluation has followed");
    for (dt, virial, expected) in [(DT, false, true), (2.0 * DT, false, false), (DT, true, true)] {
        thermostat.ask(&mut engine, DT);
        compute_forces(&mut engine, &cloud);
        assert_eq!(takes(&mut thermostat, &mut engine, &cloud, dt, virial), expected, "{dt} {virial}");
        assert!(!takes(&mut thermostat, &mut engine, &cloud, DT, false), "they are taken once");
    }
    // Of another thermostat, of the fluid at another temperature, and of particles that have moved or changed places.
    other.ask(&mut engine, DT);
    compute_forces(&mut engine, &cloud);
    assert!(!takes(&mut other, &mut engine, &cloud, DT, false), "it has asked an engine of another kT");
    thermostat.ask(&mut engine, DT);
    compute_forces(&mut engine, &cloud);
    assert!(!takes(&mut other, &mut engine, &cloud, DT, false), "another thermostat has asked");
    let mut moved = cloud.clone();
    moved.x[17][1] += 1e-12;
    let mut exchanged = cloud.clone();
    exchanged.x.swap(3, 4);
    for other in [moved, exchanged] {
        thermostat.ask(&mut engine, DT);
        compute_forces(&mut engine, &cloud);
        assert!(!takes(&mut thermostat, &mut engine, &other, DT, false));
    }
    engine.set_special_pairs([SpecialPair { i: 0, j: 1, factor: 0.0 }]);
    assert!(!act_on_listed(ONE, &cloud, &mut engine).2);
    engine.set_special_pairs([]);
    assert!(act_on_listed(ONE, &cloud, &mut engine).2);
    engine.use_pair_sums_only(true);
    assert!(!act_on_listed(ONE, &cloud, &mut engine).2);
}
