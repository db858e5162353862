//! The cell grid that particles are sorted into.

use super::box_geometry::BoxGeometry;

/// Number of cells along x in one cutoff.
const CELLS_PER_CUTOFF: f64 = 4.0;

/// Below this number of particles per cutoff along a column of cells, i-clusters have eight particles, else
/// four: the cell ranges of eight then are still about sixteen particles long, the size of a j-cluster.
pub const SPARSE: f64 = 4.5;

/// Columns along x, at least as wide as the cutoff, each divided into cells.
///
/// In three dimensions a plane is a sheet of columns along y, and planes follow each other along z. In
/// two dimensions a plane is one column, and planes follow each other along y. A particle pairs with
/// later particles in its column, with the next column of its plane, and with three columns of the next
/// plane: half of its neighbourhood, so that every pair is found once.
#[derive(Debug, Clone, Copy, Default)]
pub struct CellGrid {
    pub cells_per_column: usize,
    pub columns_per_plane: usize,
    pub planes: usize,
    /// The axis along which the columns of a plane follow each other.
    pub column_axis: usize,
    /// The axis along which planes follow each other.
    pub plane_axis: usize,
    /// Largest distance of the pair search: the cutoff plus room for rounding errors.
    pub search_cutoff: f64,
    /// The search cutoff along x, as a fraction of the box.
    pub range_half_width: f64,
    /// 2 if there are ghosts, which are in cells of their own: those of a plane follow its other cells. Else 1.
    pub layers: usize,
    /// Cells along x, from the first to one past the last, that have ghosts only in columns beside or above the owned
    /// particles: elsewhere ghosts are beyond the ends of these. Any range is right, and this one makes the search fast.
    pub interior: [usize; 2],
    /// Particles of an i-cluster.
    pub i_cluster_size: usize,
    /// Most cells between the first and the last particle of an i-cluster.
    pub i_cluster_extent: f64,
}

/// Coordinates are in single precision, relative to the box: the search distance grows by this fraction of the cutoff and of
/// the box's extent.
const ROUNDING: f64 = 1e-6;

/// Cutoffs whose squares, and those of boxes of [`MOST_CUTOFFS`], are far from the ends of single precision.
const CUTOFFS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Largest extent of a box, in cutoffs.
const MOST_CUTOFFS: f64 = 1e12;

impl CellGrid {
    /// The largest cutoff that fits into a box of this height and [`BoxGeometry::extent`].
    pub fn cutoff_within(height: f64, extent: f64) -> f64 {
        (0.5 * height * (1.0 - 1e-12) - ROUNDING * extent) / (1.0 + ROUNDING)
    }

    /// The grid for `count` particles; `None` if the box is so narrow along a period that a
    /// particle is near two images of another, or so long that single precision ends.
    pub fn new(geometry: &BoxGeometry, cutoff: f64, count: usize) -> Option<CellGrid> {
        CellGrid::with_cells(geometry, cutoff, count, 4 * count + 64)
    }

    /// As [`CellGrid::new`], with up to `most` cells.
    pub fn with_cells(geometry: &BoxGeometry, cutoff: f64, count: usize, most: usize) -> Option<CellGrid> {
        let (column_axis, plane_axis) = if geometry.dimensions == 3 { (1, 2) } else { (2, 1) };
        let extent = geometry.extent();
        let search_cutoff = cutoff + ROUNDING * (cutoff + extent);
        // Comparisons with NaN are false.
        let is_wide = |k: usize| !geometry.periodic[k] || geometry.height(k) >= 2.0 * search_cutoff;
        let fits = CUTOFFS.contains(&cutoff) && extent <= MOST_CUTOFFS * cutoff;
        if !(fits && (0..geometry.dimensions).all(is_wide)) {
            return None;
        }
        let most = most as f64;
        // The width is that of the cutoff minus rounding: pairs in the last 10⁻⁹ of the cutoff may be missed.
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
            // The loop widens the cells until they barely outnumber the particles: a few distant
            // particles must not cause a grid of empty cells.
            if columns_per_plane * planes * cells_per_column <= most.max(64.0 * CELLS_PER_CUTOFF) {
                let (cells_per_column, columns_per_plane, planes) =
                    (cells_per_column as usize, columns_per_plane as usize, planes as usize);
                let range_half_width = search_cutoff / geometry.height(0);
                let per_column = count as f64 / (columns_per_plane * planes) as f64;
                let is_sparse = per_column * cutoff / geometry.height(0) < SPARSE;
                let (i_cluster_size, i_cluster_extent) =
                    if is_sparse { (8, 4.0 * CELLS_PER_CUTOFF) } else { (4, CELLS_PER_CUTOFF) };
                return Some(CellGrid {
                    cells_per_column,
                    columns_per_plane,
                    planes,
                    column_axis,
                    plane_axis,
                    search_cutoff,
                    range_half_width,
                    layers: 1,
                    interior: [0, cells_per_column],
                    i_cluster_size,
                    i_cluster_extent,
                });
            }
            width *= 1.5;
        }
    }

    /// Number of columns or planes along an axis.
    pub fn of(&self, axis: usize) -> usize {
        if axis == self.plane_axis { self.planes } else { self.columns_per_plane }
    }

    /// Number of cells of a plane, those of ghosts included.
    #[inline(always)]
    pub fn cells_per_plane(&self) -> usize {
        self.cells_per_column * self.columns_per_plane * self.layers
    }

    pub fn cell_count(&self) -> usize {
        self.cells_per_plane() * self.planes
    }

    /// Number of cells along each axis.
    pub fn along(&self) -> [u32; 3] {
        let mut along = [self.cells_per_column as u32; 3];
        (along[self.column_axis], along[self.plane_axis]) =
            (self.columns_per_plane as u32, self.planes as u32);
        along
    }

    /// Difference between the numbers of neighbouring cells along each axis.
    pub fn steps(&self) -> [u32; 3] {
        let mut steps = [1; 3];
        let column = self.cells_per_column as u32;
        (steps[self.column_axis], steps[self.plane_axis]) = (column, self.cells_per_plane() as u32);
        steps
    }
}
