//! Memory of the native runner, by the peak of a process that does nothing else.

use crate::ExperimentError;
use crate::fluids::MDPD;
use crate::machine::peak_kilobytes;
use crate::start::{Filling, SEED, random};
use psidpd_core::engine::{Settings, Want};
use psidpd_dynamics::run::{Integrator, Simulation};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Child {
    pub particles: usize,
    /// The most memory that the process ever had, in bytes.
    pub peak_bytes: u64,
    pub engine_bytes: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    pub particles: usize,
    /// Peak of the process in bytes, less that of a small system.
    pub peak_bytes: u64,
    /// That per particle: state, forces, arrays of the engine, allocator's losses.
    pub bytes_per_particle: f64,
    pub engine_bytes_per_particle: f64,
}

/// A system small enough that its particles do not show beside the program.
const SMALL: usize = 1000;

/// The work of the child: some steps of the many-body fluid in mixed precision from random positions.
pub fn child(particles: usize) -> Result<Child, ExperimentError> {
    let state = random(&MDPD, Filling::of_size(particles)?, SEED)?;
    let mut simulation = Simulation::new(&MDPD.model()?, 1.0, state, SEED)?;
    simulation.set_settings(Settings::default())?;
    simulation.set_reordering(true);
    // Short steps: random particles sit on each other.
    let dt = 0.1 * MDPD.dt;
    simulation.prepare(dt, Want::FORCES)?;
    simulation.advance(5, dt, Integrator::VelocityVerlet)?;
    let peak_bytes = 1024 * peak_kilobytes()?;
    Ok(Child { particles, peak_bytes, engine_bytes: simulation.engine().memory() as u64 })
}

fn in_child(program: &Path, particles: usize) -> Result<Child, ExperimentError> {
    let output = Command::new(program)
        .args(["bench", "--measure-memory", &particles.to_string()])
        .output()
        .map_err(ExperimentError::at(program))?;
    let said = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&said).map_err(|_| {
        ExperimentError::Memory(format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr)))
    })
}

/// Measures each size with `program`, which is psidpd.
pub fn measure(program: &Path, sizes: &[usize]) -> Result<Vec<Memory>, ExperimentError> {
    if sizes.is_empty() {
        return Ok(Vec::new());
    }
    let small = in_child(program, SMALL)?;
    sizes
        .iter()
        .map(|&size| {
            let child = in_child(program, size)?;
            let peak_bytes = child.peak_bytes.saturating_sub(small.peak_bytes);
            let added = size.saturating_sub(SMALL).max(1) as f64;
            Ok(Memory {
                particles: size,
                peak_bytes,
                bytes_per_particle: peak_bytes as f64 / added,
                engine_bytes_per_particle: child.engine_bytes as f64 / size as f64,
            })
        })
        .collect()
}
