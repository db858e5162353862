//! The self-consistent leap-frog of Pagonabarraga, Hagen and Frenkel, Europhys. Lett. 42, 377 (1998), as velocity Verlet.
//!
//! ```text
//! v += ½Δt f/m;  x += Δt v;  v′ = v + ½Δt (F(x) + R + D(x, v′))/m;  f = F + R + D(x, v′)
//! ```
//!
//! The paper iterates for `v′`, which converges for weak drag only; here the linear system `(M + ½ΔtG) v′ = M v +
//! ½Δt (F + R)` is solved by conjugate gradients, to a relative residual of 10⁻⁴, for any. The noise of a step acts in two halves
//! around different drags, so that the temperature is not exact: an ideal gas is within 1 % up to Δt = 0.05 at γ = 4.5,
//! ρ = 3. T_kin is that of the velocities at the end of the step.

use super::{Law, Path, RunError, Simulation, Want};
use crate::run::simulation::Heat;
use psidpd_core::engine::thermostat::{Stream, Update};

pub fn step(system: &mut Simulation, dt: f64, want: Want, noise: Law) -> Result<(), RunError> {
    system.kick_and_drift(0.5 * dt, Path::whole(dt, 0.5 * dt))?;
    system.forces_then_noise(dt, want, noise)?;
    system.kick(0.5 * dt)?;
    let heat = Heat { update: Update::ImplicitDrag, noise, time: dt, stream: Stream(0) };
    system.heat(heat, want, dt)?;
    system.add_drag();
    Ok(())
}
