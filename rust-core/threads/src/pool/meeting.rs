//! Where the threads of a piece of work wait for each other between its stages.

use std::time::Duration;

use super::sync::{AtomicBool, AtomicUsize, Condvar, Mutex, Ordering, spin_loop, time_of};

pub struct Meeting {
    threads: usize,
    /// Number of checks before a thread sleeps.
    spins: usize,
    /// Number of arrivals at all stages.
    arrived: AtomicUsize,
    /// Sum of the times that threads have waited, in nanoseconds.
    waited: AtomicUsize,
    /// Whether a thread panicked: later stages are left out.
    failed: AtomicBool,
    /// Number of sleeping threads; changes only with `lock` locked.
    asleep: AtomicUsize,
    lock: Mutex<()>,
    all_are_here: Condvar,
}

impl Meeting {
    pub fn new(threads: usize, spins: usize) -> Meeting {
        Meeting {
            threads,
            spins,
            arrived: AtomicUsize::new(0),
            waited: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            asleep: AtomicUsize::new(0),
            lock: Mutex::new(()),
            all_are_here: Condvar::new(),
        }
    }

    pub fn fail(&self) {
        self.failed.store(true, Ordering::Relaxed);
    }

    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Sum of the times that threads have waited here.
    pub fn waited(&self) -> Duration {
        Duration::from_nanos(self.waited.load(Ordering::Relaxed) as u64)
    }

    /// Waits until all threads have called this for the stage of this number.
    pub fn wait(&self, stage: usize) {
        let all = self.threads * (stage + 1);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == all {
            // A thread that has seen too few is asleep once the lock is free.
            let lock = self.lock.lock();
            let asleep = self.asleep.load(Ordering::Relaxed) > 0;
            drop(lock);
            if asleep {
                self.all_are_here.notify_all();
            }
            return;
        }
        let are_missing = || self.arrived.load(Ordering::Acquire) < all;
        let waited = time_of(|| self.wait_for(are_missing));
        self.waited.fetch_add(waited.as_nanos() as usize, Ordering::Relaxed);
    }

    fn wait_for(&self, are_missing: impl Fn() -> bool) {
        let mut spins = 0;
        while are_missing() && spins < self.spins {
            spins += 1;
            spin_loop();
        }
        if are_missing() {
            let mut lock = self.lock.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            self.asleep.fetch_add(1, Ordering::Relaxed);
            while are_missing() {
                lock = self.all_are_here.wait(lock).unwrap_or_else(|poisoned| poisoned.into_inner());
            }
            self.asleep.fetch_sub(1, Ordering::Relaxed);
        }
    }
}
