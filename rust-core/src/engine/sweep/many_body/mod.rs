//! The pairs within the range of a density, and their many-body forces.

pub mod full_pair_cache;
pub mod in_range_pairs;
