//! Pieces of configurations of many particles.

use super::support::{self, SET6};
use crate::particles::Tags;
use crate::run::{Simulation, State};
use nalgebra::Matrix3;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::thermostat::{Bodies, PairThermostat};
use psidpd_core::engine::{PeriodicBox, Precision, Settings};
use psidpd_observe::configurational::{mean_square_frequency, sums, sums_of_blocks};
use psidpd_observe::frame::{Frame, View};
use psidpd_observe::piece::Piece;

const MIXTURE: &str = include_str!("../../../models/huggins.toml");
const PLANE: &str = include_str!("../../../models/van-der-waals-2d.toml");

/// Particles at random, of two masses where there are two species.
fn crowd(model: &str, space: &str, density: f64) -> (Simulation, Evaluator) {
    let text = format!(
        "model = \"m.toml\"\nkT = 1.0\nseed = 5\n[box]\n{space}\n[initial]\nkind = \"random\"\n\
         density = {density}\n[[stage]]\nname = \"a\"\nsteps = 1\ndt = 0.01\n"
    );
    let scene = support::scene(model, &text).unwrap();
    let simulation = Simulation::new(&scene.model, scene.kt, scene.initial_state(), scene.seed).unwrap();
    (simulation, Evaluator::new(scene.model.at(1.0).unwrap()).unwrap())
}

/// A tilted box, and the particles moved into it from another.
fn tilted(simulation: &Simulation) -> (PeriodicBox, Vec<[f64; 3]>) {
    let edges = Matrix3::new(11.0, 3.0, -2.0, 0.0, 12.0, 4.0, 0.0, 0.0, 13.0);
    let domain = PeriodicBox::new([0.5, 1.0, -2.0], edges, [true; 3]).unwrap();
    let state = simulation.state();
    let x = state.x.iter().map(|x| domain.point(state.domain.fraction(*x))).collect();
    (domain, x)
}

/// Forces, Laplacians and frequencies in a piece are those in the whole configuration, weighted alike: in boxes that are periodic, tilted, open
/// along one direction, too narrow to be cut, and in the plane, wherever the piece lies.
#[test]
fn a_piece_has_the_forces_of_the_whole() {
    for (model, space, density) in [
        (SET6, "lengths = [12.0, 11.0, 13.0]", 3.0),
        (SET6, "lengths = [11.0, 12.0, 13.0] # tilted", 3.0),
        (SET6, "lengths = [11.0, 12.0, 13.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]", 3.0),
        (SET6, "lengths = [5.0, 6.0, 40.0]", 3.0),
        (PLANE, "lengths = [16.0, 18.0]", 20.0),
    ] {
        let (simulation, evaluator) = crowd(model, space, density);
        let (domain, x) = tilted(&simulation);
        let view = match space.ends_with("tilted") {
            true => View { domain: &domain, x: &x, ..simulation.view(0.0) },
            false => simulation.view(0.0),
        };
        let range = evaluator.fluid.conservative_range();
        assert!(Piece::of(view.whole(), range, view.x.len(), 3).is_none());
        for middle in [0, 7, view.x.len() - 1] {
            let piece = Piece::of(view.whole(), range, 2000, middle).unwrap();
            let few = Frame::of_piece(view, Some(&piece), &evaluator);
            let mut all = Frame::new(view, &evaluator);
            all.piece = Some(&piece);
            let part = few.view.x.len();
            assert!(part < view.x.len() && part >= 2000, "{space}: {part} of {}", view.x.len());
            assert_eq!(piece.weight(view.x[middle]), (1.0, [0.0; 3]), "{space}");
            let moving = (0..part).filter(|k| few.moves(*k)).count();
            assert!(moving > 100 && moving < part, "{space}: {moving} of {part}");
            for (found, expected) in sums(&few).into_iter().zip(sums(&all)) {
                assert!((found - expected).abs() < 1e-10 * expected.abs(), "{space}: {found} {expected}");
            }
            let of_blocks = sums_of_blocks(&few);
            assert!(of_blocks.len() >= 8, "{space}: {}", of_blocks.len());
            let [found, expected] = [&few, &all].map(mean_square_frequency);
            assert!((found - expected).abs() < 1e-10 * expected.abs(), "{space}: {found} {expected}");
        }
    }
}

/// The gradient of the weight is that of its differences, but at its two kinks; weights are 0 or 1 elsewhere.
#[test]
fn weights_fall_by_their_gradient() {
    let (simulation, evaluator) = crowd(SET6, "lengths = [11.0, 12.0, 13.0]", 3.0);
    let (domain, x) = tilted(&simulation);
    let view = View { domain: &domain, x: &x, ..simulation.view(0.0) };
    let piece = Piece::of(view.whole(), evaluator.fluid.conservative_range(), 2000, 40).unwrap();
    let h = 1e-6;
    let (mut inside, mut kinks) = (0, 0);
    for x in view.x {
        let (weight, gradient) = piece.weight(*x);
        assert!((0.0..=1.0).contains(&weight));
        let moved = |c: usize, h: f64| {
            let mut x = *x;
            x[c] += h;
            piece.weight(x).0
        };
        let slope: [f64; 3] = std::array::from_fn(|c| (moved(c, h) - moved(c, -h)) / (2.0 * h));
        let off = (0..3).map(|c| (slope[c] - gradient[c]).abs()).fold(0.0, f64::max);
        kinks += usize::from(off > 1e-7);
        inside += usize::from(weight > 0.0 && weight < 1.0);
    }
    // A particle is within 10⁻⁶ of a kink with a probability of 10⁻⁵.
    assert!(inside > 300 && kinks <= 2, "{inside} {kinks}");
}

/// Temperature and rate of the thermostat in a piece are those of all pairs, weighted alike: in both precisions of the engine, in a tilted
/// box, in the plane, of a mixture of two masses, and where many particles never move.
#[test]
fn the_thermostat_sees_a_piece_as_the_whole() {
    for (model, space, density, precision) in [
        (SET6, "lengths = [12.0, 11.0, 13.0]", 3.0, Precision::Mixed),
        (SET6, "lengths = [11.0, 12.0, 13.0] # tilted", 3.0, Precision::Double),
        (SET6, "lengths = [5.0, 6.0, 40.0]", 3.0, Precision::Mixed),
        (PLANE, "lengths = [16.0, 18.0]", 20.0, Precision::Double),
        (MIXTURE, "lengths = [12.0, 12.0, 12.0]", 4.0, Precision::Mixed),
    ] {
        let (mut simulation, _) = crowd(model, space, density);
        if model == MIXTURE {
            let state = State { mass: vec![0.5, 3.0], ..simulation.state().clone() };
            simulation = Simulation::new(simulation.model(), 0.7, state, 5).unwrap();
        }
        if space.ends_with("tilted") {
            let (domain, x) = tilted(&simulation);
            let state = State { domain, x, ..simulation.state().clone() };
            simulation = Simulation::new(simulation.model(), 1.0, state, 5).unwrap();
        }
        let settings = Settings { precision, ..simulation.settings() };
        simulation.set_settings(settings).unwrap();
        if density == 3.0 {
            simulation.set_frozen(&Tags::Ranges((1..2000).step_by(3).map(|tag| tag..=tag).collect()));
        }
        let frozen = simulation.frozen().to_vec();
        let mut all = PairThermostat::new(simulation.engine().plan(), &settings).unwrap();
        let State { domain, x, v, tag, species, mass, .. } = simulation.state().clone();
        let bodies =
            Bodies { domain: &domain, x: &x, tag: &tag, species: &species, mass: &mass, frozen: &frozen };
        all.find_pairs(simulation.engine().pool(), &bodies, 0.02, false).unwrap();
        let whole = all.warmth(&v, |_| 1.0).unwrap();
        for middle in [0, 7, x.len() - 1] {
            let range = simulation.engine().plan().cutoff();
            let piece = Piece::of(simulation.view(0.0).whole(), range, 2000, middle).unwrap();
            assert!(piece.x.len() < x.len());
            let expected = all.warmth(&v, |k| piece.weight(x[k]).0).unwrap();
            let found = simulation.warmth(0.02, Some(&piece)).unwrap().unwrap();
            for (found, expected) in [(found.kt, expected.kt), (found.rate, expected.rate)] {
                assert!((found / expected - 1.0).abs() < 1e-5, "{space}: {found} {expected}");
            }
            // A part of the pairs has another temperature than all, of the same fluid.
            assert!(
                found.kt != whole.kt && (found.rate / whole.rate - 1.0).abs() < 0.2,
                "{found:?} {whole:?}"
            );
        }
    }
}
