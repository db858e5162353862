//! Two stages of forces and one thermostat, also with the gradient of the forces in the middle kick.
//!
//! ```text
//! v += λΔt F/m;  x += ½Δt v;  v += (1 − 2λ)Δt F̃/m;  x += ½Δt v;  v += λΔt F/m;  thermostat for Δt
//! ```
//!
//! The thermostat acts where the last forces were computed and keeps the Maxwell distribution exactly. T_kin is measured behind
//! it.
//!
//! The two-stage step has `F̃ = F`. Without thermostat it is the splitting of McLachlan, SIAM J. Sci. Comput. 16, 151 (1995), and
//! of Omelyan, Mryglod and Folk, Comput. Phys. Commun. 146, 188 (2002): symmetric and of second order, with the
//! smallest error of energy for λ = 0.193183. For averages at the ends of steps a little more is better: their bias changes sign
//! between 0.19 and 0.23, and is small at 0.21, the default. Two evaluations of forces for one of the thermostat. λ = ¼ is two
//! steps of velocity Verlet.
//!
//! The force-gradient step has `F̃ = F(x + ξΔt² F/m)`, its gradient by a second evaluation. With λ = 1/6 and ξ = 1/24 and without
//! thermostat this is of fourth order: Chin, Phys. Lett. A 226, 344 (1997); Omelyan, Mryglod and Folk, as above. The middle kick
//! is then that of the potential `U − ξΔt² Σ F²/2m`, but for terms of Δt⁴ that the displaced evaluation adds, so that no second
//! derivatives are needed. Linear momentum is kept to rounding. The step is reversible in time. It is not symplectic beyond the
//! order of the displacement, and angular momentum is kept to that order only, as forces act along the lines between displaced
//! particles. Three evaluations of forces for one of the thermostat. ξ = 0 is the two-stage step.

use super::{Coupling, RunError, Simulation, Want};

pub fn step(
    system: &mut Simulation,
    dt: f64,
    want: Want,
    lambda: f64,
    gradient: Option<f64>,
    coupling: Coupling,
) -> Result<(), RunError> {
    system.kick_and_drift(lambda * dt, 0.5 * dt)?;
    match gradient {
        Some(gradient) => system.displaced_forces(gradient * dt * dt)?,
        None => system.conservative_forces(Want::FORCES)?,
    }
    system.kick_and_drift((1.0 - 2.0 * lambda) * dt, 0.5 * dt)?;
    coupling.announce(system, dt, want);
    system.conservative_forces(want)?;
    system.defer_kick(lambda * dt);
    coupling.act(system, dt, want)
}
