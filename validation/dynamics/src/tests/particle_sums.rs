//! Observables of runs in single precision, whose pairs the loops of the sweep sum, and in double precision.

use super::support::{self, SET6};
use crate::run::Simulation;
use crate::scene::Scene;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{Precision, Settings, Want};
use psidpd_observe::configurational::{sums, sums_of_blocks};
use psidpd_observe::frame::{Frame, View};
use psidpd_observe::{Observation, Observers, Recorded};

const MIXTURE: &str = include_str!("../../../models/huggins.toml");
const PLANE: &str = include_str!("../../../models/binary-2d.toml");
const TWO_DENSITIES: &str = include_str!("../../../models/warren2003-set6-two-densities.toml");

fn crowd(model: &str, space: &str) -> (Scene, Simulation, Evaluator) {
    let text = format!(
        "model = \"m.toml\"\nkT = 1.0\nseed = 5\n{space}\n[initial]\nkind = \"random\"\ndensity = 5.0\n\
         [[stage]]\nname = \"a\"\nsteps = 1\ndt = 0.01\nthermostat = false\n[observe]\nlocal_density = true\nenergy = true\n\
         temperature = true\n"
    );
    let scene = support::scene(model, &text).unwrap();
    let mut simulation = Simulation::new(&scene.model, scene.kt, scene.initial_state(), scene.seed).unwrap();
    simulation.set_settings(Settings { precision: Precision::Mixed, ..Settings::default() }).unwrap();
    simulation.find_conservative_forces().unwrap();
    let evaluator = Evaluator::new(scene.model.at(1.0).unwrap()).unwrap();
    (scene, simulation, evaluator)
}

/// Temperatures, in blocks of space too, local densities and energies of species agree. There are no sums of particles in double precision,
/// beside an evaluation, with walls and in narrow boxes; weights need the forces of the evaluation.
#[test]
fn sums_of_particles_are_those_of_an_evaluation() {
    for (model, space, has_sums) in [
        (SET6, "box = [6.0, 7.0, 5.0]", true),
        (MIXTURE, "box = [6.0, 7.0, 5.0]", true),
        (PLANE, "box = [16.0, 18.0]", true),
        (TWO_DENSITIES, "box = [6.0, 7.0, 5.0]", true),
        (
            SET6,
            "[box]\nlengths = [6.0, 7.0, 5.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]",
            true,
        ),
        (SET6, "box = [9.0, 7.0, 1.9]", false),
    ] {
        let (scene, simulation, evaluator) = crowd(model, space);
        let [mixed, double] =
            [Precision::Mixed, Precision::Double].map(|precision| View { precision, ..simulation.view(0.0) });
        let frame = |view| Frame::new(view, &evaluator);
        let (quick, exact) = (frame(mixed), frame(double));
        assert!(exact.sums().is_none() && quick.sums().is_some() == has_sums, "{space}");
        let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() < 1e-5 * scale, "{space} {a} {b}");
        if has_sums {
            sums(&quick).into_iter().zip(sums(&exact)).for_each(|(a, b)| close(a, b, b.abs()));
            let (blocks, sums) = (sums_of_blocks(&quick), sums(&quick));
            assert_eq!(blocks.len(), sums_of_blocks(&exact).len(), "{space}");
            let sum = |c: usize| blocks.iter().map(|block| block[c]).sum::<f64>();
            (0..2).for_each(|c| close(sum(c), sums[c], sums[c].abs()));
        }
        let found = |frame: &Frame| -> Vec<Observation> {
            let mut meters: Vec<_> = scene.observe.requests.iter().map(|r| r.meter.clone()).collect();
            assert!(meters.iter_mut().all(|meter| meter.sample(frame)));
            meters.iter().flat_map(|meter| meter.finish()).filter(|o| o.name != "local_density").collect()
        };
        let mut count = 0;
        for (a, b) in found(&quick).iter().zip(&found(&exact)) {
            for (a, b) in a.columns.iter().zip(&b.columns) {
                let values = a.values.iter().zip(&b.values);
                values.for_each(|(a, b)| close(*a, *b, b.abs().max(1.0)));
                count += a.values.len();
            }
        }
        assert!(count >= 8, "{space}: {count}");
        let late = frame(mixed);
        late.evaluation();
        assert!(late.sums().is_none(), "{space}");
    }
}

/// Profiles of stress, properties of a drop and clusters agree, from drag in the forces and apart from them, forces at displaced positions,
/// and a temperature that needs sums besides.
#[test]
fn lines_of_sums_are_those_of_an_evaluation() {
    const ATTRACTIVE: &str = include_str!("../../../models/spline-attractive.toml");
    for (model, kt, density) in
        [(SET6, 1.0, 6.0), (MIXTURE, 1.0, 5.0), (TWO_DENSITIES, 1.0, 6.0), (ATTRACTIVE, 0.5, 12.5)]
    {
        for integrator in ["velocity-verlet", "force-gradient", "aboba"] {
            let text = format!(
                "model = \"m.toml\"\nkT = {kt:?}\nseed = 5\nbox = [8.0, 9.0, 7.0]\n[initial]\nkind = \"sphere\"\nradius = 2.5\n\
                 density = {density:?}\n[[stage]]\nname = \"a\"\nsteps = 4\ndt = 0.005\nintegrator = \"{integrator}\"\n\
                 [observe]\nevery = 4\nstress_profile = {{ bins = 14 }}\ndrop = {{ bins = 14 }}\nclusters = true\ntemperature = true\n"
            );
            let scene = support::scene(model, &text).unwrap();
            let mut simulation =
                Simulation::new(&scene.model, scene.kt, scene.initial_state(), scene.seed).unwrap();
            simulation.set_settings(Settings { precision: Precision::Mixed, ..Settings::default() }).unwrap();
            simulation.prepare(0.005, Want::FORCES).unwrap();
            for k in 0..4 {
                simulation.record_flux(if k == 3 { Recorded::Lines } else { Recorded::Nothing });
                simulation.step(0.005, scene.stages[0].integrator, Want::TOTALS).unwrap();
            }
            simulation.find_conservative_forces().unwrap();
            let [quick, exact] = [Precision::Mixed, Precision::Double].map(|precision| {
                let mut observers = Observers::new(&scene.observe, ["a"]);
                observers.sample(View { precision, ..simulation.view(0.02) }, "a");
                observers.finish()
            });
            let mut count = 0;
            for (a, b) in quick.iter().zip(&exact) {
                for (a, b) in a.columns.iter().zip(&b.columns) {
                    let most = b.values.iter().fold(1.0f64, |most, b| most.max(b.abs()));
                    for (of_a, of_b) in a.values.iter().zip(&b.values) {
                        let is_close = (of_a - of_b).abs() < 2e-5 * most || of_a.is_nan() && of_b.is_nan();
                        assert!(is_close, "{kt} {density} {integrator} {}: {of_a} {of_b}", a.name);
                    }
                    count += a.values.len();
                }
            }
            assert!(count > 100, "{integrator} {count}");
            // One search has all that is expected, if forces act at the positions of the sample.
            let evaluator = Evaluator::new(scene.model.at(kt).unwrap()).unwrap();
            for shares in [false, true] {
                let mixed = View { precision: Precision::Mixed, ..simulation.view(0.02) };
                let frame = Frame::new(mixed, &evaluator);
                frame.expect_lines(shares);
                assert_eq!(frame.sums().is_some(), shares || integrator == "aboba", "{integrator}");
            }
        }
    }
}
