//! Velocity Verlet, then a thermostat of one pair after the other, in the order of cells and tags.
//!
//! ```text
//! v += ½Δt F/m;  x += Δt v;  v += ½Δt F/m;  for each pair a new relative velocity u
//! ```
//!
//! In an ideal gas the Maxwell distribution is kept exactly at any Δt. One evaluation of forces, one pass over pairs. T_kin is
//! measured behind the thermostat.
//!
//! The thermostat of Peters, Europhys. Lett. 66, 311 (2004), scheme II, is the exact Ornstein–Uhlenbeck process of each pair by
//! itself, `u′ = c u + √(kT/μ (1 − c²)) ξ` with `c = exp(−D Δt/μ)`. With conservative forces of first order in general; their
//! error alone is left, of second order, in what does not depend on the order of the two parts.
//!
//! The thermostat of Lowe, Europhys. Lett. 47, 145 (1999), takes `u` with the probability `1 − exp(−D Δt/μ)` from the Maxwell
//! distribution. So `u` relaxes at the rate Γ = D/μ = γ w_R²/μ, as it does with drag; with `exponent = 0` in the model that is
//! Lowe's constant Γ = γ/μ within the range. (He takes ΓΔt for the probability, which is the same for small Δt and needs
//! ΓΔt ≤ 1.) The dynamics is not that of DPD: there is no limit of small Δt with continuous drag, and viscosities can be higher.

use super::{Heat, Law, RunError, Simulation, Stream, Update, Want};

pub fn step(
    system: &mut Simulation,
    dt: f64,
    want: Want,
    update: Update,
    noise: Law,
) -> Result<(), RunError> {
    system.kick_and_drift(0.5 * dt, dt)?;
    system.conservative_forces(want)?;
    system.kick(0.5 * dt)?;
    system.heat(Heat { update, noise, time: dt, stream: Stream(0) }, want, dt)
}
