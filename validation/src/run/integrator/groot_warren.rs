//! The modified velocity Verlet of Groot and Warren: forces at a predicted velocity `v + λΔt f/m`.

use super::parts::{Faults, Surroundings, drift, kick, share};
use super::{Motion, Pool};

pub fn before_forces(mut motion: Motion, dt: f64, lambda: f64, around: Surroundings, pool: &Pool) -> Faults {
    motion.keep();
    motion.over_mass(|mass| dt / mass);
    share(motion, pool, |part, over_mass| {
        part.kept[0].copy_from_slice(part.v);
        part.kept[1].copy_from_slice(part.f);
        drift(part, over_mass, around, |x, v, f, over_mass| {
            (x + dt * (v + 0.5 * over_mass * f), v + lambda * over_mass * f)
        });
    })
}

pub fn after_forces(mut motion: Motion, dt: f64, pool: &Pool) -> Faults {
    motion.over_mass(|mass| 0.5 * dt / mass);
    share(motion, pool, |part, half| {
        kick::<true, _>(part, half, |_, f, [before_v, before_f], half| before_v + half * (before_f + f));
    })
}
