//! The primitives of the pool: the standard library's, or loom's in a test that explores all orders of the threads.

#[cfg(loom)]
use loom as threads;
#[cfg(not(loom))]
use std as threads;

use std::time::{Duration, Instant};

pub use threads::hint::spin_loop;
pub use threads::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
pub use threads::sync::{Arc, Condvar, Mutex};
pub use threads::thread::{Builder, JoinHandle};
pub use threads::thread_local;

/// The time that `wait` takes.
pub fn time_of(wait: impl FnOnce()) -> Duration {
    if cfg!(any(loom, miri)) {
        wait();
        return Duration::ZERO;
    }
    let since = Instant::now();
    wait();
    since.elapsed()
}
