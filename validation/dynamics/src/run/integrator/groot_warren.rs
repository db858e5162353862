//! The modified velocity Verlet of Groot and Warren, J. Chem. Phys. 107, 4423 (1997).
//!
//! ```text
//! x += Δt v + ½Δt² f/m;  ṽ = v + λΔt f/m;  f′ = F(x, ṽ);  v += ½Δt (f + f′)/m
//! ```
//!
//! λ = ½ is velocity Verlet. Which λ gives the right temperature depends on fluid, drag and Δt; the error stays
//! of first order. T_kin is that of the velocities at the end of the step.

use super::{RunError, Simulation, Want};

pub fn step(system: &mut Simulation, dt: f64, want: Want, lambda: f64) -> Result<(), RunError> {
    system.predict(lambda, dt)?;
    system.forces_with_thermostat(dt, want)?;
    system.correct(dt)
}
