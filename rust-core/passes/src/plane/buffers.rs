//! Scratch arrays of a thread for the first pass.

use super::list::Listed;
use crate::pair_batch::buffers::BatchBuffers;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::Scalar;

/// Result of the search, scratch arrays of the evaluation of a batch, and listed pairs.
#[derive(Debug)]
pub struct PairBuffers<T> {
    pub search: SearchBuffers,
    pub batch: BatchBuffers<T>,
    /// The pairs of the present plane that are listed for the thermostat, and those with ghosts.
    pub lists: Listed,
}

impl<T: Scalar> PairBuffers<T> {
    /// Buffers for the weights of `passes` densities.
    pub fn new(passes: usize) -> PairBuffers<T> {
        PairBuffers {
            search: SearchBuffers::default(),
            batch: BatchBuffers::new(passes),
            lists: Listed::default(),
        }
    }
}
