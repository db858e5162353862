//! Excluded pairs.

/// Marks of a particle that decide which pairs are excluded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Mark {
    /// Bits of rules, each of which excludes pairs between its two sides: bit `k` marks one side of
    /// rule `k`, bit `k + 16` the other.
    pub sides: u32,
    /// The molecule; 0 for a particle that no molecule excludes.
    pub molecule: u32,
}

impl Mark {
    /// Whether two particles form no pair. Particles of one molecule form none, or with
    /// `between_molecules` particles of different molecules.
    #[inline(always)]
    pub fn excludes(self, other: Mark, between_molecules: bool) -> bool {
        let by_rule = self.sides & other.sides.rotate_left(16) != 0;
        let have_both = (self.molecule != 0) & (other.molecule != 0);
        by_rule | (have_both & ((self.molecule == other.molecule) != between_molecules))
    }
}

/// The excluded pairs of the sorted particles. All slices are empty where no pair is excluded.
#[derive(Clone, Copy, Default)]
pub struct Excluded<'a> {
    /// Index of the first partner of each particle; the last entry is one past the last partner.
    pub start: &'a [u32],
    /// Partners' indices in the order of cells, shifted by `OFFSET_BITS`. For particles of the last
    /// plane, a partner with a copy behind that plane is listed at both indices.
    pub partners: &'a [u32],
    /// Rules' bits of the particles, followed by those of the copies behind the last plane;
    /// empty without rules and molecules.
    pub sides: &'a [u32],
    pub molecules: &'a [u32],
    /// Whether molecules exclude pairs between them instead of pairs within one.
    pub between_molecules: bool,
}

impl Excluded<'_> {
    /// Whether no pair is excluded.
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
        // SAFETY: `ExcludedPairs` gives `start` an entry for each particle and one more, none beyond the partners.
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
