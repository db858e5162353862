//! Threads that wait give their processors to others.

#![cfg(all(target_os = "linux", not(any(loom, miri))))]

use psidpd_threads::{Pool, processors};
use std::num::NonZeroUsize;

/// Processor time of all threads of this process, in seconds.
fn busy() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let of_task = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).unwrap();
        text.split_whitespace().next().unwrap().parse::<f64>().unwrap()
    };
    1e-9 * tasks.map(|task| of_task(task.unwrap())).sum::<f64>()
}

/// With four times as many threads as processors a piece of work costs each thread the time to wake and to sleep, some ten
/// microseconds. Threads that spin for a while before they sleep, as they do where each has a processor, take turns in that: a
/// hundred microseconds and more for each.
#[test]
fn more_threads_than_processors_sleep_while_they_wait() {
    let threads = (4 * processors()).min(Pool::MOST);
    let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
    let pieces = 200;
    let before = busy();
    (0..pieces).for_each(|_| pool.run(&|_| ()));
    let each = (busy() - before) / f64::from(pieces) / f64::from(threads as u32);
    assert!(each < 50e-6, "{:.1} microseconds", 1e6 * each);
}
