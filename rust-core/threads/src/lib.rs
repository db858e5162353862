//! Threads that share the work of one function, and slices that they share. A crate of its own, so that
//! tests can explore all orders of the threads without building the engine.

#![warn(missing_docs)]

mod pool;
mod shared_slice;

pub use pool::{Pool, ThreadCount, at_once, part, processors, take};
pub use shared_slice::SharedSlice;
