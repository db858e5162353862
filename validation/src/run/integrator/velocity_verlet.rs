//! Velocity Verlet with the operations in the order of LAMMPS's `fix nve`, so that trajectories of
//! the two codes part by rounding of the forces alone.

use super::Motion;

pub fn before_forces(motion: Motion, dt: f64) {
    let Motion { x, v, f, species, mass, .. } = motion;
    for (((x, v), f), s) in x.iter_mut().zip(v).zip(f).zip(species) {
        let dtfm = 0.5 * dt / mass[*s as usize];
        for c in 0..3 {
            v[c] += dtfm * f[c];
            x[c] += dt * v[c];
        }
    }
}

pub fn after_forces(motion: Motion, dt: f64) {
    let Motion { v, f, species, mass, .. } = motion;
    for ((v, f), s) in v.iter_mut().zip(f).zip(species) {
        let dtfm = 0.5 * dt / mass[*s as usize];
        for c in 0..3 {
            v[c] += dtfm * f[c];
        }
    }
}
