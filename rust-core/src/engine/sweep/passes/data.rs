//! What the passes are given.

use super::slopes::PassSlopes;
use crate::engine::sweep::cells::sorted::SortedCells;
use crate::engine::sweep::pair_batch::inputs::PairInputs;

/// The arrays of a workspace, as the passes over one plane see them.
pub struct PassData<'a, T, R> {
    pub cells: SortedCells<'a>,
    pub inputs: PairInputs<'a, T, R>,
    pub slopes: PassSlopes<'a, T>,
}
