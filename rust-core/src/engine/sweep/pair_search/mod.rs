//! Which particles are within the search cutoff of each other.

pub mod cell_ranges;
pub mod distance_filter;
pub mod j_clusters;
