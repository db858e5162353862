//! Tests a pool in a process that was forked from the one with the pool.
#![cfg(not(any(loom, miri)))]

use psidpd_threads::Pool;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

unsafe extern "C" {
    fn fork() -> i32;
    fn alarm(seconds: u32) -> u32;
    fn _exit(status: i32) -> !;
    fn waitpid(process: i32, status: *mut i32, options: i32) -> i32;
}

#[test]
fn a_forked_process_does_all_the_work_and_ends() {
    let pool = Pool::new(NonZeroUsize::new(3).unwrap());
    let sum = || {
        let sum = AtomicUsize::new(0);
        pool.run(&|t| {
            sum.fetch_add(t + 1, Ordering::Relaxed);
        });
        sum.into_inner()
    };
    assert_eq!(sum(), 6);
    // SAFETY: the child takes no lock that another thread may have held: it allocates nothing, uses the pool, and ends.
    let child = unsafe { fork() };
    if child == 0 {
        // SAFETY: `alarm` takes a number. The signal ends a child that hangs, and then its status is not 0.
        unsafe { alarm(20) };
        let right = sum() == 6;
        drop(pool);
        // SAFETY: `_exit` takes a number, and ends the child.
        unsafe { _exit(i32::from(!right)) }
    }
    let mut status = -1;
    // SAFETY: `status` is a local variable of this function.
    assert_eq!(unsafe { waitpid(child, &raw mut status, 0) }, child);
    assert_eq!(status, 0, "the child was wrong, or hung");
    assert_eq!(sum(), 6);
}
