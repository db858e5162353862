//! What the pairs of a batch of particles do.

pub mod batch;
pub mod buffers;
pub mod evaluate;
pub mod kernel_weights;
pub mod pair_terms;
pub mod scalar_fallback;
pub mod scatter;
pub mod select_in_range;
pub mod thermostat;
