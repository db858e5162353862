//! The model file: one fluid, every host.
pub mod expression;
