//! The slopes `∂ψ/∂n` of all particles, as the second pass reads them.

use psidpd_threads::SharedSlice;

/// Slopes in the order of cells, followed by those of the copies of the first plane.
#[derive(Clone, Copy)]
pub struct Slopes<'a, T> {
    /// A slope for each density pass and species.
    pub values: SharedSlice<'a, f64>,
    /// Slopes for the full pair cache, in the precision of the pairs: the first [`SLOPES_PER_BLOCK`] of
    /// all particles, then the next ones …
    pub packed: SharedSlice<'a, T>,
    /// Distance between blocks, in numbers.
    pub stride: usize,
}

/// Number of slopes of a particle that are read at once.
pub const SLOPES_PER_BLOCK: usize = 8;
