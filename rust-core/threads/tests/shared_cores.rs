//! Threads whose processors other programs use.

#![cfg(not(any(loom, miri)))]

use psidpd_threads::{Pool, processors};
use std::hint::{black_box, spin_loop};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A piece of work as a time step has it: stages of some ten microseconds on two threads.
fn piece(pool: &Pool) {
    let part = |sum: &mut u64| {
        for k in 0..20_000 {
            *sum = black_box(sum.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(k));
        }
    };
    pool.in_stages(&mut [1u64; 2], &[&part, &part, &part, &part]);
}

/// Pieces that a pool does in half a second.
fn pace(pool: &Pool) -> u32 {
    let (start, mut pieces) = (Instant::now(), 0);
    while start.elapsed() < Duration::from_millis(500) {
        piece(pool);
        pieces += 1;
    }
    pieces
}

/// Two threads next to a busy one on every processor but one are hardly slower than one thread there. The best of some rounds
/// counts, as other programs may run here too.
#[test]
fn two_threads_next_to_a_busy_one_are_as_fast_as_one() {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 1..processors() {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    spin_loop()
                }
            });
        }
        let [one, two] = [1, 2].map(|threads| Pool::new(NonZeroUsize::new(threads).unwrap()));
        let round = |_| f64::from(pace(&one)) / f64::from(pace(&two));
        let slower = (0..6).map(round).fold(f64::INFINITY, f64::min);
        stop.store(true, Ordering::Relaxed);
        println!("{slower:.2} times the time of one thread; alone for {:?}", two.time_alone());
        assert!(slower < 1.3, "{slower:.2}");
    });
}
