//! Pairs that a host excludes.

use super::error::EngineError;
use super::surroundings::SpecialPair;
use psidpd_passes::cells::excluded::Mark;

/// The excluded pairs of particles, by the host's numbers.
#[derive(Debug, Clone, Default)]
pub struct Exclusions {
    /// Index of each particle's first partner; the last entry is one past the last. Empty without partners.
    start: Vec<u32>,
    partners: Vec<u32>,
    /// Marks of all particles; empty if no marks exclude pairs.
    pub marks: Vec<Mark>,
    pub between_molecules: bool,
    /// Whether any mark has a side, and whether any has a molecule.
    pub kinds: [bool; 2],
}

impl Exclusions {
    /// Sets the marks, at least as many as there are particles, or none.
    pub fn mark(&mut self, marks: impl IntoIterator<Item = Mark>, between_molecules: bool) {
        self.marks.clear();
        self.marks.extend(marks);
        self.between_molecules = between_molecules;
        self.kinds = [self.marks.iter().any(|m| m.sides != 0), self.marks.iter().any(|m| m.molecule != 0)];
    }

    /// Whether marks exclude the pair of two particles.
    pub fn excludes(&self, i: usize, j: usize) -> bool {
        match (self.marks.get(i), self.marks.get(j)) {
            (Some(a), Some(b)) => a.excludes(*b, self.between_molecules),
            _ => false,
        }
    }

    /// Fails if there are marks, but fewer than `count`.
    pub fn check(&self, count: usize) -> Result<(), EngineError> {
        match self.marks.len() {
            1.. if self.marks.len() < count => {
                Err(EngineError::Host("marks must have one entry per particle and ghost"))
            }
            _ => Ok(()),
        }
    }

    /// Replaces all excluded pairs by `pairs`, and ignores their factors.
    pub fn set(&mut self, pairs: &[SpecialPair]) {
        self.start.clear();
        self.partners.clear();
        let Some(most) = pairs.iter().map(|pair| pair.i.max(pair.j)).max() else { return };
        // The array first has the number of partners of each particle, then their start, and the next
        // free index while it is filled.
        self.start.resize(most as usize + 2, 0);
        for pair in pairs {
            self.start[pair.i as usize] += 1;
            self.start[pair.j as usize] += 1;
        }
        let mut sum = 0;
        self.start.iter_mut().for_each(|start| sum += std::mem::replace(start, sum));
        self.partners.resize(sum as usize, 0);
        for pair in pairs {
            for (i, j) in [(pair.i, pair.j), (pair.j, pair.i)] {
                let next = &mut self.start[i as usize];
                self.partners[*next as usize] = j;
                *next += 1;
            }
        }
        // After filling, each entry is the start of the next particle: the array moves by one.
        self.start.copy_within(..most as usize + 1, 1);
        self.start[0] = 0;
    }

    /// Whether no pair is excluded.
    pub fn is_empty(&self) -> bool {
        !self.has_partners() && self.kinds == [false; 2]
    }

    /// Whether single pairs are excluded.
    pub fn has_partners(&self) -> bool {
        !self.start.is_empty()
    }

    /// The particles that form no pair with `particle`.
    pub fn of(&self, particle: u32) -> &[u32] {
        match self.start.get(particle as usize..particle as usize + 2) {
            Some([first, end]) => &self.partners[*first as usize..*end as usize],
            _ => &[],
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        (self.start.capacity() + self.partners.capacity()) * size_of::<u32>()
            + self.marks.capacity() * size_of::<Mark>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partners_are_there_from_both_sides() {
        let pair = |i, j| SpecialPair { i, j, factor: 0.0 };
        let mut exclusions = Exclusions::default();
        exclusions.set(&[pair(2, 5), pair(0, 2), pair(5, 3)]);
        let of = |particle| exclusions.of(particle).to_vec();
        assert_eq!([of(0), of(1), of(2), of(3), of(4), of(5), of(6)].map(|p| p.len()), [1, 0, 2, 1, 0, 2, 0]);
        assert_eq!((of(2), of(5), of(3)), (vec![5, 0], vec![2, 3], vec![5]));
        exclusions.set(&[]);
        assert!(!exclusions.has_partners() && exclusions.of(2).is_empty());
    }
}
