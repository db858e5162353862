//! The two passes over the pairs of a plane. Between them ψ and its slopes are evaluated (`workspace::excess`).

pub mod buffers;
pub mod data;
pub mod distances;
pub mod first;
pub mod laplacians;
pub mod list;
pub mod listed_noise;
pub mod pair_sums;
pub mod second;
pub mod second_cached;
pub mod slopes;
pub mod traversal;
