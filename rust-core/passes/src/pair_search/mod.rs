//! Finds the pairs within the search cutoff, up to thirty-two i-particles of a column at a time. All i-particles are
//! owned: their partners are owned particles in five columns, and then ghosts in nine.
//!
//! 1. [`cell_ranges`] computes in which cells of the stencil columns each i-particle searches
//!    partners;
//! 2. [`j_clusters`]: four or eight neighbouring i-particles form an i-cluster; the cell ranges of a cluster are cut into
//!    j-clusters of sixteen particles;
//! 3. [`distance_filter`]: each j-cluster is compared with its i-cluster in 16-bit fixed point, and the bits that remain
//!    become the list of pairs;
//! 4. [`leave_out`] removes excluded pairs from that list.
//!
//! [`around`] finds the particles around single points, within other ranges.

pub mod around;
pub mod buffers;
pub mod cell_ranges;
pub mod clusters;
pub mod distance_filter;
pub mod find;
pub mod j_clusters;
pub mod leave_out;
