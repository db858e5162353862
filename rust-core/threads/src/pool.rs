//! Threads that do one piece of work together, again and again.
//!
//! The thread that calls [`Pool::run`] takes the pool's turn, so that there is one piece of work at a time. It counts the
//! workers as busy, leaves a pointer to the work, and moves the epoch on, which calls the workers. Each worker does its
//! part and counts itself down. The caller does its own part and returns when no worker is busy: the work that it has
//! borrowed is in use no longer.

mod sync;

use crate::shared_slice::SharedSlice;
use std::cell::RefCell;
use std::num::NonZeroUsize;
use sync::{
    Arc, AtomicBool, AtomicUsize, Builder, Condvar, JoinHandle, Mutex, Ordering, spin_loop, thread_local,
};

/// Threads that do one piece of work together, many times a millisecond: they wait for the next piece, and for each other, by
/// spinning for a while, then asleep. Where there are more threads than processors for them they sleep at once, so that those
/// that have work get the processors.
///
/// Pieces of work never overlap: a second thread that calls [`Pool::run`] waits until the first is done. Work that calls
/// [`Pool::run`] of the pool it runs on does all parts of the inner piece where it is. So does a process that was forked from
/// the one that made the pool: it has none of the workers.
pub struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
    /// The process that made the pool.
    process: u32,
    /// Locked as long as a piece of work is in hand.
    turn: Mutex<()>,
}

/// A number of threads that no pool has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadCount(pub usize);

impl std::fmt::Display for ThreadCount {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "threads must be from 1 to {}, found {}", Pool::MOST, self.0)
    }
}

impl std::error::Error for ThreadCount {}

/// A piece of work: called with the number of the thread. The pointer is only followed while [`Pool::run`], which
/// holds the reference it came from, waits for the workers.
#[derive(Clone, Copy)]
struct Work(*const (dyn Fn(usize) + Sync));

// SAFETY: what is pointed to is `Sync`, and outlives every use; see `Pool::run`.
unsafe impl Send for Work {}

struct Shared {
    /// Counts pieces of work; a change calls the workers.
    epoch: AtomicUsize,
    /// Workers not done with the present piece.
    busy: AtomicUsize,
    /// Whether a worker panicked in the present piece.
    failed: AtomicBool,
    stop: AtomicBool,
    work: Mutex<Option<Work>>,
    /// Workers that sleep; changed with `work` locked, so that none is missed.
    asleep: AtomicUsize,
    called: Condvar,
    /// Locked by a caller that goes to sleep, and by the last worker that is done before it wakes the caller.
    waits: Mutex<()>,
    done: Condvar,
    /// How often a thread looks before it goes to sleep.
    spins: usize,
}

/// How often a thread looks for work, or for the others, before it goes to sleep: for 50 to 200 microseconds, as long as a processor
/// takes to pause.
const SPINS: usize = if cfg!(any(loom, miri)) { 1 } else { 4000 };

thread_local! {
    /// The pools whose work this thread is doing, each by the address of what its threads share.
    // The macro of loom takes no constants.
    #[allow(clippy::missing_const_for_thread_local)]
    static WITHIN: RefCell<Vec<usize>> = RefCell::new(Vec::new());
}

impl Pool {
    /// More than any machine has cores. Tens of thousands run into limits of the system that end the program.
    pub const MOST: usize = 1024;

    /// A number of threads from outside, if a pool can have it.
    ///
    /// # Errors
    /// None, or more than [`Pool::MOST`].
    pub fn count(threads: usize) -> Result<NonZeroUsize, ThreadCount> {
        NonZeroUsize::new(threads).filter(|n| n.get() <= Pool::MOST).ok_or(ThreadCount(threads))
    }

    /// A pool of `threads`, the caller's among them; at most [`Pool::MOST`].
    pub fn new(threads: NonZeroUsize) -> Pool {
        let shared = Arc::new(Shared {
            epoch: AtomicUsize::new(0),
            busy: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            work: Mutex::new(None),
            asleep: AtomicUsize::new(0),
            called: Condvar::new(),
            waits: Mutex::new(()),
            done: Condvar::new(),
            spins: if threads.get() > processors() { 0 } else { SPINS },
        });
        let spawn = |number| {
            let shared = shared.clone();
            Builder::new().name(format!("psidpd-{number}")).spawn(move || worker(&shared, number))
        };
        // With fewer threads than asked for the work is done all the same.
        let workers = (1..threads.get().min(Pool::MOST)).map_while(|number| spawn(number).ok()).collect();
        Pool { shared, workers, process: std::process::id(), turn: Mutex::new(()) }
    }

    /// Whether this process was forked from the one that made the pool.
    fn is_forked(&self) -> bool {
        self.process != std::process::id()
    }

    /// How many threads there are.
    pub fn threads(&self) -> usize {
        1 + self.workers.len()
    }

    /// Calls `work` once with each number of a thread, on that thread, and waits for all. If another thread's work is in
    /// hand, waits for that first. Called from work of this pool, or in a forked process, it calls `work` with one number after
    /// the other on the thread that it is called on.
    ///
    /// # Panics
    /// If `work` panics on any thread.
    pub fn run(&self, work: &(dyn Fn(usize) + Sync)) {
        if self.workers.is_empty() || self.is_forked() || Within::is_inside(&self.shared) {
            return (0..self.threads()).for_each(work);
        }
        // Dropped in the opposite order: the turn ends when no worker is busy.
        let _turn = self.turn.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let _within = Within::enter(&self.shared);
        // SAFETY: the lifetime is dropped from the type only. Workers follow the pointer only in between `call` and
        // counting themselves down, and `Wait` keeps this function from returning or unwinding before all have; the turn
        // keeps other callers from counting workers as busy, or calling them, meanwhile.
        let pointer: *const (dyn Fn(usize) + Sync + 'static) = unsafe { std::mem::transmute(work) };
        self.shared.failed.store(false, Ordering::Relaxed);
        self.shared.busy.store(self.workers.len(), Ordering::Relaxed);
        self.shared.call(Some(Work(pointer)));
        let wait = Wait(&self.shared);
        work(0);
        drop(wait);
        assert!(!self.shared.failed.load(Ordering::Relaxed), "a worker thread panicked");
    }

    /// Calls `work` once with each of `things`, which are shared among the threads: as many things as there are threads
    /// get one each, in their order. One alone is done here.
    ///
    /// # Panics
    /// If `work` panics on any thread.
    pub fn each<T: Send>(&self, things: &mut [T], work: impl Fn(&mut T) + Sync) {
        if let [thing] = things {
            return work(thing);
        }
        let (threads, things) = (self.threads(), SharedSlice::new(things));
        self.run(&|t| {
            // SAFETY: `run` calls this once for each number of a thread, and parts of different numbers are disjoint.
            let part = unsafe { things.slice_mut(part(things.len(), t, threads)) };
            part.iter_mut().for_each(&work);
        });
    }
}

impl Shared {
    /// Calls the workers to the next piece of work.
    fn call(&self, work: Option<Work>) {
        let asleep = {
            let mut slot = self.work.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
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

/// Notes that this thread does work of a pool, until it goes.
struct Within;

impl Within {
    fn enter(shared: &Arc<Shared>) -> Within {
        WITHIN.with(|within| within.borrow_mut().push(address(shared)));
        Within
    }

    fn is_inside(shared: &Arc<Shared>) -> bool {
        WITHIN.with(|within| within.borrow().contains(&address(shared)))
    }
}

impl Drop for Within {
    fn drop(&mut self) {
        WITHIN.with(|within| within.borrow_mut().pop());
    }
}

fn address(shared: &Arc<Shared>) -> usize {
    std::ptr::from_ref::<Shared>(shared).addr()
}

/// Waits for the workers when it goes.
struct Wait<'a>(&'a Shared);

impl Drop for Wait<'_> {
    fn drop(&mut self) {
        let busy = || self.0.busy.load(Ordering::Acquire) > 0;
        let mut spins = 0;
        while busy() && spins < self.0.spins {
            spins += 1;
            spin_loop();
        }
        if busy() {
            let mut waits = self.0.waits.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            while busy() {
                waits = self.0.done.wait(waits).unwrap_or_else(|poisoned| poisoned.into_inner());
            }
        }
    }
}

fn worker(shared: &Arc<Shared>, number: usize) {
    let _within = Within::enter(shared);
    let mut seen = 0;
    loop {
        let mut spins = 0;
        while shared.epoch.load(Ordering::Acquire) == seen && spins < shared.spins {
            spins += 1;
            spin_loop();
        }
        let work = {
            let mut slot = shared.work.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            while shared.epoch.load(Ordering::Acquire) == seen {
                shared.asleep.fetch_add(1, Ordering::Relaxed);
                slot = shared.called.wait(slot).unwrap_or_else(|poisoned| poisoned.into_inner());
                shared.asleep.fetch_sub(1, Ordering::Relaxed);
            }
            seen += 1;
            *slot
        };
        if shared.stop.load(Ordering::Relaxed) {
            return;
        }
        let Some(Work(work)) = work else { continue };
        // SAFETY: this worker is busy, and `Pool::run` holds the reference until none is.
        let work = unsafe { &*work };
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(number))).is_err() {
            shared.failed.store(true, Ordering::Relaxed);
        }
        if shared.busy.fetch_sub(1, Ordering::Release) == 1 {
            // A caller that saw this worker busy is asleep once the lock can be had.
            drop(shared.waits.lock());
            shared.done.notify_one();
        }
    }
}

impl std::fmt::Debug for Pool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pool").field("threads", &self.threads()).finish()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        if self.is_forked() {
            // The workers are the parent's: here nobody would ever join.
            return self.workers.drain(..).for_each(std::mem::forget);
        }
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.call(None);
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

/// How many processors this process may use; more than any pool has where that is not known.
#[must_use]
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(usize::MAX, NonZeroUsize::get)
}

/// The part of `count` things that thread `number` of `threads` does.
#[inline]
pub fn part(count: usize, number: usize, threads: usize) -> std::ops::Range<usize> {
    count * number / threads..count * (number + 1) / threads
}

#[cfg(all(test, not(loom)))]
mod miri_sized;

#[cfg(all(test, loom))]
mod loom_model;
