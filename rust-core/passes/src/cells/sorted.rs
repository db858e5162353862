//! Positions in the order of cells.

use super::excluded::Excluded;
use crate::ground::box_geometry::BoxGeometry;
use crate::ground::cell_grid::CellGrid;
use crate::ground::fixed_point::FixedPoint16;
use crate::instruction_set::InstructionSet;
use psidpd_threads::SharedSlice;

/// Arrays that the pair search reads.
///
/// If the plane axis is periodic, copies of the particles of the first plane, moved by one period,
/// follow the last particle: they are the plane after the last. `SortedParticles::make_room` pads all
/// arrays behind the last particle, so that whole vectors can be read there.
#[derive(Clone, Copy)]
pub struct SortedCells<'a> {
    /// The instruction set of the search.
    pub set: InstructionSet,
    pub geometry: &'a BoxGeometry,
    pub grid: &'a CellGrid,
    /// Index of the first particle of each cell, and one past the last particle; then the same
    /// for the copy of the first plane. In each plane the cells of ghosts, if there are any, follow the others.
    pub start: &'a [u32],
    /// Positions relative to the origin of the box geometry.
    pub x: [SharedSlice<'a, f32>; 3],
    /// Positions in 16-bit fixed point.
    pub fixed16: [SharedSlice<'a, u16>; 3],
    pub fixed16_scale: FixedPoint16,
    pub excluded: Excluded<'a>,
}

impl SortedCells<'_> {
    /// Number of the first cell of a column; the cells of its owned particles come first in their plane.
    #[inline(always)]
    pub fn first_cell(&self, plane: usize, column: usize) -> usize {
        plane * self.grid.cells_per_plane() + column * self.grid.cells_per_column
    }

    /// Number of the first cell of a column's ghosts, where there are ghosts.
    #[inline(always)]
    pub fn first_ghost_cell(&self, plane: usize, column: usize) -> usize {
        self.first_cell(plane, self.grid.columns_per_plane + column)
    }

    /// The owned particles of a column: index of the first, and one past the last.
    ///
    /// # Safety
    /// The column is one of the grid.
    #[inline(always)]
    pub unsafe fn column(&self, plane: usize, column: usize) -> [usize; 2] {
        let cell = self.first_cell(plane, column);
        // SAFETY: sorting gives `start` an entry for each cell and one more; the caller promises a column of the grid.
        unsafe {
            let end = *self.start.get_unchecked(cell + self.grid.cells_per_column);
            [*self.start.get_unchecked(cell) as usize, end as usize]
        }
    }
}
