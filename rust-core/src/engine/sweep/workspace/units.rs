//! The units of work: blocks of neighbouring columns of a plane. They are numbered along the columns of a plane,
//! and plane after plane, and depend on the grid alone.
//!
//! The pairs of a unit add to the particles of its own columns and of the next column, and in the next plane to
//! those of the same columns and of the columns on either side. The accumulators of a plane are in two sets, and
//! its units alternate between them: so no two units add to the same accumulator, and threads may divide the units
//! anywhere without any change of a sum. Only the seams, which are the columns at the ends of a unit, have sums in both sets.

use super::cell_order::CellOrder;
use psidpd_threads::part;
use std::ops::Range;

/// Fewest columns of a unit, unless the plane is a single unit. Units of five columns divide a box of twenty planes of
/// twenty columns by sixteen; more seams would cost a single thread more than a percent.
const FEWEST_COLUMNS: usize = 5;

/// A block of columns of a plane.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unit {
    pub plane: usize,
    /// Number of the unit in its plane.
    pub block: usize,
    pub columns: Range<usize>,
}

impl Unit {
    /// Number of the set of accumulators that the unit adds to.
    pub fn set(&self) -> usize {
        self.block % 2
    }
}

impl CellOrder {
    /// Number of units of each plane: one or an even number, so that the last and the first are in different sets.
    pub fn units_per_plane(&self) -> usize {
        ((self.grid.columns_per_plane / FEWEST_COLUMNS) & !1).max(1)
    }

    /// Number of units.
    pub fn units(&self) -> usize {
        self.grid.planes * self.units_per_plane()
    }

    /// The unit of this number.
    pub fn unit(&self, number: usize) -> Unit {
        let blocks = self.units_per_plane();
        let block = number % blocks;
        Unit { plane: number / blocks, block, columns: part(self.grid.columns_per_plane, block, blocks) }
    }

    /// The units of a plane that are among `units`.
    pub fn units_of(&self, plane: usize, units: &Range<usize>) -> Range<usize> {
        let blocks = self.units_per_plane();
        units.start.max(plane * blocks)..units.end.min((plane + 1) * blocks)
    }

    /// The planes that have units among `units`.
    pub fn planes_of(&self, units: &Range<usize>) -> Range<usize> {
        let blocks = self.units_per_plane();
        let first = units.start / blocks;
        if units.is_empty() { first..first } else { first..units.end.div_ceil(blocks) }
    }

    /// Whether ψ of a plane needs the first pass over `units` alone: they have all of this plane and of the previous one.
    pub fn has_densities(&self, units: &Range<usize>, plane: usize) -> bool {
        let blocks = self.units_per_plane();
        plane > 0 && (plane - 1) * blocks >= units.start && (plane + 1) * blocks <= units.end
    }

    /// Whether the second pass over a plane needs ψ of planes for which [`CellOrder::has_densities`] is true.
    pub fn has_slopes(&self, units: &Range<usize>, plane: usize) -> bool {
        self.has_densities(units, plane) && self.has_densities(units, plane + 1)
    }

    /// Whether the forces of a plane need the second pass over planes for which [`CellOrder::has_slopes`] is true.
    pub fn has_forces(&self, units: &Range<usize>, plane: usize) -> bool {
        self.has_slopes(units, plane) && self.has_slopes(units, plane - 1)
    }

    /// The particles of consecutive units; the ghosts of a plane follow its last unit.
    pub fn particles_of_units(&self, units: &Range<usize>) -> Range<usize> {
        let start = |number| {
            let unit = self.unit(number);
            self.column_start(unit.plane, unit.columns.start)
        };
        start(units.start)..start(units.end)
    }

    /// The owned particles of a unit.
    pub fn particles_of_unit(&self, unit: &Unit) -> Range<usize> {
        self.particles_in(unit.plane, unit.columns.clone())
    }

    /// The first particle of a column; that of the column after the last of a plane is the plane's first ghost, or the
    /// first of the next plane.
    fn column_start(&self, plane: usize, column: usize) -> usize {
        let grid = &self.grid;
        self.start[plane * grid.cells_per_plane() + column * grid.cells_per_column] as usize
    }

    /// The owned particles of columns of a plane, or of the copy of the first plane.
    fn particles_in(&self, plane: usize, columns: Range<usize>) -> Range<usize> {
        self.column_start(plane, columns.start)..self.column_start(plane, columns.end)
    }

    /// Whether the first column of a plane follows its last.
    fn wraps(&self) -> bool {
        self.geometry.periodic[self.grid.column_axis] && self.geometry.dimensions == 3
    }

    /// The particles that a unit's pairs add to.
    pub fn reached(&self, unit: &Unit) -> [Range<usize>; 4] {
        let (count, Range { start, end }) = (self.grid.columns_per_plane, unit.columns.clone());
        // A single unit reaches all columns anyway.
        let wraps = self.wraps() && self.units_per_plane() > 1;
        let (after, before) = (wraps && end == count, wraps && start == 0);
        let column = |plane, present, column| {
            if present { self.particles_in(plane, column..column + 1) } else { 0..0 }
        };
        let (plane, next) = (unit.plane, unit.plane + 1);
        let own = self.particles_in(plane, start..count.min(end + 1));
        let own_after = column(plane, after, 0);
        if next == self.grid.planes && !self.is_periodic() {
            return [own, own_after, 0..0, 0..0];
        }
        let ahead = self.particles_in(next, start.saturating_sub(1)..count.min(end + 1));
        let around = if before { column(next, true, count - 1) } else { column(next, after, 0) };
        [own, own_after, ahead, around]
    }

    /// The particles of a unit's first and last column, if another unit of the plane is next to that column.
    pub fn seams(&self, unit: &Unit) -> [Range<usize>; 2] {
        let (blocks, Range { start, end }) = (self.units_per_plane(), unit.columns.clone());
        let seam = |inside: bool, column| {
            let present = blocks > 1 && (inside || self.wraps());
            if present { self.particles_in(unit.plane, column..column + 1) } else { 0..0 }
        };
        [seam(unit.block > 0, start), seam(unit.block + 1 < blocks, end - 1)]
    }

    /// The units of each of `threads` threads, divided so that all have about the same number of pairs.
    pub fn thread_slabs(&self, threads: usize) -> Vec<Range<usize>> {
        let columns = self.grid.columns_per_plane * self.grid.planes;
        let mean = self.particles() as f64 / columns as f64;
        // A particle has a cost even without neighbours.
        let cost = |u: usize| {
            let particles = self.particles_of_unit(&self.unit(u)).len() as f64;
            particles * (particles / self.unit(u).columns.len() as f64 + 0.5 * mean)
        };
        let costs: Vec<f64> = (0..self.units()).map(cost).collect();
        let all: f64 = costs.iter().sum();
        let (mut before, mut first, mut u) = (0.0, 0, 0);
        let slab = |t: usize| {
            let end = all * (t + 1) as f64 / threads as f64;
            while u < costs.len() && (before + 0.5 * costs[u] < end || t + 1 == threads) {
                before += costs[u];
                u += 1;
            }
            std::mem::replace(&mut first, u)..u
        };
        (0..threads).map(slab).collect()
    }
}

#[cfg(test)]
mod tests;
