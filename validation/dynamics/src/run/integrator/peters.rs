//! Velocity Verlet, then the thermostat of Peters, Europhys. Lett. 66, 311 (2004), scheme II.
//!
//! ```text
//! v += ½Δt F/m;  x += Δt v;  v += ½Δt F/m;  for each pair u′ = c u + √(kT/μ (1 − c²)) ξ,  c = exp(−D Δt/μ)
//! ```
//!
//! which is the exact Ornstein–Uhlenbeck process of each pair by itself. In an ideal gas the Maxwell distribution is kept
//! exactly at any Δt. With conservative forces of first order in general; their error alone is left, of second order, in what
//! does not depend on the order of the two parts. The order of pairs is that of cells and tags. One evaluation of
//! forces, one pass over pairs. T_kin is measured behind the thermostat.

use super::{Law, Path, RunError, Simulation, Want};
use crate::run::simulation::Heat;
use psidpd_core::engine::thermostat::{Stream, Update};

pub fn step(system: &mut Simulation, dt: f64, want: Want, noise: Law) -> Result<(), RunError> {
    system.kick_and_drift(0.5 * dt, Path::whole(dt, 0.5 * dt))?;
    system.conservative_forces(want)?;
    system.kick(0.5 * dt)?;
    let update = Update::OrnsteinUhlenbeck;
    system.heat(Heat { update, noise, time: dt, stream: Stream(0) }, want, dt)
}
