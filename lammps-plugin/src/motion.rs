//! The loops over atoms with which the fix moves them. The threads of the pair style divide them; as each atom has its own
//! numbers, results do not depend on the number of threads.

use crate::bridge::Movers;
use crate::converted::triples;
use crate::style::Style;

impl Movers<'_> {
    /// Mass of atom `k`; infinite outside the group.
    fn mass(&self, k: usize) -> f64 {
        match self.mask[k] & self.group != 0 {
            false => f64::INFINITY,
            true => self.mass.get(k).copied().unwrap_or_else(|| self.mass_of_kind[self.kind[k] as usize]),
        }
    }
}

impl Style {
    /// Calls `work` with the number of each of `things`, and with the thing.
    fn each<T: Send>(&self, things: &mut [T], work: impl Fn(usize, &mut T) + Sync) {
        self.engine.pool().parts(things, |first, part| {
            part.iter_mut().enumerate().for_each(|(k, thing)| work(first + k, thing));
        });
    }

    /// Adds `h f / m` to the velocities of the atoms of a group.
    pub fn kick(&self, h: f64, movers: &Movers, f: &[f64], v: &mut [f64]) {
        let f = triples(f);
        self.each(v.as_chunks_mut::<3>().0, |k, v| {
            if movers.mask[k] & movers.group != 0 {
                let over_mass = h / movers.mass(k);
                (0..3).for_each(|c| v[c] += over_mass * f[k][c]);
            }
        });
    }

    /// Adds `h v` to the positions of the atoms of a group.
    pub fn drift(&self, h: f64, movers: &Movers, v: &[f64], x: &mut [f64]) {
        let v = triples(v);
        self.each(x.as_chunks_mut::<3>().0, |k, x| {
            if movers.mask[k] & movers.group != 0 {
                (0..3).for_each(|c| x[c] += h * v[k][c]);
            }
        });
    }

    /// Writes `h f / m` of the atoms of a group, and zero for others.
    pub fn find_shifts(&self, h: f64, movers: &Movers, f: &[f64], shifts: &mut [f64]) {
        let f = triples(f);
        self.each(shifts.as_chunks_mut::<3>().0, |k, shift| {
            let over_mass = h / movers.mass(k);
            (0..3).for_each(|c| shift[c] = over_mass * f[k][c]);
        });
    }

    pub fn shift(&self, shifts: &[f64], x: &mut [f64]) {
        self.each(x, |k, x| *x += shifts[k]);
    }

    pub fn copy(&self, from: &[f64], to: &mut [f64]) {
        self.each(to, |k, to| *to = from[k]);
    }

    /// Writes the masses of the atoms, in `unit`s; infinite outside the group, and of those that are `held`.
    pub fn find_masses(&self, unit: f64, movers: &Movers, held: &[u8], masses: &mut [f64]) {
        self.each(masses, |k, mass| *mass = if held[k] != 0 { f64::INFINITY } else { unit * movers.mass(k) });
    }
}
