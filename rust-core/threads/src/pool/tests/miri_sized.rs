use super::super::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

fn pool(threads: usize) -> Pool {
    Pool::new(NonZeroUsize::new(threads).unwrap())
}

#[test]
fn every_thread_does_its_part_every_time() {
    for threads in 1..5 {
        let pool = pool(threads);
        assert_eq!(pool.threads(), threads);
        let sum = AtomicUsize::new(0);
        for round in 0..200 {
            pool.run(&|t| {
                sum.fetch_add(part(1000, t, threads).sum::<usize>(), Ordering::Relaxed);
            });
            assert_eq!(sum.load(Ordering::Relaxed), (round + 1) * 499_500);
            if round % 50 == 0 {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    }
}

#[test]
fn each_thing_is_done_once() {
    for threads in 1..5 {
        let pool = pool(threads);
        for count in [0, 1, 2, 7] {
            let mut things = vec![1; count];
            pool.each(&mut things, |thing| *thing += 1);
            assert!(things.iter().all(|thing| *thing == 2));
        }
    }
}

/// Each stage reads what all things have written in the one before.
#[test]
fn stages_wait_for_all_things() {
    for threads in 1..5 {
        let pool = pool(threads);
        for count in [0, 1, 2, 7] {
            let done = [const { AtomicUsize::new(0) }; 3];
            let stage = |number: usize| {
                let done = &done;
                move |_: &mut usize| {
                    let before =
                        number.checked_sub(1).map_or(count, |before| done[before].load(Ordering::Relaxed));
                    assert_eq!(before, count, "{threads} threads");
                    done[number].fetch_add(1, Ordering::Relaxed);
                }
            };
            pool.in_stages(&mut vec![0; count], &[&stage(0), &stage(1), &stage(2)]);
            assert!(done.iter().all(|done| done.load(Ordering::Relaxed) == count));
        }
    }
}

#[test]
fn a_panic_in_a_stage_reaches_the_caller_and_ends_the_stages() {
    let pool = pool(3);
    for thread in 0..3 {
        let later = AtomicUsize::new(0);
        let caught = catch_unwind(AssertUnwindSafe(|| {
            let panics = |t: &mut usize| assert_ne!(*t, thread, "on purpose");
            let counts = |_: &mut usize| {
                later.fetch_add(1, Ordering::Relaxed);
            };
            pool.in_stages(&mut [0, 1, 2], &[&panics, &counts]);
        }));
        assert!(caught.is_err() && later.into_inner() == 0);
        let mut things = [1; 3];
        pool.in_stages(&mut things, &[&|thing| *thing += 1, &|thing| *thing *= 2]);
        assert_eq!(things, [4; 3]);
    }
}

#[test]
fn a_panic_of_a_worker_reaches_the_caller_and_the_next_piece_is_done() {
    let pool = pool(2);
    for thread in [1, 0] {
        let caught = catch_unwind(AssertUnwindSafe(|| pool.run(&|t| assert_ne!(t, thread, "on purpose"))));
        assert!(caught.is_err());
        let done = AtomicUsize::new(0);
        pool.run(&|t| {
            done.fetch_add(t + 1, Ordering::Relaxed);
        });
        assert_eq!(done.into_inner(), 3);
    }
}

/// What a panic has thrown may panic when it is dropped.
#[test]
fn a_worker_whose_panic_panics_again_does_the_next_piece() {
    struct Bomb;
    impl Drop for Bomb {
        fn drop(&mut self) {
            panic!("again, on purpose");
        }
    }
    let pool = pool(3);
    let throws = |t: usize| {
        if t == 1 {
            std::panic::panic_any(Bomb)
        }
    };
    assert!(catch_unwind(AssertUnwindSafe(|| pool.run(&throws))).is_err());
    assert!(catch_unwind(AssertUnwindSafe(|| pool.in_stages(&mut [0, 1, 2], &[&|t| throws(*t)]))).is_err());
    let seen = AtomicUsize::new(0);
    pool.run(&|t| {
        seen.fetch_or(1 << t, Ordering::Relaxed);
    });
    assert_eq!(seen.into_inner(), 7);
}

/// Each caller's work is on its own stack, and invalid after its call returns.
#[test]
fn pieces_of_two_callers_do_not_overlap() {
    let pool = pool(3);
    let rounds = if cfg!(miri) { 5 } else { 500 };
    let callers = [AtomicUsize::new(0), AtomicUsize::new(0)];
    std::thread::scope(|scope| {
        for caller in 0..2 {
            let (pool, callers) = (&pool, &callers);
            scope.spawn(move || {
                for round in 0..rounds {
                    let mut done = vec![0; 3];
                    let parts = SharedSlice::new(&mut done);
                    pool.run(&|t| {
                        callers[caller].fetch_add(1, Ordering::SeqCst);
                        assert_eq!(callers[1 - caller].load(Ordering::SeqCst), 0, "the other is at work");
                        // SAFETY: each thread has the element with its own number.
                        let part = unsafe { parts.slice_mut(t..t + 1) };
                        part[0] = round + t;
                        callers[caller].fetch_sub(1, Ordering::SeqCst);
                    });
                    assert_eq!(done, [round, round + 1, round + 2]);
                }
            });
        }
    });
}

/// Work that runs inner work on the same pool does not deadlock.
#[test]
fn inner_pieces_are_done_where_they_are_called() {
    let (pool, other) = (pool(3), pool(2));
    let done = [const { AtomicUsize::new(0) }; 3];
    pool.run(&|outer| {
        let here = std::thread::current().id();
        pool.run(&|inner| {
            assert_eq!(std::thread::current().id(), here);
            done[inner].fetch_add(1 << (8 * outer), Ordering::Relaxed);
        });
        // Another pool is independent, but its threads may do work of both pools.
        other.run(&|t| {
            if t == 0 {
                pool.run(&|_| assert_eq!(std::thread::current().id(), here));
            }
        });
    });
    assert!(done.iter().all(|done| done.load(Ordering::Relaxed) == 0x1_0101));
    // After this all threads share the work again.
    let seen = AtomicUsize::new(0);
    pool.run(&|t| {
        seen.fetch_or(1 << t, Ordering::Relaxed);
    });
    assert_eq!(seen.into_inner(), 7);
}
