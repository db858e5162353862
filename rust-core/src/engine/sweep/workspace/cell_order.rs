//! Sorts the particles in the order of cells.

mod count;
mod extremes;
mod fractions;
mod sorting;

use super::input::{Input, VECTOR_PADDING};
use crate::engine::error::EngineError;
use count::Count;
use fractions::Fractions;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::in_range_pairs::J_CODE_BITS;
use psidpd_threads::SharedSlice;
use psidpd_threads::{Pool, part, take};
use sorting::{SortPart, Sorting};
use std::ops::Range;
use std::sync::atomic::AtomicBool;

pub use extremes::extremes;
pub use fractions::TWO_TO_32;

/// Up to this number of particles all arrays stay in the cache, and nothing is prefetched; lowered in tests.
const PREFETCH_THRESHOLD: usize = if cfg!(test) { 100 } else { 1 << 14 };

/// The sorted index of particles that are left out.
pub const NOWHERE: u32 = u32::MAX;

/// The particles of each cell: in each plane owned particles come first, then ghosts. If planes are periodic, copies of
/// the first plane follow the last plane.
#[derive(Debug, Clone, Default)]
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
    /// For each thread the number of its particles in each thread's part of the cells.
    sums: Vec<u32>,
}

impl CellOrder {
    /// Sorts the particles into the cells of `grid`: by cell, and within a cell by the host's number. Ghosts are in cells of
    /// their own.
    pub fn sort(
        &mut self,
        pool: &Pool,
        set: InstructionSet,
        geometry: BoxGeometry,
        mut grid: CellGrid,
        input: &Input,
    ) -> Result<(), EngineError> {
        grid.layers = if input.has_ghosts() { 2 } else { 1 };
        (self.geometry, self.grid) = (geometry, grid);
        (self.all, self.owned) = (input.particles.x.len(), input.particles.owned);
        let (all, cells, threads) = (self.all, grid.cell_count(), pool.threads());
        self.cell.resize(all, 0);
        self.fixed32.resize(all, [0; 3]);
        self.counts.resize(threads * cells, 0);
        self.sums.resize(threads * threads, 0);
        self.start.resize(cells + 1 + if self.is_periodic() { grid.cells_per_plane() } else { 0 }, 0);
        self.start[0] = 0;
        self.order.resize(all, 0);
        let sorting = &Sorting {
            count: Count {
                input,
                geometry: &self.geometry,
                fractions: Fractions::new(&self.geometry, &self.grid),
                first_kind: Count::first_kind(input),
                to_ghosts: (grid.columns_per_plane * grid.cells_per_column) as u32,
            },
            threads,
            cells,
            counts: SharedSlice::new(&mut self.counts),
            sums: SharedSlice::new(&mut self.sums),
            order: SharedSlice::new(&mut self.order),
            failed: AtomicBool::new(false),
        };
        let (mut cell, mut fixed32, mut ends) =
            (&mut self.cell[..], &mut self.fixed32[..], &mut self.start[1..=cells]);
        let of_thread = |number: usize| {
            let particles = part(all, number, threads);
            SortPart {
                number,
                cell: take(&mut cell, particles.len()),
                fixed32: take(&mut fixed32, particles.len()),
                particles,
                ends: take(&mut ends, part(cells, number, threads).len()),
                done: Ok(()),
            }
        };
        let mut parts: Vec<_> = (0..threads).map(of_thread).collect();
        pool.in_stages(
            &mut parts,
            &[
                // SAFETY: the stages follow each other, each with every part.
                &|part| unsafe { sorting.count(set, part) },
                // SAFETY: all parts are counted when this stage begins.
                &|part| unsafe { sorting.sum(part) },
                // SAFETY: all parts are summed when this stage begins.
                &|part| unsafe { sorting.write(part) },
            ],
        );
        if let Err(fault) = parts.into_iter().try_for_each(|part| part.done) {
            self.order.clear();
            return Err(fault);
        }
        let particles = self.start[cells];
        self.order.truncate(particles as usize);
        // These are the cells of the copy of the first plane.
        for cell in cells + 1..self.start.len() {
            self.start[cell] = particles + self.start[cell - cells];
        }
        let crowded = |plane| (self.plane(plane).1 + self.next_plane(plane)) >> J_CODE_BITS > 0;
        if (0..grid.planes).any(crowded) {
            return Err(EngineError::Host("two neighbouring planes of cells contain 2^25 particles or more"));
        }
        if grid.layers > 1 && particles >> J_CODE_BITS > 0 {
            return Err(EngineError::Host("a rank has 2^25 particles and ghosts or more"));
        }
        Ok(())
    }

    /// Finds the sorted index of each of the host's particles; [`NOWHERE`] for those that are left out.
    pub fn find_places(&self, place: &mut Vec<u32>) {
        place.clear();
        place.resize(self.all, NOWHERE);
        for (sorted, k) in (0..).zip(&self.order) {
            place[*k as usize] = sorted;
        }
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
        self.start[plane * self.grid.cells_per_plane()] as usize
    }

    /// The ghosts of a plane.
    pub fn ghosts_of(&self, plane: usize) -> Range<usize> {
        let grid = &self.grid;
        let owned = plane * grid.cells_per_plane() + grid.columns_per_plane * grid.cells_per_column;
        self.start[owned] as usize..self.plane_start(plane + 1)
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
