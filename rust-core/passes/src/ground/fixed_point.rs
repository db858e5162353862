//! 16-bit fixed-point coordinates for the distance filter. Rounding makes the filter pass too many pairs, never too few.

use super::box_geometry::BoxGeometry;
use super::cell_grid::CellGrid;

/// The unit of these coordinates, and the limit of the distance filter in this unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct FixedPoint16 {
    /// Units per length. Coordinates wrap; compared particles are less than half a turn apart.
    pub per_length: f64,
    /// A pair may be within the cutoff if the high halves of its squared coordinate differences sum to less than this.
    pub limit: i16,
}

impl FixedPoint16 {
    pub fn new(geometry: &BoxGeometry, grid: &CellGrid) -> FixedPoint16 {
        let cell = geometry.length[0] / grid.cells_per_column as f64;
        // The width of two neighbouring columns, or planes, as a fraction of the box.
        let two = |axis: usize| if axis < geometry.dimensions { 2.0 / grid.of(axis) as f64 } else { 0.0 };
        let [xy, xz, yz] = geometry.tilt.map(f64::abs);
        let (y, z) = (two(1), two(2));
        let furthest = [
            grid.range_half_width * geometry.length[0]
                + (2.0 + grid.i_cluster_extent) * cell
                + y * xy
                + z * xz,
            y * geometry.length[1] + z * yz,
            z * geometry.length[2],
        ];
        let furthest = furthest.into_iter().fold(0.0, f64::max);
        let per_length = 32_000.0 / furthest;
        // Two positions and a shift are rounded: a coordinate difference has an error of up to 1.5 units.
        let limit = grid.search_cutoff * per_length + 1.5 * 3f64.sqrt();
        FixedPoint16 { per_length, limit: ((limit * limit / 65_536.0) as i16).saturating_add(1) }
    }

    /// No pair that passes the filter is further apart than this along an axis. With wide cells, a unit is so large that
    /// this is much more than the cutoff.
    pub fn reach(&self) -> f64 {
        (256.0 * f64::from(self.limit).sqrt() + 2.0) / self.per_length
    }

    /// The lengths of the edges in units, if the edges are along the axes and the lengths fit into 31 bits. A
    /// fraction of the box times its edge is the coordinate, with an error below one unit plus half the fraction.
    pub fn edge_words(&self, geometry: &BoxGeometry) -> Option<[u32; 3]> {
        let words = geometry.length.map(|l| (l * self.per_length).round());
        let few = words.iter().all(|w| *w < 2_147_483_648.0);
        (few && !geometry.is_tilted()).then_some(words.map(|w| w as u32))
    }

    /// A periodic shift, rounded to the nearest unit.
    pub fn shift(&self, length: f64) -> u16 {
        (length * self.per_length).round() as i64 as u16
    }

    /// Converts a coordinate.
    #[inline(always)]
    pub fn coordinate(&self, x: f64) -> u16 {
        (x * self.per_length) as i64 as u16
    }
}
