//! Pairs that are left out.

/// What a particle is, as far as it excludes pairs: of kinds that do not meet, or of a molecule.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Mark {
    /// A rule keeps the particles of one side from those of the other: bit `k` is set on one side of rule `k`, bit `k + 16`
    /// on the other.
    pub sides: u32,
    /// The molecule; 0 for a particle that meets all.
    pub molecule: u32,
}

impl Mark {
    /// Whether two particles form no pair. Those that have molecules do not if it is the same one, or with
    /// `between_molecules` if it is not.
    #[inline(always)]
    pub fn excludes(self, other: Mark, between_molecules: bool) -> bool {
        let by_rule = self.sides & other.sides.rotate_left(16) != 0;
        let have_both = (self.molecule != 0) & (other.molecule != 0);
        by_rule | (have_both & ((self.molecule == other.molecule) != between_molecules))
    }
}

/// What the sorted particles form no pairs with. All are empty where all pairs count.
#[derive(Clone, Copy, Default)]
pub struct Excluded<'a> {
    /// Where the partners of each particle begin; one past the last at the end.
    pub start: &'a [u32],
    /// Their indices in the order of cells, shifted by `OFFSET_BITS`. Of a partner that has a copy behind the last plane,
    /// both places, for particles of the last plane.
    pub partners: &'a [u32],
    /// Of the marks of particles, and of the copies behind the last; empty where no rule counts, and no molecule.
    pub sides: &'a [u32],
    pub molecules: &'a [u32],
    /// Whether marks keep molecules from each other, and not the particles of one from each other.
    pub between_molecules: bool,
}

impl Excluded<'_> {
    /// Whether all pairs count.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.start.is_empty() & self.sides.is_empty() & self.molecules.is_empty()
    }

    /// The partners of particle `i`.
    ///
    /// # Safety
    /// `i` is one of the particles.
    #[inline(always)]
    pub unsafe fn partners_of(&self, i: usize) -> &[u32] {
        if self.start.is_empty() {
            return &[];
        }
        // SAFETY: `start` has an entry for each particle and one behind the last, none beyond the partners.
        unsafe {
            let [first, end] = [*self.start.get_unchecked(i), *self.start.get_unchecked(i + 1)];
            self.partners.get_unchecked(first as usize..end as usize)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_and_molecules_exclude() {
        let mark = |sides, molecule| Mark { sides, molecule };
        let [a, b, both] = [mark(2, 0), mark(2 << 16, 0), mark(2 | 2 << 16, 0)];
        assert!(a.excludes(b, false) && b.excludes(a, false) && both.excludes(both, false));
        assert!(!a.excludes(a, false) && !b.excludes(b, false) && !a.excludes(mark(1 << 16, 0), false));
        let [one, two, none] = [mark(0, 1), mark(0, 2), mark(0, 0)];
        for between in [false, true] {
            assert_eq!(one.excludes(one, between), !between);
            assert_eq!(one.excludes(two, between), between);
            assert!(!one.excludes(none, between) && !none.excludes(none, between));
        }
    }
}
