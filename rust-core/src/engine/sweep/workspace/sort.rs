//! Particles into the order of cells.

mod count;
mod extremes;
mod fill;
mod fractions;

use super::{Input, SharedArrays, SharedPtr, VECTOR_PADDING, Workspace};
use crate::engine::error::EngineError;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::cell_grid::CellGrid;
use crate::engine::sweep::ground::fixed_point::FixedPoint16;
use crate::engine::sweep::ground::pass_data::OwnedOfColumn;
use crate::engine::sweep::many_body::in_range_pairs::J_CODE_BITS;
use crate::engine::sweep::pool::{Pool, part};
use crate::engine::tally::Tally;
use crate::engine::vectors;
use count::{Count, CountRange};
use extremes::FindExtremes;
use fill::{Fill, FillRange};
use fractions::Fractions;
use std::ops::Range;

impl<P: Compiled> Workspace<P> {
    /// The extremes of the positions of owned particles.
    pub fn extremes(&mut self, pool: &Pool, input: &Input) -> Result<([f64; 3], [f64; 3]), EngineError> {
        let threads = pool.threads();
        let scratch = SharedPtr(self.scratch.as_mut_ptr());
        pool.run(&|t| {
            // SAFETY: each thread has its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            let extremes_of_thread =
                FindExtremes { input, particles: part(input.particles.owned, t, threads) };
            scratch.fault = None;
            match vectors::run(self.instructions, extremes_of_thread) {
                Ok(extremes_of_thread) => [scratch.low, scratch.high] = extremes_of_thread,
                Err(fault) => scratch.fault = Some(fault),
            }
        });
        self.first_fault()?;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for scratch in &self.scratch {
            for c in 0..3 {
                low[c] = low[c].min(scratch.low[c]);
                high[c] = high[c].max(scratch.high[c]);
            }
        }
        if low[0] > high[0] { Ok(([0.0; 3], [0.0; 3])) } else { Ok((low, high)) }
    }

    /// The particles in the order of the cells of `grid`, and room for them in the arrays.
    pub fn sort_into_cells(
        &mut self,
        pool: &Pool,
        geometry: BoxGeometry,
        grid: CellGrid,
        input: &Input,
    ) -> Result<(), EngineError> {
        (self.geometry, self.grid) = (geometry, grid);
        self.fixed16_scale = FixedPoint16::new(&geometry, &grid);
        let (threads, cells) = (pool.threads(), grid.cell_count());
        let all = input.particles.x.len();
        (self.all, self.owned) = (all, input.particles.owned);
        (self.thermostat, self.totals) = (input.thermostat, input.totals);
        self.cell.resize(all, 0);
        self.fixed32.resize(all, [0; 3]);
        self.counts.resize(threads * cells, 0);
        self.count(pool, input)?;
        self.sum_counts(threads);
        let crowded = |plane| (self.plane(plane).1 + self.next_plane(plane)) >> J_CODE_BITS > 0;
        if (0..grid.planes).any(crowded) {
            return Err(EngineError::Host("2^25 particles or more in two planes next to each other"));
        }
        self.write_order(pool);
        self.make_room(input);
        self.find_owned_ranges();
        self.tallies.clear();
        self.tallies.resize(grid.planes, Tally::default());
        Ok(())
    }

    /// The cell of each particle, and how many of each thread's particles are in each.
    fn count(&mut self, pool: &Pool, input: &Input) -> Result<(), EngineError> {
        let (threads, cells) = (pool.threads(), self.grid.cell_count());
        let count = Count {
            input,
            geometry: &self.geometry,
            fractions: Fractions::new(&self.geometry, &self.grid),
            first_kind: Count::first_kind(input),
            cell: SharedPtr(self.cell.as_mut_ptr()),
            fixed32: SharedPtr(self.fixed32.as_mut_ptr()),
        };
        let (counts, scratch) = (SharedPtr(self.counts.as_mut_ptr()), SharedPtr(self.scratch.as_mut_ptr()));
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, counts and part of the particles.
            unsafe {
                let counts = std::slice::from_raw_parts_mut(counts.at(t * cells), cells);
                let particles = part(input.particles.x.len(), t, threads);
                let some = CountRange { count: &count, particles, counts };
                (*scratch.at(t)).fault = vectors::run(self.instructions, some).err();
            }
        });
        self.first_fault()
    }

    /// Turns counts into where each thread's particles of a cell begin.
    fn sum_counts(&mut self, threads: usize) {
        let cells = self.grid.cell_count();
        let per_plane = self.grid.columns_per_plane * self.grid.cells_per_column;
        self.start.resize(cells + 1 + if self.is_plane_axis_periodic() { per_plane } else { 0 }, 0);
        let [first, rest @ ..] = &mut self.start[..] else { return };
        *first = 0;
        // How many there are in each cell, then where it begins, and last where it ends: the beginning of the next.
        let ends = &mut rest[..cells];
        ends.copy_from_slice(&self.counts[..cells]);
        for counts in self.counts[..threads * cells].chunks_exact(cells).skip(1) {
            for (end, count) in ends.iter_mut().zip(counts) {
                *end += count;
            }
        }
        let mut sum = 0;
        for end in &mut *ends {
            let many = *end;
            *end = sum;
            sum += many;
        }
        for counts in self.counts[..threads * cells].chunks_exact_mut(cells) {
            for (end, count) in ends.iter_mut().zip(counts) {
                let many = *count;
                *count = *end;
                *end += many;
            }
        }
        self.particles = sum as usize;
        // The copy of the first plane.
        for cell in cells + 1..self.start.len() {
            self.start[cell] = sum + self.start[cell - cells];
        }
    }

    /// The particles in the order of cells: within one in the order of their numbers.
    fn write_order(&mut self, pool: &Pool) {
        let (threads, cells) = (pool.threads(), self.grid.cell_count());
        self.order.resize(self.particles, 0);
        let (cell, all) = (&self.cell, self.all);
        let (order, counts) = (SharedPtr(self.order.as_mut_ptr()), SharedPtr(self.counts.as_mut_ptr()));
        pool.run(&|t| {
            // SAFETY: counts are this thread's own; every particle has a place of its own.
            unsafe {
                let counts = std::slice::from_raw_parts_mut(counts.at(t * cells), cells);
                for k in part(all, t, threads) {
                    let to = *cell.get_unchecked(k);
                    if to == NO_CELL {
                        continue;
                    }
                    let write_order = counts.get_unchecked_mut(to as usize);
                    *order.at(*write_order as usize) = k as u32;
                    *write_order += 1;
                }
            }
        });
    }

    /// Room for the particles and the copies of the first plane.
    fn make_room(&mut self, input: &Input) {
        let copies = if self.is_plane_axis_periodic() { self.plane(0).1 } else { 0 };
        let total = self.particles + copies;
        let with_ghosts = input.particles.owned < input.particles.x.len();
        let multispecies = self.terms.species > 1;
        for x in &mut self.x {
            x.resize(total + VECTOR_PADDING, 0.0);
        }
        // A j-cluster of sixteen, and one that is not used, may begin behind the last.
        for fixed16 in &mut self.fixed16 {
            fixed16.resize(total + 4 * VECTOR_PADDING, 0);
        }
        self.packed.resize(total + VECTOR_PADDING, P::PackedParticle::default());
        self.species.resize(if multispecies { total.max(1) } else { 0 }, 0);
        self.ghost.resize(if with_ghosts { (total + VECTOR_PADDING).next_multiple_of(8) } else { 0 }, false);
    }

    /// Fills some places of the arrays: from a multiple of [`VECTOR_PADDING`] on, and up to one, or to the last.
    ///
    /// # Safety
    /// No other thread fills them, nor reads them meanwhile; behind the last whole vectors are written.
    pub(super) unsafe fn fill_sorted_range(
        &self,
        arrays: SharedArrays<P>,
        input: &Input,
        sorted_range: Range<usize>,
    ) {
        let multispecies = self.terms.species > 1;
        let fill = &Fill {
            input,
            geometry: &self.geometry,
            fixed16_scale: self.fixed16_scale,
            order: &self.order,
            fixed32: &self.fixed32,
            x: arrays.x,
            fixed16: arrays.fixed16,
            packed: arrays.packed,
            species: multispecies.then_some(arrays.species),
            prefetches: self.exceeds_cache(),
        };
        let instructions = self.instructions;
        match (input.thermostat.is_some(), multispecies) {
            (true, true) => vectors::run(instructions, FillRange::<_, true, true> { fill, sorted_range }),
            (true, false) => vectors::run(instructions, FillRange::<_, true, false> { fill, sorted_range }),
            (false, true) => vectors::run(instructions, FillRange::<_, false, true> { fill, sorted_range }),
            (false, false) => vectors::run(instructions, FillRange::<_, false, false> { fill, sorted_range }),
        }
    }

    /// Who is a ghost, and the owned particles of each column, those of copies too, if there are ghosts.
    fn find_owned_ranges(&mut self) {
        self.owned_of_column.clear();
        self.owned_bits.clear();
        if self.ghost.is_empty() {
            return;
        }
        for (ghost, k) in self.ghost.iter_mut().zip(&self.order) {
            *ghost = *k as usize >= self.owned;
        }
        if self.is_plane_axis_periodic() {
            let (_, copies) = self.plane(0);
            self.ghost.copy_within(..copies, self.particles);
        }
        self.owned_bits.extend(self.ghost.as_chunks::<8>().0.iter().map(bits_of_owned));
        self.owned_bits.resize(self.owned_bits.len() + VECTOR_PADDING, 0);
        let cells_per_column = self.grid.cells_per_column;
        for column in 0..(self.start.len() - 1) / cells_per_column {
            let (first, end) = (
                self.start[column * cells_per_column] as usize,
                self.start[(column + 1) * cells_per_column] as usize,
            );
            let ghosts = &self.ghost[first..end];
            let mut owned = OwnedOfColumn { range: [0; 2], with_ghosts: ghosts.contains(&true) };
            if let Some(a) = ghosts.iter().position(|g| !*g) {
                let b = ghosts.iter().rposition(|g| !*g).unwrap_or(a);
                owned.range = [first + a, first + b + 1].map(|at| at as u32);
            }
            self.owned_of_column.push(owned);
        }
    }

    /// Copies of the first plane behind the last, one period further.
    pub(super) fn copy_first_plane(&mut self) {
        if !self.is_plane_axis_periodic() {
            return;
        }
        let (n, copies) = (self.particles, self.plane(0).1);
        let edge = self.geometry.edge(self.grid.plane_axis);
        for c in 0..3 {
            let shift = (edge[c] * self.fixed16_scale.per_length).round() as i64 as u16;
            for k in 0..copies {
                self.x[c][n + k] = (self.x[c][k] as f64 + edge[c]) as f32;
                self.fixed16[c][n + k] = self.fixed16[c][k].wrapping_add(shift);
            }
        }
        self.packed.copy_within(..copies, n);
        if !self.species.is_empty() {
            self.species.copy_within(..copies, n);
        }
    }
}

/// A bit for each of eight particles that is not a ghost.
#[inline(always)]
fn bits_of_owned(ghosts: &[bool; 8]) -> u8 {
    // The product has the lowest bit of each byte next to each other at its top.
    let bytes = u64::from_le_bytes(ghosts.map(u8::from));
    !(bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// The cell of particles that take no part.
const NO_CELL: u32 = u32::MAX;

const TWO_TO_32: f64 = 4_294_967_296.0;

/// Far below what a whole number in the low bits of a double holds.
const FAR: f64 = 1e15;

#[cfg(test)]
mod tests;
