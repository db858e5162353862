//! The input of the passes.

use super::list::ListTerms;
use super::slopes::Slopes;
use crate::cells::sorted::SortedCells;
use crate::pair_batch::inputs::PairInputs;

/// The arrays of a workspace, as the passes over one plane read them.
pub struct PassData<'a, T, R> {
    pub cells: SortedCells<'a>,
    pub inputs: PairInputs<'a, T, R>,
    pub slopes: Slopes<'a, T>,
    /// The pairs that the first pass lists for the thermostat; only in mixed precision, and without drag and noise.
    pub listed: Option<&'a ListTerms>,
}
