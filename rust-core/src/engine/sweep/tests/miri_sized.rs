//! Boxes small enough for Miri, which supports the portable instruction set only: they test every array
//! that threads share and every pass, with ghosts and without.

use super::*;

/// A fluid with one species and one density.
const ONE: &str = r#"
title = "one density"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 0.75
[excess_free_energy]
A = "0.8*n^2 + 0.1*n^3"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = -40.0
range = 1.0
[[thermostat]]
gamma = 4.5
range = 1.0
"#;

/// Two species with three densities and all pairs cached; the same with pairs in range only; and one species.
fn fluids() -> [Fluid; 3] {
    [MANY, SHORT, ONE].map(|text| Model::parse("test", text).unwrap().at(0.7).unwrap())
}

/// Particles in a box with more planes than a thread has accumulators at once.
fn cloud(fluid: &Fluid) -> Cloud {
    let domain = PeriodicBox::orthogonal([-1.0, 2.0, 0.5], [2.1, 2.2, 7.3], [true; 3]).unwrap();
    Cloud::new(domain, 3, fluid.species.len(), 70, 9)
}

/// Forces and totals of a sweep.
fn evaluated(sweep: &mut Sweep, cloud: &Cloud) -> (Vec<[f64; 3]>, Tally) {
    let (particles, mut force) = (cloud.particles(), vec![[0.0; 3]; cloud.x.len()]);
    let (step, want) = (Some(STEP), Want::TOTALS);
    let totals =
        sweep.evaluate(&cloud.domain, &Request { particles, v: &cloud.v, step, want }, &mut force, false);
    (force, totals.unwrap())
}

fn both(threads: usize) -> [Settings; 2] {
    [Precision::Mixed, Precision::Double].map(|p| settings(p, Instructions::Portable, threads))
}

#[test]
fn a_small_box_has_the_forces_of_the_plain_engine() {
    // The planes of the second box are two units each.
    let wide = PeriodicBox::orthogonal([0.0; 3], [2.1, 10.2, 2.3], [true; 3]).unwrap();
    for (fluid, domain) in fluids().into_iter().flat_map(|f| [(f.clone(), None), (f, Some(&wide))]) {
        let cloud = match domain {
            None => cloud(&fluid),
            Some(wide) => Cloud::new(wide.clone(), 3, fluid.species.len(), 70, 9),
        };
        let (force, tally) = plain(&fluid, &cloud);
        for settings in [1, 2].into_iter().flat_map(both) {
            let mut sweep = Sweep::new(&fluid, settings).unwrap();
            let (here, totals) = evaluated(&mut sweep, &cloud);
            let off = difference(&force, &here).max(tally_difference(&tally, &totals));
            assert!(off < tolerance(settings.precision), "{}, {settings:?}: {off:.1e}", fluid.title);
        }
    }
}

#[test]
fn a_small_rank_with_ghosts_has_the_forces_of_the_plain_engine() {
    for fluid in fluids() {
        let cloud = cloud(&fluid);
        let (force, tally) = plain(&fluid, &cloud);
        for settings in both(2) {
            let mut sweep = Sweep::new(&fluid, settings).unwrap();
            let (here, totals) = with_ghosts(&mut sweep, &cloud);
            let off = difference(&force, &here).max(tally_difference(&tally, &totals));
            assert!(off < tolerance(settings.precision), "{}, {settings:?}: {off:.1e}", fluid.title);
        }
    }
}

/// Planes have fewer particles than a vector has lanes, and slabs one plane or none: vectors that read
/// beyond the last particle of a slab must not read data that another thread writes.
#[test]
fn nearly_empty_planes_are_of_many_threads() {
    for fluid in fluids() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [2.1, 2.2, 9.3], [true; 3]).unwrap();
        let cloud = Cloud::new(domain, 3, fluid.species.len(), 21, 4);
        for precision in [Precision::Mixed, Precision::Double] {
            let of = |threads| {
                let settings = settings(precision, Instructions::Portable, threads);
                evaluated(&mut Sweep::new(&fluid, settings).unwrap(), &cloud)
            };
            let one = of(1);
            for threads in [3, 12] {
                assert!(one == of(threads), "{}, {threads} threads", fluid.title);
            }
        }
    }
}

/// Two sweeps with the same threads that run at once take turns.
#[test]
fn sweeps_that_share_threads_do_not_disturb_each_other() {
    let [fluid, ..] = fluids();
    let cloud = cloud(&fluid);
    let mut first = Sweep::new(&fluid, settings(Precision::Mixed, Instructions::Portable, 3)).unwrap();
    let expected = evaluated(&mut first, &cloud);
    let second = Sweep::of_plan(first.plan.clone(), first.settings, first.pool.clone());
    std::thread::scope(|scope| {
        for mut sweep in [first, second] {
            let (cloud, expected) = (&cloud, &expected);
            scope.spawn(move || {
                for _ in 0..if cfg!(miri) { 2 } else { 50 } {
                    assert!(evaluated(&mut sweep, cloud) == *expected);
                }
            });
        }
    });
}
