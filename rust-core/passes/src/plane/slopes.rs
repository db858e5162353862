//! The slopes `∂ψ/∂n` of all particles, as the second pass reads them.

use psidpd_threads::SharedSlice;

/// Slopes in the order of cells, and of the copies of the first plane behind them.
#[derive(Clone, Copy)]
pub struct Slopes<'a, T> {
    /// A number for each density pass and species.
    pub values: SharedSlice<'a, f64>,
    /// The same for the full pair cache, in the precision of the pairs: the first [`SLOPES_PER_BLOCK`] of all particles, then
    /// the next ones …
    pub packed: SharedSlice<'a, T>,
    /// Numbers from one block to the next.
    pub stride: usize,
}

/// Slopes of a particle that are read at once.
pub const SLOPES_PER_BLOCK: usize = 8;
