//! Columns of cells: the cells that particles are sorted into.

use crate::engine::sweep::ground::box_geometry::BoxGeometry;

/// Columns along x with a cross-section no narrower than the cut-off, each divided into cells, columns in planes.
///
/// In three dimensions a plane is a sheet of columns that differ in y, and planes follow each other along z;
/// in two dimensions a plane is one column, and planes follow along y. A particle meets the rest of its
/// column, the next column of its plane, and three columns of the next plane: half of its neighbourhood.
#[derive(Debug, Clone, Copy)]
pub struct CellGrid {
    pub cells_per_column: usize,
    pub columns_per_plane: usize,
    pub planes: usize,
    /// The direction that columns of a plane, and planes, follow each other in.
    pub column_axis: usize,
    pub plane_axis: usize,
    /// The distance up to which pairs are looked for: the cut-off, and room for rounding.
    pub search_cutoff: f64,
    /// Half the width, in fractions of the box, of the window of a column.
    pub range_half_width: f64,
    /// How many particles of a column look together, and how many cells they are apart at most.
    pub i_cluster_size: usize,
    pub i_cluster_extent: f64,
}

/// Bins per cut-off.
const CELLS_PER_CUTOFF: f64 = 4.0;

/// In columns with fewer particles per cut-off eight look together, else four: cell ranges of eight still are about sixteen
/// particles long then.
const SPARSE_COLUMN: f64 = 4.5;

impl CellGrid {
    /// The grid for `count` particles; `None` where the box is too narrow along a period for particles
    /// to meet one image only of each other.
    pub fn new(geometry: &BoxGeometry, cutoff: f64, count: usize) -> Option<CellGrid> {
        let (column_axis, plane_axis) = if geometry.dimensions == 3 { (1, 2) } else { (2, 1) };
        let longest = geometry.length[..geometry.dimensions].iter().fold(0.0, |a: f64, b| a.max(*b));
        // Coordinates in single precision, relative to the box.
        let search_cutoff = cutoff + 1e-6 * (cutoff + longest);
        for k in 0..geometry.dimensions {
            if geometry.periodic[k] && geometry.height(k) < 2.0 * search_cutoff {
                return None;
            }
        }
        let most = (4 * count + 64) as f64;
        // No narrower than the cut-off, but for rounding: of pairs in the last part in 10⁹ of it some may be missed.
        let mut width = cutoff * (1.0 - 1e-9);
        loop {
            let along = |axis: usize, width: f64| {
                if axis < geometry.dimensions {
                    (geometry.height(axis) / width).floor().max(1.0)
                } else {
                    1.0
                }
            };
            let columns_per_plane = along(column_axis, width);
            let planes = along(plane_axis, width);
            let cells_per_column = along(0, width / CELLS_PER_CUTOFF);
            // A few runaways must not make a grid of empty cells.
            if columns_per_plane * planes * cells_per_column <= most.max(64.0 * CELLS_PER_CUTOFF) {
                let (cells_per_column, columns_per_plane, planes) =
                    (cells_per_column as usize, columns_per_plane as usize, planes as usize);
                let range_half_width = search_cutoff / geometry.height(0);
                let per_column = count as f64 / (columns_per_plane * planes) as f64;
                let (i_cluster_size, i_cluster_extent) =
                    match per_column * cutoff < SPARSE_COLUMN * geometry.height(0) {
                        true => (8, 4.0 * CELLS_PER_CUTOFF),
                        false => (4, CELLS_PER_CUTOFF),
                    };
                return Some(CellGrid {
                    cells_per_column,
                    columns_per_plane,
                    planes,
                    column_axis,
                    plane_axis,
                    search_cutoff,
                    range_half_width,
                    i_cluster_size,
                    i_cluster_extent,
                });
            }
            width *= 1.5;
        }
    }

    /// Columns of a plane, or planes, along an axis.
    pub fn of(&self, axis: usize) -> usize {
        if axis == self.plane_axis { self.planes } else { self.columns_per_plane }
    }

    pub fn cell_count(&self) -> usize {
        self.cells_per_column * self.columns_per_plane * self.planes
    }

    /// Cells along each direction.
    pub fn along(&self) -> [u32; 3] {
        let mut along = [self.cells_per_column as u32; 3];
        (along[self.column_axis], along[self.plane_axis]) =
            (self.columns_per_plane as u32, self.planes as u32);
        along
    }

    /// How far apart cells are that follow each other in each direction.
    pub fn steps(&self) -> [u32; 3] {
        let mut steps = [1; 3];
        let column = self.cells_per_column as u32;
        (steps[self.column_axis], steps[self.plane_axis]) = (column, column * self.columns_per_plane as u32);
        steps
    }
}
