//! The fourth-order force-gradient step, with its gradient by a second evaluation, and one thermostat.
//!
//! ```text
//! v += λΔt F/m;  x += ½Δt v;  v += (1 − 2λ)Δt F(x + ξΔt² F/m)/m;  x += ½Δt v;  v += λΔt F/m;  thermostat for Δt
//! ```
//!
//! With λ = 1/6 and ξ = 1/24 and without thermostat this is of fourth order: Chin, Phys. Lett. A 226, 344 (1997); Omelyan, Mryglod
//! and Folk, Comput. Phys. Commun. 146, 188 (2002). The middle kick is then that of the potential
//! `U − ξΔt² Σ F²/2m`, but for terms of Δt⁴ that the displaced evaluation adds, so that no second derivatives are needed. Linear
//! momentum is kept to rounding. The step is reversible in time, but where particles meet reflecting faces. It is not symplectic beyond the order of the displacement, and
//! angular momentum is kept to that order only, as forces act along the lines between displaced particles.
//!
//! Three evaluations of forces for one of the thermostat, which acts where the last forces were computed and keeps the Maxwell
//! distribution exactly. ξ = 0 is the two-stage step. T_kin is measured behind the thermostat.

use super::{Coupling, Path, RunError, Simulation, Want};

pub fn step(
    system: &mut Simulation,
    dt: f64,
    want: Want,
    [lambda, gradient]: [f64; 2],
    coupling: Coupling,
) -> Result<(), RunError> {
    system.kick_and_drift(lambda * dt, Path::first_half(dt, lambda * dt))?;
    system.displaced_forces(gradient * dt * dt)?;
    system.kick_and_drift((1.0 - 2.0 * lambda) * dt, Path::second_half(dt, (0.5 - lambda) * dt))?;
    coupling.announce(system, dt);
    system.conservative_forces(want)?;
    system.defer_kick(lambda * dt);
    coupling.act(system, dt, want)
}
