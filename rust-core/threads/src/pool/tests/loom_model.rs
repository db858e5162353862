//! Tests the pool in every order in which its threads may run: `RUSTFLAGS="--cfg loom" cargo test
//! --release -p psidpd-threads`. Loom finds data races, missed wake-ups and deadlocks.

use super::super::*;
use loom::cell::UnsafeCell;

/// Numbers that a piece of work writes; loom detects concurrent access to them.
struct Numbers([UnsafeCell<usize>; 2]);

// SAFETY: loom's cells report concurrent access, which would be an error of the pool.
unsafe impl Sync for Numbers {}

impl Numbers {
    fn write(&self, t: usize, value: usize) {
        // SAFETY: each thread writes the number with its own index.
        self.0[t].with_mut(|number| unsafe { *number = value });
    }

    fn read(&self, t: usize) -> usize {
        // SAFETY: `Pool::run` has returned, so that no thread writes the numbers.
        self.0[t].with(|number| unsafe { *number })
    }
}

/// Runs work that borrows numbers from the stack, and reads them afterwards.
fn run(pool: &Pool, value: usize) {
    let numbers = Numbers([UnsafeCell::new(0), UnsafeCell::new(0)]);
    pool.run(&|t| numbers.write(t, value + t));
    assert_eq!([numbers.read(0), numbers.read(1)], [value, value + 1]);
}

fn model(test: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    // The test leaves out orders with more than three preemptions: most errors need one or two.
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

/// In the second stage each thread writes what the other wrote in the first.
#[test]
fn stages_follow_each_other() {
    model(|| {
        let pool = pool();
        let numbers = Numbers([UnsafeCell::new(0), UnsafeCell::new(0)]);
        let numbers = &numbers;
        pool.in_stages(&mut [0, 1], &[&|t| numbers.write(*t, 1), &|t| numbers.write(1 - *t, 2)]);
        assert_eq!([numbers.read(0), numbers.read(1)], [2, 2]);
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
