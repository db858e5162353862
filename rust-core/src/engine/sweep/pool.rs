use crate::engine::sweep::ground::shared_ptr::SharedPtr as Pointer;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{self, JoinHandle};

/// Threads that do one piece of work together, again and again, many times a millisecond: they wait for
/// the next piece by spinning for a while, then asleep.
pub struct Pool {
    shared: Arc<SharedPtr>,
    workers: Vec<JoinHandle<()>>,
}

/// A piece of work: called with the number of the thread. The pointer is only followed while
/// [`Pool::run`], which holds the reference it came from, waits for the workers.
#[derive(Clone, Copy)]
struct Work(*const (dyn Fn(usize) + Sync));

// SAFETY: what is pointed to is `Sync`, and outlives every use; see `Pool::run`.
unsafe impl Send for Work {}

struct SharedPtr {
    /// Counts pieces of work; a change calls the workers.
    epoch: AtomicUsize,
    /// Workers not done with the present piece.
    busy: AtomicUsize,
    /// Whether a worker panicked.
    failed: AtomicBool,
    stop: AtomicBool,
    work: Mutex<Option<Work>>,
    /// Workers that sleep; changed with `work` locked, so that none is missed.
    asleep: AtomicUsize,
    called: Condvar,
}

/// Looks at the epoch before a worker goes to sleep: some tens of microseconds.
const SPINS: usize = 20_000;

impl Pool {
    /// More than any machine has cores. Tens of thousands run into limits of the system that end the program.
    pub const MOST: usize = 1024;

    /// A pool of `threads`, the caller's among them; at most [`Pool::MOST`].
    pub fn new(threads: NonZeroUsize) -> Pool {
        let shared = Arc::new(SharedPtr {
            epoch: AtomicUsize::new(0),
            busy: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            work: Mutex::new(None),
            asleep: AtomicUsize::new(0),
            called: Condvar::new(),
        });
        let spawn = |number| {
            let shared = shared.clone();
            thread::Builder::new().name(format!("psidpd-{number}")).spawn(move || worker(&shared, number))
        };
        // With fewer threads than asked for the work is done all the same.
        let workers = (1..threads.get().min(Pool::MOST)).map_while(|number| spawn(number).ok()).collect();
        Pool { shared, workers }
    }

    /// How many threads there are.
    pub fn threads(&self) -> usize {
        1 + self.workers.len()
    }

    /// Calls `work` once on every thread, with its number, and waits for all.
    ///
    /// # Panics
    /// If `work` panics on any thread.
    pub fn run(&self, work: &(dyn Fn(usize) + Sync)) {
        if self.workers.is_empty() {
            return work(0);
        }
        // SAFETY: the lifetime is dropped from the type only; workers are waited for below, also if
        // this thread's part panics.
        let pointer: *const (dyn Fn(usize) + Sync + 'static) = unsafe { std::mem::transmute(work) };
        self.shared.busy.store(self.workers.len(), Ordering::Relaxed);
        self.shared.call(Some(Work(pointer)));
        let wait = Wait(&self.shared);
        work(0);
        drop(wait);
        assert!(!self.shared.failed.load(Ordering::Relaxed), "a worker thread panicked");
    }

    /// Calls `work` once with each of `things`, which are shared among the threads; one alone is done here.
    ///
    /// # Panics
    /// If `work` panics on any thread.
    pub fn each<T: Send>(&self, things: &mut [T], work: impl Fn(&mut T) + Sync) {
        if let [thing] = things {
            return work(thing);
        }
        let (count, threads, first) = (things.len(), self.threads(), Pointer(things.as_mut_ptr()));
        self.run(&|t| {
            for k in part(count, t, threads) {
                // SAFETY: in the slice, and in the part of this thread alone.
                work(unsafe { &mut *first.at(k) });
            }
        });
    }
}

impl SharedPtr {
    /// Calls the workers to the next piece of work.
    fn call(&self, work: Option<Work>) {
        let asleep = {
            let mut slot = self.work.lock().unwrap_or_else(|e| e.into_inner());
            *slot = work;
            self.epoch.fetch_add(1, Ordering::Release);
            self.asleep.load(Ordering::Relaxed) > 0
        };
        // A call of the system, which costs more than many a piece of work.
        if asleep {
            self.called.notify_all();
        }
    }
}

/// Waits for the workers when it goes.
struct Wait<'a>(&'a SharedPtr);

impl Drop for Wait<'_> {
    fn drop(&mut self) {
        let mut spins = 0;
        while self.0.busy.load(Ordering::Acquire) > 0 {
            spins += 1;
            // With fewer processors than threads the worker may need this one.
            if spins % SPINS == 0 { thread::yield_now() } else { std::hint::spin_loop() }
        }
    }
}

fn worker(shared: &SharedPtr, number: usize) {
    let mut seen = 0;
    loop {
        let mut spins = 0;
        while shared.epoch.load(Ordering::Acquire) == seen && spins < SPINS {
            spins += 1;
            std::hint::spin_loop();
        }
        let work = {
            let mut slot = shared.work.lock().unwrap_or_else(|e| e.into_inner());
            while shared.epoch.load(Ordering::Acquire) == seen {
                shared.asleep.fetch_add(1, Ordering::Relaxed);
                slot = shared.called.wait(slot).unwrap_or_else(|e| e.into_inner());
                shared.asleep.fetch_sub(1, Ordering::Relaxed);
            }
            seen += 1;
            *slot
        };
        if shared.stop.load(Ordering::Relaxed) {
            return;
        }
        let Some(Work(work)) = work else { continue };
        // SAFETY: `Pool::run` holds the reference until `busy` is zero.
        let work = unsafe { &*work };
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(number))).is_err() {
            shared.failed.store(true, Ordering::Relaxed);
        }
        shared.busy.fetch_sub(1, Ordering::Release);
    }
}

impl std::fmt::Debug for Pool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pool").field("threads", &self.threads()).finish()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.call(None);
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

/// The part of `count` things that thread `number` of `threads` does.
pub fn part(count: usize, number: usize, threads: usize) -> std::ops::Range<usize> {
    count * number / threads..count * (number + 1) / threads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thread_does_its_part_every_time() {
        for threads in 1..5 {
            let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
            assert_eq!(pool.threads(), threads);
            let sum = AtomicUsize::new(0);
            for round in 0..200 {
                pool.run(&|t| {
                    sum.fetch_add(part(1000, t, threads).sum::<usize>(), Ordering::Relaxed);
                });
                assert_eq!(sum.load(Ordering::Relaxed), (round + 1) * 499_500);
                if round % 50 == 0 {
                    thread::sleep(std::time::Duration::from_millis(2));
                }
            }
        }
    }

    #[test]
    fn each_thing_is_done_once() {
        for threads in 1..5 {
            let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
            for count in [0, 1, 2, 7] {
                let mut things = vec![1; count];
                pool.each(&mut things, |thing| *thing += 1);
                assert!(things.iter().all(|thing| *thing == 2));
            }
        }
    }

    #[test]
    fn a_panic_of_a_worker_reaches_the_caller() {
        let pool = Pool::new(NonZeroUsize::new(2).unwrap());
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            pool.run(&|t| assert_eq!(t, 0, "on purpose"));
        }));
        assert!(caught.is_err());
    }
}
