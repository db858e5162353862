//! Results that must not depend on the order of particles in memory or on the number of threads.

use super::*;
use psidpd_core::engine::{Precision, Settings};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Two species of different mass in a box with walls and a frozen floor, large enough for several threads.
const CROWD: &str = "title = \"crowd\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 4\n\
    [box]\nlengths = [9.0, 9.0, 12.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
    [masses]\nB = 3.0\n\
    [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 0.8\nlattice = \"fcc\"\nfrozen = true\n\
    [[part]]\nshape = \"rest\"\n\
    [[body_force]]\nacceleration = [0.1, 0.0, -0.2]\n\
    [[stage]]\nname = \"a\"\nsteps = 35\nintegrator = \"groot-warren\"\n\
    [[stage]]\nname = \"b\"\nsteps = 3\n\
    [[stage]]\nname = \"c\"\nsteps = 3\nintegrator = \"two-stage\"\nthermostat_every = 2\n\
    [[stage]]\nname = \"d\"\nsteps = 3\nintegrator = \"shardlow-s2\"\n\
    [[stage]]\nname = \"e\"\nsteps = 3\nintegrator = \"self-consistent\"\n\
    [output]\nthermo = 3\ndump = 19\n";

fn crowd() -> Scene {
    support::scene(IDEAL_MIXTURE, CROWD).unwrap()
}

/// All data of the particles by tag, as bits.
fn by_tag(run: &Simulation) -> Vec<(i32, [u64; 9], [i32; 4], bool)> {
    let mut all: Vec<_> = (0..run.len())
        .map(|k| {
            let vectors = [run.state().x[k], run.state().v[k], run.forces()[k]];
            let bits = std::array::from_fn(|c| vectors[c / 3][c % 3].to_bits());
            let [a, b, c] = run.state().image[k];
            let frozen = run.frozen().get(k).is_some_and(|frozen| *frozen);
            (run.state().tag[k], bits, [a, b, c, run.state().species[k]], frozen)
        })
        .collect();
    all.sort_unstable_by_key(|p| p.0);
    all
}

fn threads(number: usize) -> NonZeroUsize {
    NonZeroUsize::new(number).unwrap()
}

#[test]
fn whole_runs_have_the_same_bytes_on_any_number_of_threads() {
    let scene = crowd();
    let folder = tempfile::tempdir().unwrap();
    let [one, two, five] = [1, 2, 5].map(|number| {
        let out = folder.path().join(format!("{number}"));
        let mut runner = Runner::begin(&scene, &out, Begin::New).unwrap();
        assert!(runner.particles() > 3 * 1024);
        runner.set_threads(threads(number)).unwrap();
        runner.run(&AtomicUsize::new(0), &mut |_| ()).unwrap();
        let checkpoint = std::fs::read(out.join("checkpoint")).unwrap();
        (files(&out), checkpoint)
    });
    assert!(one == two && one == five);
    // Files list particles by tag, whatever their order in memory.
    let dump = String::from_utf8(one.0[1].clone()).unwrap();
    for frame in dump.split("vz\n").skip(1) {
        let ids: Vec<u32> = frame.lines().map_while(|l| l.split(' ').next()?.parse().ok()).collect();
        assert!(ids.iter().copied().eq(1..=ids.len() as u32) && ids.len() > 3 * 1024);
    }
    let state = checkpoint::read_state(&folder.path().join("1")).unwrap();
    assert!(!state.tag.is_sorted());
    let data = state.to_data_by_tag("t");
    assert!(data.atoms.iter().map(|a| a.id).eq(1..=state.len() as u32));
    let velocities = data.velocities.unwrap();
    assert!((0..state.len()).all(|k| velocities[state.tag[k] as usize - 1] == state.v[k]));
}

/// Reordering moves all numbers of a particle to the same index, and changes none.
#[test]
fn reordering_keeps_particles_whole() {
    let scene = crowd();
    for (name, integrator) in Integrator::ALL {
        let [kept, moved] = [false, true].map(|on| {
            let mut run = scene.simulation(scene.initial_state()).unwrap();
            run.set_reordering(on);
            run.set_settings(Settings { threads: threads(3), ..run.settings() }).unwrap();
            run.prepare_for(integrator, 0.01, Want::FORCES).unwrap();
            run.step(0.01, integrator, Want::FORCES).unwrap();
            run
        });
        assert!(kept.state().tag.is_sorted() && !moved.state().tag.is_sorted());
        assert!(by_tag(&kept) == by_tag(&moved), "{name}");
        assert!(kept.frozen().iter().any(|f| *f));
        // Later positions differ by rounding.
        let [mut kept, mut moved] = [kept, moved];
        for run in [&mut kept, &mut moved] {
            run.advance(35, 0.01, integrator).unwrap();
        }
        let d = difference(&kept, &moved);
        assert!(d < 1e-9, "{name}: {d}");
        let flags = |run: &Simulation| by_tag(run).iter().map(|p| (p.2, p.3)).collect::<Vec<_>>();
        assert!(flags(&kept) == flags(&moved));
        assert!(kept.state().image.iter().flatten().any(|i| *i != 0));
    }
}

#[test]
fn reordering_keeps_the_physics() {
    let start = settled();
    for precision in [Precision::Double, Precision::Mixed] {
        let [kept, moved] = [false, true].map(|on| {
            let mut run = simulation(SET6, start.clone());
            run.set_settings(Settings { precision, ..run.settings() }).unwrap();
            run.set_reordering(on);
            run.prepare(0.01, Want::TOTALS).unwrap();
            for _ in 0..40 {
                run.step(0.01, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
            }
            run
        });
        assert!(!moved.state().tag.is_sorted());
        // Rounding of single precision, relative to forces of order 10², grows with the number of steps.
        let tolerance = if precision == Precision::Double { 1e-9 } else { 1e-3 };
        let d = difference(&kept, &moved);
        assert!(d < tolerance, "{d}");
        let energies = [
            kept.potential_energy() - moved.potential_energy(),
            kept.kinetic_energy() - moved.kinetic_energy(),
        ];
        assert!(energies.iter().all(|d| d.abs() < tolerance * kept.len() as f64), "{energies:?}");
    }
}

/// The pair sums have no sweep, hence no order of particles.
#[test]
fn the_reference_leaves_the_order_alone() {
    let mut run = simulation(SET6, settled());
    run.set_reordering(true);
    run.use_pair_sums_only(true);
    advance(&mut run, 3, 0.01, Integrator::VelocityVerlet);
    assert!(run.state().tag.is_sorted());
}

/// A run stopped before, at and between steps with a reordering ends with the same bytes.
#[test]
fn a_run_goes_on_between_reorderings() {
    let scene = crowd();
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole");
    run_scene(&scene, &whole, &mut |_| ()).unwrap();
    let all = |out: &Path| (files(out), std::fs::read(out.join("checkpoint")).unwrap());
    for at in [1, 20, 32, 33, 34] {
        let out = folder.path().join(format!("{at}"));
        let stop = AtomicUsize::new(0);
        let outcome = Runner::begin(&scene, &out, Begin::New).unwrap().run(&stop, &mut |p| {
            if p.step == at {
                stop.store(15, Ordering::Relaxed);
            }
        });
        assert!(matches!(outcome, Ok(Outcome::Interrupted { step, .. }) if step == at), "{outcome:?}");
        let mut runner = Runner::begin(&scene, &out, Begin::Resume).unwrap();
        runner.set_threads(threads(2)).unwrap();
        runner.run(&AtomicUsize::new(0), &mut |_| ()).unwrap();
        assert!(all(&out) == all(&whole), "{at}");
    }
}
