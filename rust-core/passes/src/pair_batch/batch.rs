//! The pairs of a batch.

use crate::pair_search::buffers::SearchBuffers;
use crate::simd::OFFSET_BITS;

/// Consecutive i-particles, at most as many as a vector has lanes, and all their pairs.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// First i-particle of the batch.
    pub first: usize,
    pub members: usize,
    /// Whether the j-particles are ghosts: they get no forces.
    pub with_ghosts: bool,
    /// Number of pairs.
    pub count: usize,
    /// Index of the first pair of each i-particle in its search group, and one past the last pair of the last one.
    pub begin: &'a [u32],
    /// The i-particle of each pair, counted from `first`; readable for one vector beyond the last pair.
    pub i_in_batch: &'a [u8],
    /// The j-particle of each pair: its index shifted by [`OFFSET_BITS`]; readable for one vector beyond the last pair.
    pub j_offsets: &'a [u32],
}

impl<'a> Batch<'a> {
    /// The batch of members `slots[0]..slots[1]` of a search group, unless it has no pairs.
    ///
    /// # Safety
    /// The pairs of the group have been found, and the group has those members.
    #[inline(always)]
    pub unsafe fn of_group(search: &'a SearchBuffers, slots: [usize; 2]) -> Option<Batch<'a>> {
        // SAFETY: the search has written an entry of `begin` for each member and one more;
        // its entries are indices of pairs.
        unsafe {
            let begin = search.begin.get_unchecked(slots[0]..slots[1] + 1);
            let members = slots[1] - slots[0];
            let (first, end) = (*begin.get_unchecked(0) as usize, *begin.get_unchecked(members) as usize);
            (first < end).then_some(Batch {
                first: search.first + slots[0],
                members,
                with_ghosts: search.with_ghosts,
                count: end - first,
                begin,
                i_in_batch: search.i_in_batch.get_unchecked(first..),
                j_offsets: search.j_offsets.get_unchecked(first..),
            })
        }
    }

    /// The weight of a pair on this rank: 1, or ½ of a pair with a ghost. The rank that owns the ghost counts the other
    /// half.
    pub fn pair_weight(&self) -> f64 {
        if self.with_ghosts { 0.5 } else { 1.0 }
    }

    pub fn pair(&self, p: usize) -> [usize; 2] {
        [self.first + self.i_in_batch[p] as usize, (self.j_offsets[p] >> OFFSET_BITS) as usize]
    }
}
