//! The splittings of Shardlow, SIAM J. Sci. Comput. 24, 1267 (2003).
//!
//! S1: every pair in turn, half explicit and half implicit, for Δt; then velocity Verlet with conservative forces alone.
//! S2: the same for ½Δt in the opposite order, velocity Verlet, and for ½Δt.
//!
//! In an ideal gas the Maxwell distribution is kept exactly at any Δt, and particles are uncorrelated. The order of the
//! pairs is that of cells and tags: it does not depend on threads or memory. With conservative forces S1 is of first order,
//! S2 of second. One evaluation of forces; one and two passes over pairs, which only planes of cells share among threads. T_kin is
//! that of the velocities at the end of the step: behind a kick in S1, behind the thermostat in S2.

use super::{Law, Path, RunError, Simulation, Want};
use crate::run::simulation::Heat;
use psidpd_core::engine::thermostat::{Stream, Update};

pub fn first(system: &mut Simulation, dt: f64, want: Want, noise: Law) -> Result<(), RunError> {
    let update = Update::Shardlow { reversed: false };
    system.heat(Heat { update, noise, time: dt, stream: Stream(0) }, want, dt)?;
    system.kick_and_drift(0.5 * dt, Path::whole(dt, 0.5 * dt))?;
    system.conservative_forces(want)?;
    system.defer_kick(0.5 * dt);
    Ok(())
}

pub fn second(system: &mut Simulation, dt: f64, want: Want, noise: Law) -> Result<(), RunError> {
    let half = |reversed: bool, stream: u8| {
        let update = Update::Shardlow { reversed };
        Heat { update, noise, time: 0.5 * dt, stream: Stream(stream) }
    };
    system.heat(half(true, 0), want, dt)?;
    system.kick_and_drift(0.5 * dt, Path::whole(dt, 0.5 * dt))?;
    system.conservative_forces(want)?;
    system.kick(0.5 * dt)?;
    system.heat(half(false, 1), want, dt)
}
