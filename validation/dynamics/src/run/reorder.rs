//! Sorts particles in memory by their cells: neighbours share the cache, and the engine reads and writes the
//! host's arrays almost sequentially.

use psidpd_core::engine::Pool;
use std::iter::Map;
use std::slice::Iter;

/// Steps between reorderings. In that time particles move about a third of the range of their forces, mostly
/// into a cell column that is still close in memory.
pub const INTERVAL: u64 = 32;

/// Whether particles are reordered at the end of a step. The answer depends on the step number only, so that a
/// resumed run reorders at the same steps. These numbers are odd, because observables usually sample at even ones.
pub(super) fn is_due(step: u64) -> bool {
    step % INTERVAL == 1
}

/// Converts a scratch vector back to integers.
type Whole = fn(&[f64; 3]) -> [i32; 3];

/// Permutes arrays through one scratch array.
#[derive(Debug)]
pub(super) struct Reordering<'a> {
    pub scratch: &'a mut Vec<[f64; 3]>,
}

impl Reordering<'_> {
    /// Moves vector `order[k]` to index `k`.
    pub fn vectors(&mut self, pool: &Pool, order: &[u32], vectors: &mut Vec<[f64; 3]>) {
        self.gather(pool, order, |k| vectors[k]);
        std::mem::swap(self.scratch, vectors);
    }

    /// Moves the three integers of particle `order[k]` to index `k`.
    pub fn numbers(
        &mut self,
        pool: &Pool,
        order: &[u32],
        get: impl Fn(usize) -> [i32; 3] + Sync,
    ) -> Map<Iter<'_, [f64; 3]>, Whole> {
        // A double holds every 32-bit integer exactly.
        self.gather(pool, order, |k| get(k).map(f64::from));
        self.scratch.iter().map(|numbers| numbers.map(|number| number as i32))
    }

    fn gather(&mut self, pool: &Pool, order: &[u32], get: impl Fn(usize) -> [f64; 3] + Sync) {
        self.scratch.resize(order.len(), [0.0; 3]);
        pool.parts(self.scratch, |first, to| {
            for (to, k) in to.iter_mut().zip(&order[first..]) {
                *to = get(*k as usize);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroUsize;

    #[test]
    fn arrays_are_gathered() {
        let order = [2, 0, 3, 1];
        for threads in [1, 3, 7] {
            let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
            let mut reordering = Reordering { scratch: &mut Vec::new() };
            let mut vectors: Vec<[f64; 3]> = (0..5).map(|k| [k as f64, 0.5, -1.0]).collect();
            reordering.vectors(&pool, &order, &mut vectors);
            assert_eq!(vectors, [2.0, 0.0, 3.0, 1.0].map(|k| [k, 0.5, -1.0]));
            let numbers = [[i32::MAX, 1, 2], [i32::MIN, 3, 4], [5, 6, 7], [8, 9, 10]];
            let found: Vec<_> = reordering.numbers(&pool, &order, |k| numbers[k]).collect();
            assert_eq!(found, order.map(|k| numbers[k as usize]));
        }
    }
}
