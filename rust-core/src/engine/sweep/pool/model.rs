//! The pool in every order in which its threads may run: `RUSTFLAGS="--cfg loom" cargo test --release -p psidpd-core
//! --lib pool`. Loom finds accesses that race, calls that nobody answers, and threads that wait for ever.

use super::*;
use loom::cell::UnsafeCell;

/// A number that a piece of work writes: loom sees who writes and reads it at once.
struct Numbers([UnsafeCell<usize>; 2]);

// SAFETY: loom's cells find accesses at once, which would be a fault of the pool.
unsafe impl Sync for Numbers {}

/// Runs work that borrows numbers from the stack, and looks at them when it is done.
fn run(pool: &Pool, value: usize) {
    let numbers = Numbers([UnsafeCell::new(0), UnsafeCell::new(0)]);
    pool.run(&|t| {
        numbers.0[t].with_mut(|number| {
            // SAFETY: each thread has a number of its own.
            unsafe { *number = value + t }
        })
    });
    for (t, number) in numbers.0.iter().enumerate() {
        // SAFETY: the threads are done.
        number.with(|number| assert_eq!(unsafe { *number }, value + t));
    }
}

fn model(test: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    // More than three of these at the wrong moment are left out: most faults take one or two.
    builder.preemption_bound = Some(3);
    builder.check(test);
}

fn pool() -> Pool {
    Pool::new(NonZeroUsize::new(2).unwrap())
}

#[test]
fn pieces_follow_each_other() {
    model(|| {
        let pool = pool();
        run(&pool, 1);
        run(&pool, 3);
    });
}

#[test]
fn two_callers_wait_for_each_other() {
    model(|| {
        let pool = Arc::new(pool());
        let other = pool.clone();
        let caller = loom::thread::spawn(move || run(&other, 5));
        run(&pool, 7);
        caller.join().unwrap();
    });
}

#[test]
fn inner_pieces_wait_for_nobody() {
    model(|| {
        let pool = pool();
        let done = AtomicUsize::new(0);
        pool.run(&|outer| {
            pool.run(&|inner| {
                done.fetch_add(1 << (4 * outer + inner), Ordering::Relaxed);
            });
        });
        assert_eq!(done.load(Ordering::Relaxed), 0x33);
    });
}
