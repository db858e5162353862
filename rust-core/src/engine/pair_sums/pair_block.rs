//! Blocks of pairs with their conservative forces, in either precision.

use super::pairs::BLOCK;

/// A block of the pairs of a plane of cells.
#[derive(Debug, Clone, Copy)]
pub struct PairBlock<'a, T = f64> {
    /// Index of each particle of the plane, and then of the next, in the arrays of the host.
    pub(super) hosts: &'a [u32],
    /// Both particles by their places among these.
    pub(super) pairs: [&'a [u32]; 2],
    /// The components of `r_i − r_j`.
    pub d: [&'a [T]; 3],
    /// The force on particle `i`, divided by `d`.
    pub strengths: &'a [T],
}

impl<'a, T> PairBlock<'a, T> {
    /// All pairs of a plane in blocks of at most [`BLOCK`], from the arrays of the plane.
    pub fn all(
        hosts: &'a [u32],
        pairs: [&'a [u32]; 2],
        d: [&'a [T]; 3],
        strengths: &'a [T],
    ) -> impl Iterator<Item = PairBlock<'a, T>> {
        (0..strengths.len()).step_by(BLOCK).map(move |from| {
            let of_block = from..(from + BLOCK).min(strengths.len());
            PairBlock {
                hosts,
                pairs: pairs.map(|of| &of[of_block.clone()]),
                d: d.map(|d| &d[of_block.clone()]),
                strengths: &strengths[of_block],
            }
        })
    }

    /// The particles `i` and `j` of each pair, with the indices of the host.
    #[inline(always)]
    pub fn particles(&self) -> impl Iterator<Item = [usize; 2]> + use<'a, T> {
        let PairBlock { hosts, pairs: [i, j], .. } = *self;
        i.iter().zip(j).map(|(i, j)| [i, j].map(|k| hosts[*k as usize] as usize))
    }
}
