//! Looks at the configurational temperature of a run, of a piece of many particles.
//!
//! Each piece is around another particle, so that time and memory of a look are bounded whatever the number of particles.

use super::Simulation;
use crate::scene::Stage;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::frame::Frame;
use psidpd_observe::piece::Piece;
use psidpd_observe::series::Series;
use psidpd_observe::statistics::MINIMUM_SAMPLES;
use psidpd_observe::{Estimate, configurational};

/// Largest number of steps between configurational temperatures, and the smallest number of evaluations of forces: one
/// costs about as much as ten steps of velocity Verlet.
const RARE: u64 = 1000;
const LEAST_RARE: u64 = 250;

/// Of more particles a temperature is that of a piece with about so many.
pub(super) const FEW: usize = 20_000;

/// Target number of configurational temperatures in a stage.
const LOOKS: u64 = 60;

/// With as many configurations their scatter in time gives the error, which the scatter over blocks only bounds: in a slab
/// blocks of the surface differ from those inside.
const ENOUGH: usize = 20;

/// Ratio of the true error of a configurational temperature to the error from blocks taken as independent:
/// blocks share the pairs across their faces. Measured 1.0 to 1.2 in Warren's set 6 and standard DPD.
const FACES: f64 = 1.2;

/// A stage of at least this many steps is sampled for its configurational temperature. If the thermostat
/// keeps velocities right at any time step, only this temperature reveals a step that is too long.
pub(super) const WORTH_A_LOOK: u64 = 1000;

/// Sums over the spatial blocks of one configuration: of `a` = Σ F·F and `b` = Σ ∇²U of each block, and of their products.
#[derive(Debug, Clone, Copy)]
pub(super) struct Configurational {
    a: f64,
    b: f64,
    aa: f64,
    ab: f64,
    bb: f64,
    /// Effective number of blocks; blocks with a small share of the sum count less.
    blocks: f64,
}

impl Configurational {
    pub fn of(blocks: &[[f64; 2]]) -> Configurational {
        let sum = |f: &dyn Fn(f64, f64) -> f64| blocks.iter().map(|[a, b]| f(*a, *b)).sum::<f64>();
        Configurational {
            a: sum(&|a, _| a),
            b: sum(&|_, b| b),
            aa: sum(&|a, _| a * a),
            ab: sum(&|a, b| a * b),
            bb: sum(&|_, b| b * b),
            blocks: sum(&|_, b| b.abs()).powi(2) / sum(&|_, b| b * b),
        }
    }

    /// Variance of `a − ratio b`, from the scatter of its blocks.
    fn variance(&self, ratio: f64) -> f64 {
        let squares = self.aa - 2.0 * ratio * self.ab + ratio * ratio * self.bb;
        let mean = (self.a - ratio * self.b) / self.blocks;
        (squares - self.blocks * mean * mean).max(0.0) * self.blocks / (self.blocks - 1.0)
    }
}

/// Whether a configurational temperature is due: in the last two thirds of a stage, which tell whether it is off.
pub(super) fn looks_at_forces(stage: &Stage, done: u64) -> bool {
    stage.steps >= WORTH_A_LOOK
        && stage.level.is_none()
        && done.is_multiple_of(interval_of_looks(stage))
        && 3 * done > stage.steps
}

/// The number of steps between configurational temperatures; odd, for steps with and without a thermostat.
pub(super) fn interval_of_looks(stage: &Stage) -> u64 {
    let least = LEAST_RARE / stage.integrator.properties().evaluations;
    (stage.steps / LOOKS).clamp(least, RARE) | 1
}

/// `Σ a/Σ b` in units of kT. The error of each configuration comes from its blocks, and their number sets the
/// degrees of freedom of this error. The error of a longer series is at least that from its scatter, and from [`ENOUGH`]
/// configurations on it is that.
pub(super) fn estimate_configurational(samples: &[Configurational], kt: f64) -> Option<Estimate> {
    let sum = |f: &dyn Fn(&Configurational) -> f64| samples.iter().map(f).sum::<f64>();
    let (a, b) = (sum(&|s| s.a), sum(&|s| s.b));
    let mut error = FACES * sum(&|s| s.variance(a / b)).sqrt() / b;
    let mut freedom = sum(&|s| s.blocks - 1.0);
    if samples.len() >= MINIMUM_SAMPLES {
        let mut series = Series::new(2);
        samples.iter().for_each(|s| _ = series.push(&[s.a, s.b]));
        let in_time = series.ratio(|s| s[0], |s| s[1]).error;
        (error, freedom) = match samples.len() >= ENOUGH {
            true => (in_time, samples.len() as f64 - 1.0),
            false => (error.max(in_time), freedom),
        };
    }
    let found = Estimate { mean: a / b / kt, error: error / kt, samples: freedom as usize + 1, tau: 0.5 };
    (error.is_finite() && error > 0.0).then_some(found)
}

/// The sums for a configurational temperature, of a piece or of all particles, by an evaluator that earlier looks at the same fluid
/// have left. `None` if the model has none, or if the blocks are too few for an error.
pub(super) fn configurational(
    simulation: &Simulation,
    piece: Option<&Piece>,
    left: &mut Option<Evaluator>,
) -> Option<Configurational> {
    let evaluator = match left.take() {
        Some(evaluator) => evaluator,
        None => Evaluator::new(simulation.model().at(simulation.kt()).ok()?).ok()?,
    };
    let evaluator = &*left.insert(evaluator);
    let missing = configurational::missing(&evaluator.fluid, &simulation.state().domain).is_some();
    if simulation.has_body_forces() || missing {
        return None;
    }
    let frame = Frame::of_piece(simulation.view(0.0), piece, evaluator);
    let blocks = configurational::sums_of_blocks(&frame);
    let sums = Configurational::of(&blocks);
    (sums.b > 0.0 && blocks.len() > 1).then_some(sums)
}

/// A piece of many particles around one that `number` chooses; `None` if there are few.
pub(super) fn piece(simulation: &Simulation, number: u64) -> Option<Piece> {
    let range = simulation.engine().plan().cutoff().max(f64::MIN_POSITIVE);
    Piece::of(simulation.view(0.0).whole(), range, FEW, place(number, simulation.len()))
}

/// One of so many particles that `number` chooses.
pub(super) fn place(number: u64, particles: usize) -> usize {
    // A multiple of the golden ratio visits all places evenly.
    (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % particles.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four blocks with `a` of 1.1, 0.9, 1.3 and 0.7 for a `b` of 1: their ratio is 1, and the sum scatters by √(0.2 · 4/3), with the
    /// share of faces 1.2 times that. Of two such configurations both sums are twice as large. kT is 2.
    #[test]
    fn the_error_of_few_configurations_is_the_scatter_of_their_blocks() {
        let blocks = [[1.1, 1.0], [0.9, 1.0], [1.3, 1.0], [0.7, 1.0]];
        let one = Configurational::of(&blocks);
        for (count, samples) in [(1, 4), (2, 7)] {
            let found = estimate_configurational(&vec![one; count], 2.0).unwrap();
            let (n, variance) = (count as f64, 0.2 * 4.0 / 3.0);
            let expected = 1.2 * (n * variance).sqrt() / (4.0 * n) / 2.0;
            assert!((found.mean - 0.5).abs() < 1e-12 && (found.error - expected).abs() < 1e-12, "{found:?}");
            assert_eq!(found.samples, samples);
        }
        // About a ratio that is not the mean they scatter as much.
        for ratio in [0.3, 1.7] {
            assert!((one.variance(ratio) - 0.2 * 4.0 / 3.0).abs() < 1e-12, "{}", one.variance(ratio));
        }
        // Blocks of another ratio that all agree have no scatter about it, and no error is known.
        let alike = Configurational::of(&[[2.0, 1.0], [4.0, 2.0], [6.0, 3.0]]);
        assert!(alike.variance(2.0).abs() < 1e-12 && estimate_configurational(&[alike], 2.0).is_none());
        // A block with nearly all of the sum is nearly one block.
        assert!((Configurational::of(&[[0.0, 3.0], [0.0, 1.0]]).blocks - 1.6).abs() < 1e-12);
    }

    /// Of many configurations it is their scatter in time: of forty that are 5 % off, up and down in turns of two, below 2 %, where their
    /// blocks scatter by three times the sum.
    #[test]
    fn the_error_of_many_configurations_is_their_scatter_in_time() {
        let of = |k: usize| {
            let a = if (k / 2).is_multiple_of(2) { 1.05 } else { 0.95 };
            Configurational::of(&[[a + 3.0, 1.0], [a - 3.0, 1.0]])
        };
        let of_blocks = estimate_configurational(&[of(0), of(2)], 1.0).unwrap();
        let found = estimate_configurational(&(0..40).map(of).collect::<Vec<_>>(), 1.0).unwrap();
        assert!((found.mean - 1.0).abs() < 1e-12 && found.samples == 40, "{found:?}");
        assert!(found.error < 0.02 && of_blocks.error > 2.0, "{found:?} {of_blocks:?}");
    }
}
