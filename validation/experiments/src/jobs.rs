//! Several runs at once.

use psidpd_core::engine::Fault;
use psidpd_report::Progress;
use std::sync::{Mutex, PoisonError};

/// Does `work` with numbered items on so many threads. Items are begun in their order; results come in the order of the numbers.
pub fn on<I, T: Send>(
    threads: usize,
    items: impl Iterator<Item = (usize, I)> + Send,
    work: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let (queue, done) = (Mutex::new(items), Mutex::new(Vec::new()));
    let worker = || {
        loop {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((number, item)) = next else { return };
            let result = work(item);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((number, result));
        }
    };
    let fault = Fault::present();
    let worker = || Fault::during(fault, worker);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(worker))));
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Does `work` with items on as many threads as there are cores, but never more than two: the machine may have other work. The
/// last item is begun first, so that the longest are best at the end. Results come in the order of the items.
pub fn each<I: Send, T: Send>(items: Vec<I>, work: impl Fn(I) -> T + Sync) -> Vec<T> {
    let workers = std::thread::available_parallelism().map_or(1, |n| n.get().min(2));
    on(workers.min(items.len()), items.into_iter().enumerate().rev(), work)
}

/// Works through items as [`each`] does, with a bar of those that are done.
pub fn counted<I: Send, T: Send>(
    (progress, name): (&Progress, &str),
    items: Vec<I>,
    work: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let bar = progress.bar(name, items.len() as u64);
    each(items, |item| {
        let result = work(item);
        bar.advance(1);
        result
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_items() {
        assert_eq!(each((0..20).collect(), |k| k * k), (0..20).map(|k| k * k).collect::<Vec<_>>());
        assert!(each(Vec::<u8>::new(), |_| ()).is_empty());
    }

    #[test]
    fn the_last_item_is_begun_first() {
        let begun = Mutex::new(Vec::new());
        on(1, (0..3).enumerate().rev(), |k| begun.lock().unwrap().push(k));
        assert_eq!(begun.into_inner().unwrap(), [2, 1, 0]);
    }
}
