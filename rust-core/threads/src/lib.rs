//! Threads that do one piece of work together, and slices that they share. A crate of its own, so that all orders in which
//! the threads may run can be tested without building the engine.

#![warn(missing_docs)]

mod pool;
mod shared_slice;

pub use pool::{Pool, ThreadCount, part, processors};
pub use shared_slice::SharedSlice;
