//! Several runs at once, one to a core.

use psidpd_report::Bar;
use std::sync::Mutex;

pub type Job<'a, T> = Box<dyn FnOnce() -> T + Send + 'a>;

/// Carries out `jobs` on as many threads as there are cores, but never more than two: the machine
/// may have other work. The last begins first, so that the longest are best at the end. Results come in the order of the
/// jobs.
pub fn run<T: Send>(jobs: Vec<Job<'_, T>>) -> Vec<T> {
    let workers = std::thread::available_parallelism().map_or(1, |n| n.get().min(2));
    let count = jobs.len();
    let queue = Mutex::new(jobs.into_iter().enumerate().rev());
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    std::thread::scope(|scope| {
        for _ in 0..workers.min(count) {
            scope.spawn(|| {
                loop {
                    let next = queue.lock().unwrap_or_else(|e| e.into_inner()).next();
                    let Some((index, job)) = next else { return };
                    let result = job();
                    done.lock().unwrap_or_else(|e| e.into_inner()).push((index, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// The same with a bar of the jobs that are done.
pub fn counted<'a, T: Send + 'a>(jobs: Vec<Job<'a, T>>, bar: &'a Bar) -> Vec<T> {
    let count = |job: Job<'a, T>| -> Job<'a, T> {
        Box::new(move || {
            let result = job();
            bar.advance(1);
            result
        })
    };
    let results = run(jobs.into_iter().map(count).collect());
    bar.finish();
    results
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_jobs() {
        let jobs: Vec<Job<usize>> = (0..20usize).map(|k| Box::new(move || k * k) as Job<usize>).collect();
        assert_eq!(run(jobs), (0..20).map(|k| k * k).collect::<Vec<_>>());
        assert!(run(Vec::<Job<u8>>::new()).is_empty());
    }
}
