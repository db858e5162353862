//! ABOBA: Leimkuhler and Shang, J. Comput. Phys. 280, 72 (2015); Shang, J. Comput. Phys. 437, 110320 (2021).
//!
//! ```text
//! x += ½Δt v;  v += ½Δt F/m;  thermostat for Δt;  v += ½Δt F/m;  x += ½Δt v
//! ```
//!
//! The thermostat is exact for the Maxwell distribution, so that what is left is the error of the
//! conservative force, of second order; an ideal gas has none. One evaluation of forces a step, and the
//! thermostat acts at the same positions. These are in the middle of the step: the energies and pressures
//! that a run reports are computed again at its end, which trajectories do not depend on. T_kin is that of the
//! velocities at the end of the step, behind a kick.

use super::{Coupling, Path, RunError, Simulation, Want};

pub fn step(system: &mut Simulation, dt: f64, want: Want, coupling: Coupling) -> Result<(), RunError> {
    system.drift(Path::first_half(dt, 0.0))?;
    coupling.announce(system, dt);
    system.conservative_forces(Want::FORCES)?;
    system.kick(0.5 * dt)?;
    coupling.act(system, dt, want)?;
    system.kick_and_drift(0.5 * dt, Path::second_half(dt, 0.5 * dt))
}
