//! Positions in words of sixteen bits, for looking who is near: rounding only ever lets too many through.

use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::cell_grid::CellGrid;

/// The unit of such positions, and the limit of squared distances in them.
#[derive(Debug, Clone, Copy, Default)]
pub struct FixedPoint16 {
    /// Units per length. Words wrap, but no two particles that are compared are half a turn apart.
    pub per_length: f64,
    /// Sums of the high halves of squares below this may be within reach.
    pub limit: i16,
}

impl FixedPoint16 {
    pub fn new(geometry: &BoxGeometry, grid: &CellGrid) -> FixedPoint16 {
        let bin = geometry.length[0] / grid.cells_per_column as f64;
        // Two columns, or planes, next to each other.
        let two = |axis: usize| if axis < geometry.dimensions { 2.0 / grid.of(axis) as f64 } else { 0.0 };
        let [xy, xz, yz] = geometry.tilt.map(f64::abs);
        let (y, z) = (two(1), two(2));
        let furthest = [
            grid.range_half_width * geometry.length[0]
                + (2.0 + grid.i_cluster_extent) * bin
                + y * xy
                + z * xz,
            y * geometry.length[1] + z * yz,
            z * geometry.length[2],
        ];
        let furthest = furthest.into_iter().fold(0.0, f64::max);
        let per_length = 32_000.0 / furthest;
        // Each coordinate of a distance is off by up to one and a half: two positions and a shift are rounded.
        let reach = grid.search_cutoff * per_length + 1.5 * 3f64.sqrt();
        FixedPoint16 { per_length, limit: (reach * reach / 65_536.0) as i16 + 1 }
    }

    /// Words of each edge, if edges are along the axes and there are not too many: a coordinate then is the part of
    /// these that its fraction is, which is off by less than one, and by half the distance over the edge.
    pub fn edge_words(&self, geometry: &BoxGeometry) -> Option<[u32; 3]> {
        let words = geometry.length.map(|l| (l * self.per_length).round());
        let few = words.iter().all(|w| *w < 2_147_483_648.0);
        (few && !geometry.is_tilted()).then_some(words.map(|w| w as u32))
    }

    /// A distance between periods, to the nearest unit.
    pub fn shift(&self, length: f64) -> u16 {
        (length * self.per_length).round() as i64 as u16
    }

    /// A coordinate.
    ///
    /// # Safety
    /// It is finite, and within 2⁴⁰ cut-offs.
    #[inline(always)]
    pub unsafe fn coordinate(&self, x: f64) -> u16 {
        // SAFETY: units are no smaller than the 2¹⁴th part of the cut-off.
        unsafe { (x * self.per_length).to_int_unchecked::<i64>() as u16 }
    }
}
