//! The units of the pair search.

/// Most i-particles whose cell ranges are found together.
pub const SEARCH_GROUP: usize = 32;

/// i-particles in one 64-bit mask, with sixteen bits each.
pub const I_PER_MASK: usize = 4;

/// Masks of the largest i-cluster.
pub const MASKS_PER_CLUSTER: usize = 2;

/// Number of slots in a block of an i-cluster's slots, whose masks are transposed together.
pub const SLOT_BLOCK: usize = 8;

/// Sixteen candidates, and the i-cluster they are compared with.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct JCluster {
    /// Candidate mask of the first four i-particles: sixteen bits for the first one, then for the second …
    pub candidates: u64,
    /// Index of the first candidate.
    pub first: u32,
    /// Low 8 bits: index of the periodic shift. Other bits: the slot for its masks.
    pub slot_and_shift: u32,
}

/// Neighbouring particles of a column that share their cell ranges.
#[derive(Debug, Clone, Copy, Default)]
pub struct ICluster {
    /// First particle, counted in the search group.
    pub first: u8,
    pub size: u8,
    /// Its blocks of slots: index of the first, and one past the last.
    pub slot_blocks: [u32; 2],
    /// One past its last half block of slots that has a j-cluster.
    pub end_half: u32,
}
