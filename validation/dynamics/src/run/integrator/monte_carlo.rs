//! Metropolis Monte Carlo: Metropolis et al., J. Chem. Phys. 21, 1087 (1953).
//!
//! ```text
//! sweeps times: for each particle in turn x′ = x + a uniform displacement, taken with probability min(1, exp(−ΔU/kT));
//! v from Maxwell's distribution
//! ```
//!
//! A sweep keeps the canonical distribution of positions exactly, whatever the length of moves, since the order of particles
//! does not depend on where they are; behind walls nothing is taken. Velocities are drawn at the end of each step, without
//! the total momentum where that is conserved: they are exact, and say nothing of the positions. There is no time: the clock
//! advances by one a step. Random numbers are those of the scene's seed and the step's number.
//!
//! U is that of the model in double precision. Everything that changes from trial to trial is computed again at the
//! beginning of a step, so that a run which goes on from a checkpoint makes the same moves.

use super::{RunError, Simulation, Want};

pub fn step(system: &mut Simulation, want: Want, sweeps: u64, max_move: Option<f64>) -> Result<(), RunError> {
    let mut random = system.random_of_step();
    system.make_sweeps(&mut random, sweeps, max_move)?;
    system.draw_velocities(&mut random);
    system.record_rest(want)
}
