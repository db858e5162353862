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

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::model::Model;

    const MODEL: &str = "title = \"t\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\n\
                         range = 1\n";

    /// Three atoms of masses 1, 3 and 1, of which the last is in another group; by type, or each with its own.
    fn movers(own: &[f64]) -> Movers<'_> {
        Movers {
            group: 2,
            mask: &[3, 2, 5],
            kind: &[1, 2, 1],
            mass_of_kind: &[f64::NAN, 1.0, 3.0],
            mass: own,
        }
    }

    /// By hand: f/m for a time of a half, v for a time of a quarter; atoms of another group stay as they are.
    #[test]
    fn atoms_of_the_group_move_by_their_mass() {
        let style = Style::new(Model::parse("m.toml", MODEL).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
        let f = [2.0, -4.0, 6.0, 3.0, -6.0, 9.0, 7.0, 7.0, 7.0];
        let start = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        for own in [&[][..], &[1.0, 3.0, 1.0]] {
            let mut v = start;
            style.kick(0.5, &movers(own), &f, &mut v);
            assert_eq!(v, [2.0, 0.0, 6.0, 4.5, 4.0, 7.5, 7.0, 8.0, 9.0]);
            let mut shifts = [f64::NAN; 9];
            style.find_shifts(0.5, &movers(own), &f, &mut shifts);
            assert_eq!(shifts, [1.0, -2.0, 3.0, 0.5, -1.0, 1.5, 0.0, 0.0, 0.0]);
            let mut x = start;
            style.shift(&shifts, &mut x);
            assert_eq!(x, [2.0, 0.0, 6.0, 4.5, 4.0, 7.5, 7.0, 8.0, 9.0]);
            let mut masses = [f64::NAN; 3];
            style.find_masses(2.0, &movers(own), &[0, 0, 0], &mut masses);
            assert_eq!(masses, [2.0, 6.0, f64::INFINITY]);
            // What is held keeps its velocity, whatever its mass.
            style.find_masses(2.0, &movers(own), &[1, 0, 1], &mut masses);
            assert_eq!(masses, [f64::INFINITY, 6.0, f64::INFINITY]);
        }
        let mut x = start;
        style.drift(0.25, &movers(&[]), &[4.0, 8.0, -4.0, 0.0, 4.0, 8.0, 4.0, 4.0, 4.0], &mut x);
        assert_eq!(x, [2.0, 4.0, 2.0, 4.0, 6.0, 8.0, 7.0, 8.0, 9.0]);
        let mut copy = [0.0; 9];
        style.copy(&x, &mut copy);
        assert_eq!(copy, x);
    }
}
