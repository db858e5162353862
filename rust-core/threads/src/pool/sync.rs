//! The primitives of the pool: the standard library's, or loom's in a test that explores all orders of the threads.

#[cfg(not(loom))]
mod threads {
    pub use std::hint::spin_loop;
    pub use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    pub use std::sync::{Arc, Condvar, Mutex};
    pub use std::thread::{Builder, JoinHandle};
    pub use std::thread_local;
}

#[cfg(loom)]
mod threads {
    pub use loom::hint::spin_loop;
    pub use loom::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    pub use loom::sync::{Arc, Condvar, Mutex};
    pub use loom::thread::{Builder, JoinHandle};
    pub use loom::thread_local;
}

pub use threads::*;
