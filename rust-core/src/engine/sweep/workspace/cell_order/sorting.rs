//! The stages of the sort, with the part of each thread: some of the particles, and some of the cells.

use super::count::{Count, CountRange, NO_CELL};
use crate::engine::error::EngineError;
use crate::engine::vectors;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_threads::{SharedSlice, part};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the threads share.
pub struct Sorting<'a> {
    pub count: Count<'a>,
    pub threads: usize,
    pub cells: usize,
    /// Number of particles of each cell, for each thread; then the place of the thread's next particle in the cell.
    pub counts: SharedSlice<'a, u32>,
    /// For each thread the sums of its counts over the part of each thread.
    pub sums: SharedSlice<'a, u32>,
    pub order: SharedSlice<'a, u32>,
    /// Whether a particle cannot be sorted: later stages do nothing, as cells and counts are incomplete.
    pub failed: AtomicBool,
}

/// The part of one thread.
pub struct SortPart<'a> {
    pub number: usize,
    /// The particles of a part, their cells and fractions.
    pub particles: Range<usize>,
    pub cell: &'a mut [u32],
    pub fixed32: &'a mut [[u32; 3]],
    /// For each of its cells one past the last particle.
    pub ends: &'a mut [u32],
    pub done: Result<(), EngineError>,
}

impl Sorting<'_> {
    fn part_of_cells(&self, number: usize) -> Range<usize> {
        part(self.cells, number, self.threads)
    }

    /// Computes the cell of each particle, and for each thread the number of its particles in each cell.
    ///
    /// # Safety
    /// Other threads do the same for other parts, and nothing else.
    pub unsafe fn count(&self, set: InstructionSet, part: &mut SortPart) {
        let (cells, threads) = (self.cells, self.threads);
        // SAFETY: a thread has as many counts as there are cells, and as many sums as there are threads.
        let (counts, sums) = unsafe {
            let counts = self.counts.slice_mut(cells * part.number..cells * (part.number + 1));
            (counts, self.sums.slice_mut(threads * part.number..threads * (part.number + 1)))
        };
        let (count, particles, all) = (&self.count, part.particles.clone(), &mut *counts);
        let (cell, fixed32) = (&mut *part.cell, &mut *part.fixed32);
        part.done = match self.count.fractions.is_open {
            true => vectors::run(set, CountRange::<true> { count, particles, cell, fixed32, counts: all }),
            false => vectors::run(set, CountRange::<false> { count, particles, cell, fixed32, counts: all }),
        };
        if part.done.is_err() {
            self.failed.store(true, Ordering::Relaxed);
            return;
        }
        for (number, sum) in sums.iter_mut().enumerate() {
            *sum = counts[self.part_of_cells(number)].iter().sum();
        }
    }

    /// Turns counts into the place of each thread's first particle in a cell: the particles of the parts before this one,
    /// then of the cells before, then of the threads before.
    ///
    /// # Safety
    /// [`Sorting::count`] is done with all parts; other threads do the same for other parts, and nothing else.
    pub unsafe fn sum(&self, part: &mut SortPart) {
        if self.failed.load(Ordering::Relaxed) {
            return;
        }
        let cells = self.part_of_cells(part.number);
        // SAFETY: no thread writes sums in this stage.
        let sums = unsafe { self.sums.slice(0..self.sums.len()) };
        let of_thread = |t: usize| {
            // SAFETY: each cell is in the part of one thread, and a thread has as many counts as there are cells.
            unsafe { self.counts.slice_mut(self.cells * t + cells.start..self.cells * t + cells.end) }
        };
        let ends = &mut *part.ends;
        if self.threads == 1 {
            let mut next = 0;
            for (end, count) in ends.iter_mut().zip(of_thread(0)) {
                next += std::mem::replace(count, next);
                *end = next;
            }
            return;
        }
        ends.copy_from_slice(of_thread(0));
        for t in 1..self.threads {
            ends.iter_mut().zip(of_thread(t)).for_each(|(end, count)| *end += *count);
        }
        let mut next = sums.chunks_exact(self.threads).flat_map(|sums| &sums[..part.number]).sum();
        // The array first has the number of particles in each cell, then its start, and last its end,
        // which is the start of the next.
        for end in ends.iter_mut() {
            next += std::mem::replace(end, next);
        }
        for t in 0..self.threads {
            for (end, count) in ends.iter_mut().zip(of_thread(t)) {
                *end += std::mem::replace(count, *end);
            }
        }
    }

    /// Writes the order of the particles.
    ///
    /// # Safety
    /// [`Sorting::sum`] is done with all parts; other threads do the same for other parts, and nothing else.
    pub unsafe fn write(&self, part: &mut SortPart) {
        if self.failed.load(Ordering::Relaxed) {
            return;
        }
        // SAFETY: these are the thread's own counts.
        let places =
            unsafe { self.counts.slice_mut(self.cells * part.number..self.cells * (part.number + 1)) };
        for (k, to) in part.particles.clone().zip(&*part.cell) {
            if *to == NO_CELL {
                continue;
            }
            // SAFETY: `CountRange` gives all other particles a cell of the grid. Each thread has as many places
            // in a cell as it has counted particles there, beginning where `sum` says, so that no two
            // particles have the same place, and all places are below the number of particles.
            unsafe {
                let next = places.get_unchecked_mut(*to as usize);
                *self.order.at(*next as usize) = k as u32;
                *next += 1;
            }
        }
    }
}
