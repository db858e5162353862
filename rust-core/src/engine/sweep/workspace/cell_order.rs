//! Sorts the particles in the order of cells.

mod count;
mod extremes;
mod fractions;

use super::input::{Input, VECTOR_PADDING};
use super::thread_slab::take;
use crate::engine::error::EngineError;
use crate::engine::vectors;
use count::{Count, CountRange, NO_CELL};
use fractions::Fractions;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::in_range_pairs::J_CODE_BITS;
use psidpd_threads::SharedSlice;
use psidpd_threads::{Pool, part};
use std::ops::Range;

pub use extremes::extremes;
pub use fractions::TWO_TO_32;

/// Up to this number of particles all arrays stay in the cache, and nothing is prefetched; lowered in tests.
const PREFETCH_THRESHOLD: usize = if cfg!(test) { 100 } else { 1 << 14 };

/// The particles of each cell. If planes are periodic, copies of the first plane follow the last plane.
#[derive(Clone)]
pub struct CellOrder {
    pub geometry: BoxGeometry,
    pub grid: CellGrid,
    /// Fractions of the box geometry of the host's particles, in units of 2⁻³².
    pub fixed32: Vec<[u32; 3]>,
    /// Index of the first particle of each cell, including the copies; the last entry is one past the last particle.
    pub start: Vec<u32>,
    /// The host's number of each sorted particle; each number occurs at most once.
    pub order: Vec<u32>,
    /// Number of the host's owned particles, and of all with ghosts.
    pub owned: usize,
    pub all: usize,
    /// Cell of each of the host's particles.
    cell: Vec<u32>,
    /// Number of particles of each cell: by thread while counting, then the start of each thread's particles.
    counts: Vec<u32>,
}

impl CellOrder {
    pub fn new(dimensions: usize) -> CellOrder {
        CellOrder {
            geometry: BoxGeometry::enclosing([0.0; 3], [1.0; 3], dimensions, 1.0),
            grid: CellGrid {
                cells_per_column: 1,
                columns_per_plane: 1,
                planes: 1,
                column_axis: 1,
                plane_axis: 2,
                search_cutoff: 1.0,
                range_half_width: 1.0,
                i_cluster_size: 4,
                i_cluster_extent: 1.0,
            },
            fixed32: Vec::new(),
            start: Vec::new(),
            order: Vec::new(),
            owned: 0,
            all: 0,
            cell: Vec::new(),
            counts: Vec::new(),
        }
    }

    /// Sorts the particles into the cells of `grid`.
    pub fn sort(
        &mut self,
        pool: &Pool,
        set: InstructionSet,
        geometry: BoxGeometry,
        grid: CellGrid,
        input: &Input,
    ) -> Result<(), EngineError> {
        (self.geometry, self.grid) = (geometry, grid);
        (self.all, self.owned) = (input.particles.x.len(), input.particles.owned);
        self.cell.resize(self.all, 0);
        self.fixed32.resize(self.all, [0; 3]);
        self.counts.resize(pool.threads() * grid.cell_count(), 0);
        self.count(pool, set, input)?;
        self.sum_counts(pool);
        let crowded = |plane| (self.plane(plane).1 + self.next_plane(plane)) >> J_CODE_BITS > 0;
        if (0..grid.planes).any(crowded) {
            return Err(EngineError::Host("two neighbouring planes of cells contain 2^25 particles or more"));
        }
        self.write_order(pool);
        Ok(())
    }

    /// Computes the cell of each particle, and for each thread the number of its particles in each cell.
    fn count(&mut self, pool: &Pool, set: InstructionSet, input: &Input) -> Result<(), EngineError> {
        let threads = pool.threads();
        let count = &Count {
            input,
            geometry: &self.geometry,
            fractions: Fractions::new(&self.geometry, &self.grid),
            first_kind: Count::first_kind(input),
        };
        let (mut cell, mut fixed32) = (&mut self.cell[..], &mut self.fixed32[..]);
        let parts = self.counts.chunks_exact_mut(self.grid.cell_count()).enumerate().map(|(t, counts)| {
            let particles = part(input.particles.x.len(), t, threads);
            let (of_thread, rest) = std::mem::take(&mut cell).split_at_mut(particles.len());
            cell = rest;
            let (units, rest) = std::mem::take(&mut fixed32).split_at_mut(particles.len());
            fixed32 = rest;
            (Some(CountRange { count, particles, cell: of_thread, fixed32: units, counts }), Ok(()))
        });
        let mut parts: Vec<_> = parts.collect();
        pool.each(&mut parts, |(range, done)| {
            if let Some(range) = range.take() {
                *done = vectors::run(set, range);
            }
        });
        parts.into_iter().try_for_each(|(_, done)| done)
    }

    /// Turns counts into the start of each thread's particles of a cell. Each thread does a part of the cells: it
    /// first counts their particles, and then knows how many there are before its part.
    fn sum_counts(&mut self, pool: &Pool) {
        let (cells, threads) = (self.grid.cell_count(), pool.threads());
        let per_plane = self.grid.columns_per_plane * self.grid.cells_per_column;
        self.start.resize(cells + 1 + if self.is_periodic() { per_plane } else { 0 }, 0);
        self.start[0] = 0;
        let (mut rest, counts) = (&mut self.start[1..=cells], SharedSlice::new(&mut self.counts));
        let of_part = |t: usize| (part(cells, t, threads), take(&mut rest, part(cells, t, threads).len()), 0);
        let mut parts: Vec<_> = (0..threads).map(of_part).collect();
        let of_thread = |t: usize, of_part: &Range<usize>| {
            // SAFETY: each cell is in the part of one thread, and a thread has as many counts as there are cells.
            unsafe { counts.slice_mut(cells * t + of_part.start..cells * t + of_part.end) }
        };
        pool.each(&mut parts, |(range, ends, sum)| {
            ends.copy_from_slice(of_thread(0, range));
            for t in 1..threads {
                let added = ends.iter_mut().zip(of_thread(t, range));
                added.for_each(|(end, count)| *end += *count);
            }
            *sum = ends.iter().sum();
        });
        let mut all = 0;
        for (_, _, sum) in &mut parts {
            all += std::mem::replace(sum, all);
        }
        // The array first has the number of particles in each cell, then its start, and last its end,
        // which is the start of the next.
        pool.each(&mut parts, |(range, ends, next)| {
            for end in ends.iter_mut() {
                *next += std::mem::replace(end, *next);
            }
            for t in 0..threads {
                for (end, count) in ends.iter_mut().zip(of_thread(t, range)) {
                    *end += std::mem::replace(count, *end);
                }
            }
        });
        self.order.resize(all as usize, 0);
        // These are the cells of the copy of the first plane.
        for cell in cells + 1..self.start.len() {
            self.start[cell] = all + self.start[cell - cells];
        }
    }

    /// Writes the order of the particles: by cell, and within a cell by the host's number.
    fn write_order(&mut self, pool: &Pool) {
        let (threads, all) = (pool.threads(), self.all);
        let mut cell = &self.cell[..];
        let order = SharedSlice::new(&mut self.order);
        let parts = self.counts.chunks_exact_mut(self.grid.cell_count()).enumerate().map(|(t, counts)| {
            let particles = part(all, t, threads);
            let (of_thread, rest) = cell.split_at(particles.len());
            cell = rest;
            (particles.start, of_thread, counts)
        });
        let mut parts: Vec<_> = parts.collect();
        pool.each(&mut parts, |(first, cell, counts)| {
            for (k, to) in (*first..).zip(*cell) {
                if *to == NO_CELL {
                    continue;
                }
                // SAFETY: `CountRange` gives all other particles a cell of the grid. Each thread has as many places
                // in a cell as it has counted particles there, beginning where `sum_counts` says, so that no two
                // particles have the same place, and all places are below the number of particles.
                unsafe {
                    let next = counts.get_unchecked_mut(*to as usize);
                    *order.at(*next as usize) = k as u32;
                    *next += 1;
                }
            }
        });
    }

    /// Number of particles.
    pub fn particles(&self) -> usize {
        self.order.len()
    }

    /// Number of copies of particles of the first plane.
    pub fn copies(&self) -> usize {
        if self.is_periodic() { self.plane(0).1 } else { 0 }
    }

    /// First particle of a plane, and its number of particles.
    pub fn plane(&self, plane: usize) -> (usize, usize) {
        let first = self.plane_start(plane);
        (first, self.plane_start(plane + 1) - first)
    }

    /// The first particle of a plane, or one past the last.
    pub fn plane_start(&self, plane: usize) -> usize {
        self.start[plane * self.grid.columns_per_plane * self.grid.cells_per_column] as usize
    }

    /// The range of particles of consecutive planes.
    pub fn particles_of(&self, planes: &Range<usize>) -> Range<usize> {
        self.plane_start(planes.start)..self.plane_start(planes.end)
    }

    /// Number of particles of the plane after `plane`.
    pub fn next_plane(&self, plane: usize) -> usize {
        if plane + 1 < self.grid.planes { self.plane(plane + 1).1 } else { self.copies() }
    }

    /// The range of indices that one of `threads` threads fills: from one whole vector to another, or to the last.
    pub fn whole_vectors(&self, thread: usize, threads: usize) -> Range<usize> {
        let vectors = part(self.particles().div_ceil(VECTOR_PADDING), thread, threads);
        vectors.start * VECTOR_PADDING..(vectors.end * VECTOR_PADDING).min(self.particles())
    }

    /// Whether the first plane follows the last: the plane axis is periodic.
    pub fn is_periodic(&self) -> bool {
        self.geometry.periodic[self.grid.plane_axis]
    }

    /// Whether arrays over all particles exceed the cache.
    pub fn exceeds_cache(&self) -> bool {
        self.all > PREFETCH_THRESHOLD
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        (self.cell.capacity() + self.counts.capacity() + self.start.capacity() + self.order.capacity())
            * size_of::<u32>()
            + self.fixed32.capacity() * size_of::<[u32; 3]>()
    }
}
