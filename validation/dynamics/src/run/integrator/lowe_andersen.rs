//! Velocity Verlet, then the thermostat of Lowe, Europhys. Lett. 47, 145 (1999).
//!
//! Each pair in turn gets, with the probability `1 − exp(−D Δt/μ)`, a relative velocity `u` from the Maxwell distribution.
//! So `u` relaxes at the rate Γ = D/μ = γ w_R²/μ, as it does with drag; with `exponent = 0` in the model that is Lowe's constant
//! Γ = γ/μ within the range. (He takes ΓΔt for the probability, which is the same for small Δt and needs ΓΔt ≤ 1.)
//!
//! In an ideal gas the Maxwell distribution is kept exactly at any Δt. The dynamics is not that of DPD: there is no
//! limit of small Δt with continuous drag, and viscosities can be higher. The order of pairs is that of cells and
//! tags. One evaluation of forces, one pass over pairs. T_kin is measured behind the thermostat.

use super::{Law, Path, RunError, Simulation, Want};
use crate::run::simulation::Heat;
use psidpd_core::engine::thermostat::{Stream, Update};

pub fn step(system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
    system.kick_and_drift(0.5 * dt, Path::whole(dt, 0.5 * dt))?;
    system.conservative_forces(want)?;
    system.kick(0.5 * dt)?;
    let update = Update::LoweAndersen;
    system.heat(Heat { update, noise: Law::Gaussian, time: dt, stream: Stream(0) }, want, dt)
}
