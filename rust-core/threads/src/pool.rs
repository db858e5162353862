//! A pool of threads that repeatedly share the work of one function.
//!
//! The thread that calls [`Pool::run`] locks the pool's turn, so that there is one piece of work at a
//! time. It marks the workers as busy, stores a pointer to the work, and increments the epoch, which
//! starts the workers. Each worker does its part and marks itself as done. The caller does its own part
//! and returns when no worker is busy: then no thread uses the borrowed work.

mod balance;
mod meeting;
mod sync;

use crate::shared_slice::SharedSlice;
use balance::Balance;
use meeting::Meeting;
use std::cell::RefCell;
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};
use sync::{
    Arc, AtomicBool, AtomicUsize, Builder, Condvar, JoinHandle, Mutex, Ordering, spin_loop, thread_local,
    time_of,
};

/// Threads that share work many times a millisecond: they wait for the next piece, and for each other,
/// by spinning for a while, and then sleep. If there are more threads than processors they sleep at
/// once, so that threads with work get the processors.
///
/// Pieces of work never overlap: a second thread that calls [`Pool::run`] waits until the first is
/// done. Where threads hold each other, because other programs use their processors, the calling thread does all parts for a
/// while if that is faster. If work calls [`Pool::run`] of its own pool, the calling thread does all parts of the inner
/// piece. The same holds in a process that was forked from the one with the pool: it has no workers.
pub struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
    /// Identifier of the process that made the pool.
    process: u32,
    /// Locked while a piece of work runs.
    turn: Mutex<Balance>,
}

/// The error of a number of threads that no pool can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadCount(pub usize);

impl std::fmt::Display for ThreadCount {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "threads must be from 1 to {}, found {}", Pool::MOST, self.0)
    }
}

impl std::error::Error for ThreadCount {}

/// A piece of work, which is called with the number of the thread. The pointer is used only while
/// [`Pool::run`], which holds the reference, waits for the workers.
#[derive(Clone, Copy)]
struct Work(*const (dyn Fn(usize) + Sync));

// SAFETY: the function is `Sync`, and `Pool::run` keeps it alive until every worker is done.
unsafe impl Send for Work {}

struct Shared {
    /// Number of pieces of work; a change starts the workers.
    epoch: AtomicUsize,
    /// Number of workers that have not finished the present piece.
    busy: AtomicUsize,
    /// Whether a worker panicked in the present piece.
    failed: AtomicBool,
    stop: AtomicBool,
    work: Mutex<Option<Work>>,
    /// Number of sleeping workers; changes only with `work` locked, so that none is missed.
    asleep: AtomicUsize,
    called: Condvar,
    /// Locked by a caller before it sleeps, and by the last worker before it wakes the caller.
    waits: Mutex<()>,
    done: Condvar,
    /// Number of checks before a thread sleeps.
    spins: usize,
}

/// Number of checks for work, or for the other threads, before a thread sleeps: they take 50 to 200
/// microseconds, depending on the processor's pause instruction.
const SPINS: usize = if cfg!(any(loom, miri)) { 1 } else { 4000 };

thread_local! {
    /// The pools whose work this thread is doing, each by the address of its shared data.
    // Loom's macro does not accept constants.
    #[allow(clippy::missing_const_for_thread_local)]
    static WITHIN: RefCell<Vec<usize>> = RefCell::new(Vec::new());
}

impl Pool {
    /// Largest number of threads, more than machines have cores. Tens of thousands exceed limits of
    /// the system and end the program.
    pub const MOST: usize = 1024;

    /// Checks a number of threads from outside.
    ///
    /// # Errors
    /// Fails for zero, and for more than [`Pool::MOST`].
    pub fn count(threads: usize) -> Result<NonZeroUsize, ThreadCount> {
        NonZeroUsize::new(threads).filter(|n| n.get() <= Pool::MOST).ok_or(ThreadCount(threads))
    }

    /// Creates a pool of `threads` threads, including the caller's; at most [`Pool::MOST`].
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
        // If the system creates fewer threads, these do all the work.
        let workers = (1..threads.get().min(Pool::MOST)).map_while(|number| spawn(number).ok()).collect();
        Pool { shared, workers, process: std::process::id(), turn: Mutex::new(Balance::new(Instant::now())) }
    }

    /// Whether this process was forked from the one that made the pool.
    fn is_forked(&self) -> bool {
        self.process != std::process::id()
    }

    /// Whether the calling thread does all work.
    fn is_alone(&self) -> bool {
        self.workers.is_empty() || self.is_forked() || Within::is_inside(&self.shared)
    }

    /// The number of threads, including the caller's.
    pub fn threads(&self) -> usize {
        1 + self.workers.len()
    }

    /// Calls `work` once with each number of a thread, on that thread, and waits for all. If another
    /// piece of work runs, waits for it first. In work of this pool, and in a forked process, the
    /// calling thread calls `work` with all numbers in turn.
    ///
    /// # Panics
    /// Panics if `work` panics on any thread.
    pub fn run(&self, work: &(dyn Fn(usize) + Sync)) {
        if self.is_alone() {
            return (0..self.threads()).for_each(work);
        }
        // Locals are dropped in the opposite order: the turn ends when no worker is busy.
        let mut turn = self.turn.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let _within = Within::enter(&self.shared);
        if self.prefers_alone(&mut turn) {
            return (0..self.threads()).for_each(work);
        }
        turn.add_wait(self.share(work));
    }

    /// Whether the calling thread, whose turn it is, does all parts of the next piece of work.
    fn prefers_alone(&self, turn: &mut Balance) -> bool {
        // The tests that go through all orders of the threads, or interpret them, know no time.
        !cfg!(any(loom, miri)) && turn.begin(Instant::now(), self.threads())
    }

    /// The sum of the times in which one thread has worked for all, because others would have held it.
    pub fn time_alone(&self) -> Duration {
        self.turn.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).time_alone()
    }

    /// Calls `work` with each number of a thread on that thread; returns how long the caller has waited for the others. It is
    /// the caller's turn.
    fn share(&self, work: &(dyn Fn(usize) + Sync)) -> Duration {
        // SAFETY: only the lifetime is removed from the type. Workers use the pointer only between
        // `call` and marking themselves as done, and `Wait` keeps this function from returning or
        // unwinding before all have; the turn keeps other callers from starting workers meanwhile.
        let pointer: *const (dyn Fn(usize) + Sync + 'static) = unsafe { std::mem::transmute(work) };
        self.shared.failed.store(false, Ordering::Relaxed);
        self.shared.busy.store(self.workers.len(), Ordering::Relaxed);
        self.shared.call(Some(Work(pointer)));
        let wait = Wait(&self.shared);
        work(0);
        let waited = time_of(|| drop(wait));
        assert!(!self.shared.failed.load(Ordering::Relaxed), "a worker thread panicked");
        waited
    }

    /// Calls `work` once with each of `things`, which are divided among the threads: as many things as
    /// there are threads get one each, in their order. The calling thread does a single thing.
    ///
    /// # Panics
    /// Panics if `work` panics on any thread.
    pub fn each<T: Send>(&self, things: &mut [T], work: impl Fn(&mut T) + Sync) {
        if let [thing] = things {
            return work(thing);
        }
        self.parts(things, |_, part| part.iter_mut().for_each(&work));
    }

    /// Calls `work` with the part of `things` of each thread, and with the number of its first thing.
    ///
    /// # Panics
    /// Panics if `work` panics on any thread.
    pub fn parts<T: Send>(&self, things: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        let (threads, things) = (self.threads(), SharedSlice::new(things));
        self.run(&|t| {
            let range = part(things.len(), t, threads);
            let first = range.start;
            // SAFETY: `run` calls this once for each number of a thread, and `part` makes
            // ranges of different numbers disjoint.
            work(first, unsafe { things.slice_mut(range) });
        });
    }

    /// Does the work of all stages with each of `things`, which are divided among the threads as in [`Pool::each`]. A
    /// stage begins when the previous one is done with all things: there the threads wait for each other, which costs
    /// less than half of a further piece of work.
    ///
    /// # Panics
    /// Panics if a stage panics on any thread; later stages are then left out.
    pub fn in_stages<T: Send>(&self, things: &mut [T], stages: &[&(dyn Fn(&mut T) + Sync)]) {
        if self.is_alone() || things.len() == 1 {
            return stages.iter().for_each(|stage| things.iter_mut().for_each(stage));
        }
        let mut turn = self.turn.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let _within = Within::enter(&self.shared);
        if self.prefers_alone(&mut turn) {
            return stages.iter().for_each(|stage| things.iter_mut().for_each(stage));
        }
        let (threads, things) = (self.threads(), SharedSlice::new(things));
        let meeting = Meeting::new(threads, self.shared.spins);
        let waited = self.share(&|t| {
            // SAFETY: `share` calls this once for each number of a thread, and `part` makes
            // ranges of different numbers disjoint.
            let part = unsafe { things.slice_mut(part(things.len(), t, threads)) };
            let mut panic = None;
            for (number, stage) in stages.iter().enumerate() {
                if number > 0 {
                    meeting.wait(number - 1);
                }
                // A thread that panicked still comes to the meetings.
                if !meeting.has_failed() {
                    let work = std::panic::AssertUnwindSafe(|| part.iter_mut().for_each(stage));
                    if let Err(what) = std::panic::catch_unwind(work) {
                        meeting.fail();
                        panic = Some(what);
                    }
                }
            }
            if let Some(what) = panic {
                std::panic::resume_unwind(what);
            }
        });
        turn.add_wait(waited + meeting.waited());
    }
}

impl Shared {
    /// Starts the workers on the next piece of work.
    fn call(&self, work: Option<Work>) {
        let asleep = {
            let mut slot = self.work.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            *slot = work;
            self.epoch.fetch_add(1, Ordering::Release);
            self.asleep.load(Ordering::Relaxed) > 0
        };
        // Waking takes a system call, which costs more than many a piece of work.
        if asleep {
            self.called.notify_all();
        }
    }
}

/// Marks this thread as doing work of a pool until the value is dropped.
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

/// Waits for the workers when it is dropped.
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
        // SAFETY: this worker is busy, and `Pool::run` holds the reference until no worker is.
        let work = unsafe { &*work };
        if let Err(what) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(number))) {
            shared.failed.store(true, Ordering::Relaxed);
            // Dropping what a panic has thrown may panic again, and the caller would wait for this worker for ever.
            if let Err(again) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| drop(what))) {
                std::mem::forget(again);
            }
        }
        if shared.busy.fetch_sub(1, Ordering::Release) == 1 {
            // A caller that saw this worker busy is asleep once the lock is free.
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
            // The workers are threads of the parent process: joining them here would never end.
            return self.workers.drain(..).for_each(std::mem::forget);
        }
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.call(None);
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

/// Number of processors that this process may use; more than any pool has if it is unknown.
#[must_use]
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(usize::MAX, NonZeroUsize::get)
}

/// As many of `threads` as there are processors for: more would take turns, and results do not depend on their number.
#[must_use]
pub fn at_once(threads: NonZeroUsize) -> NonZeroUsize {
    NonZeroUsize::new(processors()).map_or(threads, |processors| threads.min(processors))
}

/// The part of `count` things that thread `number` of `threads` does.
#[inline]
pub fn part(count: usize, number: usize, threads: usize) -> std::ops::Range<usize> {
    count * number / threads..count * (number + 1) / threads
}

/// Splits off the first `count` elements.
pub fn take<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (first, behind) = std::mem::take(rest).split_at_mut(count);
    *rest = behind;
    first
}

#[cfg(test)]
mod tests;
