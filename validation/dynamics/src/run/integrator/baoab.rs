//! BAOAB: Leimkuhler and Matthews, Appl. Math. Res. Express 2013, 34.
//!
//! ```text
//! v += ½Δt F/m;  x += ½Δt v;  thermostat for Δt;  x += ½Δt v;  v += ½Δt F/m
//! ```
//!
//! The thermostat is exact for the Maxwell distribution; what is left is the error of the conservative force, of second order.
//! Configurations are often better than velocities: the temperature at the end of a step, where T_kin is measured, is
//! too low by a term of second order where forces are stiff. One evaluation of forces a step; the thermostat acts at other
//! positions and has a search of its own.

use super::{Coupling, Path, RunError, Simulation, Want};

pub fn step(system: &mut Simulation, dt: f64, want: Want, coupling: Coupling) -> Result<(), RunError> {
    system.kick_and_drift(0.5 * dt, Path::first_half(dt, 0.5 * dt))?;
    coupling.act(system, dt, want)?;
    system.drift(Path::second_half(dt, 0.0))?;
    system.conservative_forces(want)?;
    system.defer_kick(0.5 * dt);
    Ok(())
}
