//! Velocity Verlet with the operations in the order of LAMMPS's `fix nve`, so that trajectories of
//! the two codes part by rounding of the forces alone.

use super::parts::{Faults, Surroundings, drift, kick, share};
use super::{Motion, Pool};

/// With `owed` the step before has not been ended by [`after_forces`]: its kick comes first, in the same loop.
pub fn before_forces(mut motion: Motion, dt: f64, owed: bool, around: Surroundings, pool: &Pool) -> Faults {
    motion.keep_nothing();
    motion.over_mass(|mass| 0.5 * dt / mass);
    share(motion, pool, |part, dtfm| {
        if owed {
            drift(part, dtfm, around, |x, v, f, dtfm| {
                let kick = dtfm * f;
                let v = v + kick + kick;
                (x + dt * v, v)
            });
        } else {
            drift(part, dtfm, around, |x, v, f, dtfm| {
                let v = v + dtfm * f;
                (x + dt * v, v)
            });
        }
    })
}

pub fn after_forces(mut motion: Motion, dt: f64, pool: &Pool) -> Faults {
    motion.keep_nothing();
    motion.over_mass(|mass| 0.5 * dt / mass);
    share(motion, pool, |part, dtfm| kick::<false, _>(part, dtfm, |v, f, _, dtfm| v + dtfm * f))
}
