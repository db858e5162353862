//! Evaluates the pairs of a batch: all pairs of as many consecutive i-particles as a vector has lanes.
//!
//! [`evaluate`] runs short loops over vectors of pairs, one for each step of the computation, in arrays
//! that stay in the first-level cache ([`buffers`]). [`scatter`] adds the results to both particles of
//! each pair. Pairs for the second pass go to [`in_range_pairs`] or [`full_pair_cache`].

pub mod accumulators;
pub mod batch;
pub mod buffers;
pub mod counts;
pub mod evaluate;
pub mod full_pair_cache;
pub mod in_range_pairs;
pub mod inputs;
pub mod kernel_weights;
pub mod pair_terms;
pub mod room;
pub mod scalar_fallback;
pub mod scatter;
pub mod step_constants;
pub mod thermostat;
