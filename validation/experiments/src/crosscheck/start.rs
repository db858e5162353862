//! Configurations that the codes start from, made by the native runner.

use super::fluids::WarrenSet;
use crate::ExperimentError;
use chacha20::ChaCha8Rng;
use psidpd_core::engine::{PeriodicBox, Want};
use psidpd_dynamics::particles::thermal_velocities;
use psidpd_dynamics::run::{Integrator, Simulation, State};
use rand::{RngExt, SeedableRng};

/// A box and how much of it is filled along z.
#[derive(Debug, Clone, Copy)]
pub struct Filling {
    /// Edges.
    pub lengths: [f64; 3],
    /// Height of the filled part, centred.
    pub thickness: f64,
    /// Number density there.
    pub density: f64,
}

/// Random particles in the filled part at kT = 1, brought to equilibrium over `steps` steps of 0.01 with
/// the thermostat on, from random positions by shorter steps.
pub fn equilibrated(
    set: &WarrenSet,
    filling: Filling,
    steps: u64,
    seed: u64,
) -> Result<State, ExperimentError> {
    let [lx, ly, lz] = filling.lengths;
    let count = (lx * ly * filling.thickness * filling.density).round() as usize;
    let domain = PeriodicBox::orthogonal([0.0; 3], filling.lengths, [true; 3])
        .map_err(|e| ExperimentError::Run(psidpd_dynamics::run::RunError::State(e.to_string())))?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let low = 0.5 * (lz - filling.thickness);
    let x: Vec<[f64; 3]> = (0..count)
        .map(|_| {
            let mut u = || random.random::<f64>();
            [lx * u(), ly * u(), low + filling.thickness * u()]
        })
        .collect();
    let v = thermal_velocities(std::iter::repeat_n(1.0, count), 1.0, 3, &mut random);
    let state = State { v, ..State::at_rest(domain, vec![1.0], x) };
    let mut simulation = Simulation::new(&set.shipped()?, 1.0, state, seed)?;
    for (dt, steps) in [(0.001, 100), (0.01, steps)] {
        simulation.prepare(dt, Want::FORCES)?;
        simulation.advance(steps, dt, Integrator::VelocityVerlet)?;
    }
    Ok(simulation.state())
}
