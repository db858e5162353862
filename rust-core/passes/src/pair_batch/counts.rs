//! Counts of operations: a pass that a model does not need leaves its count at zero.

/// Counts of one thread, in batches of pairs.
#[derive(Debug, Clone, Copy, Default)]
pub struct BatchCounts {
    /// Search groups whose pairs were searched.
    pub searched: u64,
    /// Batches whose weights were computed, for each density.
    pub weighted: u64,
    /// Batches whose noise was drawn.
    pub noise: u64,
    /// Batches whose energies and virials were summed.
    pub tallied: u64,
}
