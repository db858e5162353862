//! The pairs of one step, and the rule which rank computes which pair.

use crate::engine::surroundings::Newton;

/// The pairs of one configuration. Each has at least one owned particle, which comes first.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    owned: usize,
    pub newton: Newton,
    /// Pairs whose force is computed here.
    pub force: PairList,
    /// Pairs that only contribute to the density of the owned particle.
    pub density_only: PairList,
}

/// Number of pairs in a block, whose scalars stay in the first-level cache.
pub const BLOCK: usize = 256;

/// The number of parts of a block whose pairs are added in turns.
const PARTS: usize = 4;

/// The places of the first `count` pairs of a block, those of its parts in turns. Lists are sorted by their first particles: so the sums of a
/// particle do not wait for the pair before.
#[inline(always)]
pub fn in_turns(count: usize) -> impl Iterator<Item = usize> {
    (0..BLOCK).map(|at| at / PARTS + at % PARTS * (BLOCK / PARTS)).filter(move |k| *k < count)
}

/// Parallel arrays over pairs. `d = r_i − r_j`.
#[derive(Debug, Clone, Default)]
pub struct PairList {
    pub i: Vec<u32>,
    pub j: Vec<u32>,
    pub species_i: Vec<u8>,
    pub species_j: Vec<u8>,
    pub d: [Vec<f64>; 3],
    pub r: Vec<f64>,
    /// Factor of the conservative interaction; empty if all factors are 1.
    pub factor: Vec<f64>,
    /// Factor of drag and noise; empty if all factors are 1.
    pub thermostat_factor: Vec<f64>,
}

impl PairList {
    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        fn of<T>(array: &Vec<T>) -> usize {
            array.capacity() * size_of::<T>()
        }
        let PairList { i, j, species_i, species_j, d, r, factor, thermostat_factor } = self;
        of(i)
            + of(j)
            + of(species_i)
            + of(species_j)
            + d.iter().map(of).sum::<usize>()
            + of(r)
            + of(factor)
            + of(thermostat_factor)
    }

    pub fn len(&self) -> usize {
        self.r.len()
    }

    pub fn clear(&mut self) {
        self.i.clear();
        self.j.clear();
        self.species_i.clear();
        self.species_j.clear();
        self.d.iter_mut().for_each(Vec::clear);
        self.r.clear();
        self.factor.clear();
        self.thermostat_factor.clear();
    }

    /// Copies another list into the same arrays.
    pub fn copy_from(&mut self, of: &PairList) {
        self.i.clone_from(&of.i);
        self.j.clone_from(&of.j);
        self.species_i.clone_from(&of.species_i);
        self.species_j.clone_from(&of.species_j);
        self.d.iter_mut().zip(&of.d).for_each(|(d, of)| d.clone_from(of));
        self.r.clone_from(&of.r);
        self.factor.clone_from(&of.factor);
        self.thermostat_factor.clone_from(&of.thermostat_factor);
    }

    /// Makes room for so many pairs, whose values are unspecified; there are no factors.
    pub fn resize(&mut self, count: usize) {
        self.i.resize(count, 0);
        self.j.resize(count, 0);
        self.species_i.resize(count, 0);
        self.species_j.resize(count, 0);
        self.d.iter_mut().for_each(|d| d.resize(count, 0.0));
        self.r.resize(count, 0.0);
    }

    #[inline(always)]
    pub fn push(&mut self, i: usize, j: usize, d: [f64; 3], species: &[i32]) {
        self.push_of(i, j, d, [species[i], species[j]]);
    }

    /// Adds a pair of particles of two species.
    #[inline(always)]
    pub fn push_of(&mut self, i: usize, j: usize, d: [f64; 3], [a, b]: [i32; 2]) {
        self.i.push(i as u32);
        self.j.push(j as u32);
        self.species_i.push(a as u8);
        self.species_j.push(b as u8);
        (0..3).for_each(|c| self.d[c].push(d[c]));
        self.r.push((d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt());
    }
}

impl Pairs {
    pub fn clear(&mut self, owned: usize, newton: Newton) {
        self.owned = owned;
        self.newton = newton;
        self.force.clear();
        self.density_only.clear();
    }

    /// Adds the pair `a`, `b` with `d = r_a − r_b`; at least one particle is owned. Returns the list that has the pair,
    /// for its factor: either all pairs get one or none.
    #[inline(always)]
    pub fn push(&mut self, a: usize, b: usize, d: [f64; 3], tag: &[i32], species: &[i32]) -> &mut PairList {
        let (i, j, d) = if a < self.owned { (a, b, d) } else { (b, a, d.map(|c| -c)) };
        let here = j < self.owned || self.newton == Newton::Off || computes(tag[i], tag[j], d);
        let list = if here { &mut self.force } else { &mut self.density_only };
        list.push(i, j, d, species);
        list
    }
}

/// Whether the rank that owns `i` computes its pair with the ghost `j`. Of the two ranks that have the
/// pair exactly one does; the parity of the tags divides the work evenly.
#[inline(always)]
fn computes(tag_i: i32, tag_j: i32, d: [f64; 3]) -> bool {
    if tag_i != tag_j {
        (tag_i < tag_j) == ((tag_i ^ tag_j) & 1 == 1)
    } else {
        // For a particle and its own image, the mirrored pair has −d.
        let first = d.iter().find(|c| **c != 0.0).copied().unwrap_or(0.0);
        first > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_one_side_computes_a_pair() {
        for a in 1..20 {
            for b in 1..20 {
                let d = [0.0, -0.3, 0.2];
                assert_ne!(computes(a, b, d), computes(b, a, d.map(|c: f64| -c)), "{a} {b}");
            }
        }
    }
}
