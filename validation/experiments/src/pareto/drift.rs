//! Energy without thermostat: how far it drifts, by scheme of the conservative forces, Δt and precision.

use super::origin::Origin;
use super::sample::Effort;
use super::setting::Physics;
use crate::ExperimentError;
use psidpd_core::engine::{Precision, Want};
use psidpd_dynamics::integrator::Integrator;
use serde::Serialize;
use std::num::NonZeroUsize;
use std::time::Instant;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnergyDrift {
    /// The integrator whose steps without thermostat they are.
    pub integrator: String,
    pub dt: f64,
    pub precision: String,
    /// Simulated time up to the last energy.
    pub time: f64,
    /// The slope of the energy per particle in kT, for a unit of time; nothing where the run stopped.
    pub slope: Option<f64>,
    /// One standard deviation of the slope.
    pub slope_error: Option<f64>,
    /// The largest departure from the first value, in kT per particle.
    pub largest: Option<f64>,
    pub stopped: Option<String>,
}

/// Fewest energies that a slope is taken through.
const FEWEST: u64 = 32;
const SETTLE: u64 = 2;

/// What is tried: the schemes differ in their conservative part alone.
pub fn schemes() -> Vec<Physics> {
    let wanted: [(&str, &[f64]); 4] = [
        ("velocity-verlet", &[0.5, 1.0, 2.0]),
        ("aboba", &[0.5, 1.0, 2.0]),
        ("two-stage", &[1.0, 2.0, 4.0, 6.0]),
        ("force-gradient", &[1.0, 2.0, 4.0, 6.0]),
    ];
    let mut found = Vec::new();
    for (name, multiples) in wanted {
        for (_, integrator) in Integrator::ALL.into_iter().filter(|(known, _)| *known == name) {
            for &multiple in multiples {
                for precision in [Precision::Mixed, Precision::Double] {
                    found.push(Physics { integrator, multiple, precision });
                }
            }
        }
    }
    found
}

pub fn drift(origin: &Origin, physics: &Physics, effort: Effort) -> Result<EnergyDrift, ExperimentError> {
    let dt = origin.dt(physics);
    let every = physics.interval();
    let mut run = origin.simulation(physics, NonZeroUsize::MIN, false, Want::FORCES)?;
    let (mut times, mut energies) = (Vec::new(), Vec::new());
    let scale = origin.stage.kt * run.mobile() as f64;
    let begin = Instant::now();
    let mut stopped = None;
    for sample in 0.. {
        if sample >= FEWEST && effort.is_used(1.0, begin, sample) {
            break;
        }
        let made = run
            .advance(every - 1, dt, physics.integrator)
            .and_then(|()| run.step(dt, physics.integrator, Want::TOTALS));
        if let Err(error) = made {
            stopped = Some(error.to_string());
            break;
        }
        if sample >= SETTLE {
            times.push(sample as f64 * dt * every as f64);
            energies.push((run.kinetic_energy() + run.potential_energy()) / scale);
        }
    }
    let found = psidpd_observe::drift(&times, &energies).ok().filter(|_| stopped.is_none());
    Ok(EnergyDrift {
        integrator: physics.integrator.name().to_owned(),
        dt,
        precision: physics.precision.to_string(),
        time: times.last().copied().unwrap_or(0.0),
        slope: found.map(|d| d.slope),
        slope_error: found.map(|d| d.slope_error),
        largest: found.map(|d| d.largest),
        stopped,
    })
}
