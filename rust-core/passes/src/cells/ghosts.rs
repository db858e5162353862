//! Flags of ghosts among the sorted particles.

/// Ghost flags of the sorted particles, in three forms. All are empty where there are no ghosts.
#[derive(Clone, Copy)]
pub struct Ghosts<'a> {
    pub flags: &'a [bool],
    /// One bit for each particle, set for owned ones. Sixteen bytes of padding follow the last particle.
    pub owned_bits: &'a [u8],
    /// Owned particles of each column, followed by those of the copy of the first plane.
    pub owned_of_column: &'a [OwnedOfColumn],
}

/// The owned particles of a column.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OwnedOfColumn {
    /// The first owned particle, and one past the last.
    pub range: [u32; 2],
    /// Whether the column has ghosts.
    pub with_ghosts: bool,
}

impl Ghosts<'_> {
    /// Whether there are no ghosts.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.flags.is_empty()
    }

    /// The weight of a pair on this rank: 1, or ½ if either particle is a ghost. The rank that owns
    /// the ghost counts the other half.
    pub fn pair_weight(&self, i: usize, j: usize) -> f64 {
        if self.is_empty() {
            return 1.0;
        }
        1.0 - 0.5 * (self.flags[i] as u8 + self.flags[j] as u8) as f64
    }

    /// One bit for each of the sixteen particles from `first` on, set for owned ones.
    ///
    /// # Safety
    /// There are ghosts, and `first` is at most one past the last particle.
    #[inline(always)]
    pub unsafe fn owned_of_sixteen(&self, first: usize) -> u32 {
        // SAFETY: four bytes from that of `first` on are inside the padding that `SortedParticles::find_owned` appends.
        unsafe {
            let bits = self.owned_bits.as_ptr().add(first / 8).cast::<u32>().read_unaligned();
            bits >> (first % 8) & 0xffff
        }
    }

    /// Whether there is a ghost among up to 57 particles from `first` on.
    ///
    /// # Safety
    /// There are ghosts, and that many particles.
    #[inline(always)]
    pub unsafe fn any_of(&self, [first, count]: [usize; 2]) -> bool {
        // SAFETY: eight bytes from that of `first` on are inside the padding that `SortedParticles::find_owned` appends.
        let bits = unsafe { self.owned_bits.as_ptr().add(first / 8).cast::<u64>().read_unaligned() };
        let all = (1 << count) - 1;
        bits >> (first % 8) & all != all
    }
}

/// Most particles that [`Ghosts::any_of`] takes: with up to seven bits before the first they fit into a word.
pub const MOST_OF_ANY: usize = 57;
