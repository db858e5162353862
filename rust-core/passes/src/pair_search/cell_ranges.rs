//! The cells in which an i-particle searches partners: those within the cutoff sphere, column by column.

use super::clusters::SEARCH_GROUP;
use crate::cells::sorted::SortedCells;
use crate::ground::box_geometry::BoxGeometry;
use crate::simd::{Isa, Reals};
use psidpd_model::kernel::Real;

/// Number of columns of the half stencil: the particle's own, the next of its plane, and three of the next plane.
pub const HALF: usize = 5;

/// Number of columns of the whole stencil.
pub const WHOLE: usize = 9;

/// The columns of the stencil, by their distances in columns and in planes from the particle's own. The first five are
/// the half stencil.
const NEIGHBOURS: [[i64; 2]; WHOLE] =
    [[0, 0], [1, 0], [-1, 1], [0, 1], [1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

/// The columns in which particles of one column search: with `COLUMNS` = [`HALF`] their partners among the owned
/// particles, each pair once; with [`WHOLE`] among the ghosts.
pub struct StencilColumns<const COLUMNS: usize> {
    /// The number of the particle's own column in its plane.
    number: usize,
    /// For each column a pointer to the array of its cells' first particles.
    pub start: [*const u32; COLUMNS],
    /// 1 for columns that exist, 0 for those beyond an open side.
    present: [f32; COLUMNS],
    /// Periodic shift of positions for each column, in the previous, the same and the next period along x.
    pub shift: [[[u32; 3]; COLUMNS]; 3],
    /// Whether a column lies across a period in the direction of `column_axis`, or of `plane_axis` below the first plane
    /// or, for ghosts, above the last.
    pub wraps: bool,
}

impl<const COLUMNS: usize> StencilColumns<COLUMNS> {
    pub fn new(
        cells: &SortedCells,
        search: &PlaneSearch,
        plane: usize,
        column: usize,
    ) -> StencilColumns<COLUMNS> {
        let (geometry, grid) = (cells.geometry, cells.grid);
        let of_ghosts = COLUMNS == WHOLE;
        let first_cell = |plane: usize, column: usize| match of_ghosts {
            true => cells.first_ghost_cell(plane, column),
            false => cells.first_cell(plane, column),
        };
        let own = &cells.start[first_cell(plane, column)..];
        let mut stencil = StencilColumns {
            number: column,
            start: [own.as_ptr(); COLUMNS],
            present: [0.0; COLUMNS],
            shift: [[[0; 3]; COLUMNS]; 3],
            wraps: false,
        };
        let (columns, planes) = (grid.columns_per_plane as i64, grid.planes as i64);
        for (w, [across, up]) in NEIGHBOURS.into_iter().take(COLUMNS).enumerate() {
            let (mut to, mut above) = (column as i64 + across, plane as i64 + up);
            let (mut wrap, mut turn) = (0, 0);
            let mut present = true;
            if to < 0 || to >= columns {
                // In two dimensions a plane is one column and has no neighbours beside it.
                present = geometry.periodic[grid.column_axis] && geometry.dimensions == 3;
                wrap = to.div_euclid(columns);
                to = to.rem_euclid(columns);
            }
            if above < 0 || above >= planes {
                present &= geometry.periodic[grid.plane_axis];
                // For owned particles the next plane may be the copy of the first plane.
                if of_ghosts {
                    turn = above.div_euclid(planes);
                    above = above.rem_euclid(planes);
                }
            }
            if !present {
                continue;
            }
            stencil.present[w] = 1.0;
            stencil.wraps |= (wrap | turn) != 0;
            stencil.start[w] = cells.start[first_cell(above as usize, to as usize)..].as_ptr();
            if geometry.periodic[0] || (wrap | turn) != 0 {
                for period in 0..3 {
                    stencil.shift[period][w] = search.shift(wrap, period, turn);
                }
            }
        }
        stencil
    }

    /// The index of the periodic shift of column `w`, across `period - 1` periods along x.
    pub const fn shift_index(w: usize, period: usize) -> usize {
        w + COLUMNS * period
    }
}

impl StencilColumns<WHOLE> {
    /// The particles of the column that ghosts may be near: up to two ranges, one behind the other.
    ///
    /// # Safety
    /// The stencil is that of this column, and there are ghosts.
    pub unsafe fn near_ghosts(&self, cells: &SortedCells, plane: usize, column: usize) -> [[usize; 2]; 2] {
        let grid = cells.grid;
        let ([from, to], all) = (grid.interior, grid.cells_per_column);
        let mut ghosts = [0; 3];
        for (start, present) in self.start.iter().zip(self.present) {
            if present > 0.0 {
                // SAFETY: `start` has an entry for each cell of a column, and one more.
                let [a, b, c, d] = [0, from, to, all].map(|cell| unsafe { *start.add(cell) });
                ghosts = [ghosts[0] + b - a, ghosts[1] + c - b, ghosts[2] + d - c];
            }
        }
        let reach = (grid.range_half_width * all as f64).ceil() as usize;
        let (low, high) = (from + reach, to.saturating_sub(reach));
        let own = &cells.start[cells.first_cell(plane, column)..][..all + 1];
        let [first, end] = [own[0], own[all]].map(|place| place as usize);
        match ghosts {
            [0, 0, 0] => [[first, first]; 2],
            [a, 0, c] if low < high => [
                [first, if a > 0 { own[low] as usize } else { first }],
                [if c > 0 { own[high] as usize } else { end }, end],
            ],
            _ => [[first, end], [end, end]],
        }
    }
}

/// A cell for each stencil column and i-particle of a search group.
pub type CellIndices<const COLUMNS: usize> = [[i32; SEARCH_GROUP]; COLUMNS];

/// Cell ranges of a search group.
#[derive(Debug)]
pub struct CellRanges<const COLUMNS: usize> {
    /// Index of the first cell, and one past the last.
    pub low: CellIndices<COLUMNS>,
    pub end: CellIndices<COLUMNS>,
    /// Cells of ranges that cross a period along x: from `before` to the end of the column in the
    /// previous period, and from the beginning of the column to `after` in the next one.
    pub before: CellIndices<COLUMNS>,
    pub after: CellIndices<COLUMNS>,
}

impl<const COLUMNS: usize> Default for CellRanges<COLUMNS> {
    fn default() -> CellRanges<COLUMNS> {
        let none = [[0; SEARCH_GROUP]; COLUMNS];
        CellRanges { low: none, end: none, before: none, after: none }
    }
}

/// Properties of the cell ranges of a search group.
#[derive(Clone, Copy, Default)]
pub struct RangeFlags {
    /// Bits of the i-particles whose ranges continue in the previous, and in the next, period.
    pub before: u32,
    pub after: u32,
    /// Bits of the vectors of i-particles whose ranges are already merged over whole i-clusters.
    pub together: u32,
}

/// Up to [`SEARCH_GROUP`] i-particles of one column, with their cell ranges.
pub struct SearchGroup<'a, const COLUMNS: usize> {
    pub plane: &'a PlaneSearch,
    pub stencil: &'a StencilColumns<COLUMNS>,
    pub flags: RangeFlags,
    /// First i-particle.
    pub first: usize,
    pub count: usize,
}

/// Constants of the search in one plane.
pub struct PlaneSearch {
    cutoff_squared: f32,
    column_width: f32,
    /// Coordinates at which this plane and the next one begin.
    plane_edges: [f32; 2],
    /// The search cutoff along x, in cells.
    half_range: f32,
    cells_per_length: f32,
    periodic: bool,
    tilted: bool,
    pub cells_per_column: i32,
    /// Largest distance along x between particles of an i-cluster.
    pub i_cluster_extent: f32,
    /// Periodic shifts in 16-bit fixed point, repeated in both halves of a word: one period back, none
    /// and one ahead along `column_axis`, and for each of these the same along x.
    shift: [[[u32; 3]; 3]; 3],
    /// The shift of one period back and of one ahead along `plane_axis`, if there are ghosts.
    turn: [[u32; 3]; 2],
}

/// Adds both halves of words.
fn add_halves(a: u32, b: u32) -> u32 {
    0x1_0001 * u32::from((a as u16).wrapping_add(b as u16))
}

impl PlaneSearch {
    #[inline(always)]
    pub fn new(cells: &SortedCells, plane: usize) -> PlaneSearch {
        let (geometry, grid, scale) = (cells.geometry, cells.grid, cells.fixed16_scale);
        let plane_width = geometry.height(grid.plane_axis) / grid.planes as f64;
        let cells_per_length = grid.cells_per_column as f64 / geometry.length[0];
        PlaneSearch {
            cutoff_squared: (grid.search_cutoff * grid.search_cutoff) as f32,
            column_width: (geometry.height(grid.column_axis) / grid.columns_per_plane as f64) as f32,
            plane_edges: [plane, plane + 1].map(|plane| (plane as f64 * plane_width) as f32),
            half_range: (grid.range_half_width * grid.cells_per_column as f64) as f32,
            cells_per_length: cells_per_length as f32,
            periodic: geometry.periodic[0],
            tilted: geometry.is_tilted(),
            cells_per_column: grid.cells_per_column as i32,
            i_cluster_extent: (grid.i_cluster_extent * geometry.length[0] / grid.cells_per_column as f64)
                as f32,
            shift: [-1.0, 0.0, 1.0].map(|wrap| {
                [-geometry.length[0], 0.0, geometry.length[0]].map(|along| {
                    let [x, y, z] = geometry.edge(grid.column_axis).map(|e| wrap * e);
                    [x + along, y, z].map(|shift| 0x1_0001 * u32::from(scale.shift(shift)))
                })
            }),
            turn: match grid.layers {
                1 => [[0; 3]; 2],
                _ => [-1.0, 1.0].map(|turn| {
                    let edge = geometry.edge(grid.plane_axis);
                    edge.map(|e| 0x1_0001 * u32::from(scale.shift(turn * e)))
                }),
            },
        }
    }

    /// The shift across `wrap` periods along `column_axis`, `period - 1` along x, and `turn` along `plane_axis`.
    fn shift(&self, wrap: i64, period: usize, turn: i64) -> [u32; 3] {
        let in_plane = self.shift[(wrap + 1) as usize][period];
        if turn == 0 {
            return in_plane;
        }
        let turn = self.turn[(turn > 0) as usize];
        std::array::from_fn(|c| add_halves(in_plane[c], turn[c]))
    }

    /// Finds the cell ranges of `count` i-particles, beginning with `first`, in i-clusters of `CLUSTER`.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`. The particles are of one column of this plane, at
    /// most [`SEARCH_GROUP`] of them.
    #[inline(always)]
    pub unsafe fn cell_ranges<I: Isa, const CLUSTER: usize, const COLUMNS: usize>(
        &self,
        cells: &SortedCells,
        stencil: &StencilColumns<COLUMNS>,
        [first, count]: [usize; 2],
        out: &mut CellRanges<COLUMNS>,
    ) -> RangeFlags {
        // SAFETY: the caller promises the particles; vectors that reach beyond the last one are loaded from `lanes`.
        unsafe {
            let mut flags = RangeFlags::default();
            let mut at = 0;
            while at < count {
                let mut x = cells.x.map(|x| x.as_ptr().add(first + at));
                let left = count - at;
                let mut lanes = [[0.0; 16]; 3];
                if left < I::F32::LANES {
                    // The last particle fills the vector.
                    for c in 0..3 {
                        lanes[c] = [*x[c].add(left - 1); 16];
                        std::ptr::copy_nonoverlapping(x[c], lanes[c].as_mut_ptr(), left);
                        x[c] = lanes[c].as_ptr();
                    }
                }
                let x = [I::F32::load(x[0]), I::F32::load(x[1]), I::F32::load(x[2])];
                self.ranges_of_vector::<I, CLUSTER, COLUMNS>(cells, stencil, x, at, out, &mut flags);
                at += I::F32::LANES;
            }
            flags
        }
    }

    /// Finds the cell ranges of a vector of i-particles at `x`, `y`, `z`, which begins at member `at` of the group.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`. `at` is a multiple of the number of lanes, below [`SEARCH_GROUP`].
    #[inline(always)]
    unsafe fn ranges_of_vector<I: Isa, const CLUSTER: usize, const COLUMNS: usize>(
        &self,
        cells: &SortedCells,
        stencil: &StencilColumns<COLUMNS>,
        [x, y, z]: [I::F32; 3],
        at: usize,
        out: &mut CellRanges<COLUMNS>,
        flags: &mut RangeFlags,
    ) {
        // SAFETY: the number of lanes divides `SEARCH_GROUP`, so that a vector at `at` is inside the arrays of `out`.
        unsafe {
            let zero = I::F32::constant(0.0);
            let longest = I::F32::splat(self.half_range);
            let mut half_range = [longest; COLUMNS];
            let mut cell = x * I::F32::splat(self.cells_per_length);
            if self.tilted {
                cell = fraction_along::<I>(cells.geometry, x, y, z)
                    * I::F32::constant(self.cells_per_column as f64);
            } else {
                // The half range is half the extent of the cutoff sphere within each column.
                let (across, up) = if cells.grid.column_axis == 1 { (y, z) } else { (z, y) };
                let low_edge = I::F32::splat(stencil.number as f32 * self.column_width);
                let high_edge = I::F32::splat((stencil.number + 1) as f32 * self.column_width);
                let below = (across - low_edge).larger(zero);
                let above = (high_edge - across).larger(zero);
                let over = (I::F32::splat(self.plane_edges[1]) - up).larger(zero);
                let (below, above) = (below * below, above * above);
                let all = I::F32::splat(self.cutoff_squared);
                let left = all - over * over;
                let cells_per_length = I::F32::splat(self.cells_per_length);
                half_range[1] = I::root_or_more(all - above) * cells_per_length;
                half_range[2] = I::root_or_more(left - below) * cells_per_length;
                half_range[3] = I::root_or_more(left) * cells_per_length;
                half_range[4] = I::root_or_more(left - above) * cells_per_length;
                if COLUMNS == WHOLE {
                    let under = (up - I::F32::splat(self.plane_edges[0])).larger(zero);
                    let right = all - under * under;
                    half_range[5] = I::root_or_more(all - below) * cells_per_length;
                    half_range[6] = I::root_or_more(right - below) * cells_per_length;
                    half_range[7] = I::root_or_more(right) * cells_per_length;
                    half_range[8] = I::root_or_more(right - above) * cells_per_length;
                }
            }
            let most = I::F32::constant(self.cells_per_column as f64);
            let one = I::F32::constant(1.0);
            let [mut before, mut after] = [0; 2];
            if self.periodic {
                // The particle's own column has the longest range.
                before = (cell - half_range[0]).mask_below(zero);
                after = (most - one).mask_below(cell + half_range[0]);
            }
            // Ranges of i-clusters are merged here if all clusters of the vector are compact.
            let first = I::cluster_first::<CLUSTER>(x);
            let far = I::F32::splat(self.i_cluster_extent);
            let close = (x - first).mask_below(far) & (first - x).mask_below(far);
            let together = close.trailing_ones() as usize >= I::F32::LANES;
            let mut w = 0;
            while w < COLUMNS {
                // Missing columns get an empty range.
                let h = *half_range.get_unchecked(w) * I::F32::splat(*stencil.present.get_unchecked(w));
                let (mut low, mut end) = (cell - h, cell + h + one);
                end = end.where_below(zero, h);
                if together {
                    (low, end) = (I::cluster_least::<CLUSTER>(low), I::cluster_greatest::<CLUSTER>(end));
                }
                // All ends are limited to the cells of a column: no rounding error leads out of the arrays.
                if before != 0 {
                    let low = (low + most).larger(zero).smaller(most);
                    low.store_whole(out.before.get_unchecked_mut(w).as_mut_ptr().add(at));
                }
                if after != 0 {
                    let over = (end - most).larger(zero).smaller(most);
                    over.store_whole(out.after.get_unchecked_mut(w).as_mut_ptr().add(at));
                }
                let low = low.larger(zero).smaller(most);
                low.store_whole(out.low.get_unchecked_mut(w).as_mut_ptr().add(at));
                end.smaller(most).store_whole(out.end.get_unchecked_mut(w).as_mut_ptr().add(at));
                w += 1;
            }
            flags.before |= before << at;
            flags.after |= after << at;
            flags.together |= (together as u32) << (at / I::F32::LANES);
        }
    }
}

/// Fractional coordinates along the first edge.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
unsafe fn fraction_along<I: Isa>(geometry: &BoxGeometry, x: I::F32, y: I::F32, z: I::F32) -> I::F32 {
    let sz = if geometry.dimensions == 3 {
        z * I::F32::constant(1.0 / geometry.length[2])
    } else {
        I::F32::constant(0.0)
    };
    let sy = (y - I::F32::constant(geometry.tilt[2]) * sz) * I::F32::constant(1.0 / geometry.length[1]);
    let along = x - I::F32::constant(geometry.tilt[0]) * sy - I::F32::constant(geometry.tilt[1]) * sz;
    along * I::F32::constant(1.0 / geometry.length[0])
}
