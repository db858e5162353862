//! The modified velocity Verlet of Groot and Warren: forces at a predicted velocity `v + λΔt f/m`.

use super::Motion;

pub fn before_forces(motion: Motion, dt: f64, lambda: f64) {
    let Motion { x, v, f, species, mass, before } = motion;
    before.v.clear();
    before.v.extend_from_slice(v);
    before.f.clear();
    before.f.extend_from_slice(f);
    for (((x, v), f), s) in x.iter_mut().zip(v).zip(f).zip(species) {
        let over_mass = dt / mass[*s as usize];
        for c in 0..3 {
            x[c] += dt * (v[c] + 0.5 * over_mass * f[c]);
            v[c] += lambda * over_mass * f[c];
        }
    }
}

pub fn after_forces(motion: Motion, dt: f64) {
    let Motion { v, f, species, mass, before, .. } = motion;
    for (k, (v, f)) in v.iter_mut().zip(f).enumerate() {
        let half = 0.5 * dt / mass[species[k] as usize];
        for c in 0..3 {
            v[c] = before.v[k][c] + half * (before.f[k][c] + f[c]);
        }
    }
}
