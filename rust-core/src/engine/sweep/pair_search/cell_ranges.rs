//! Where a particle looks for others: in which columns, and there from which cell to which.

use crate::engine::sweep::ground::arithmetic::PackedParticle;
use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::pair_batch::buffers::SEARCH_GROUP;
use crate::engine::sweep::simd::{Isa, Reals, Scalar};
use crate::model::kernel::Real;

/// The columns around one: itself, the next of its plane, three of the next plane.
pub struct StencilColumns {
    /// Where the first particles of the cells of each are.
    pub column: [*const u32; 5],
    /// 1 for columns that are there, 0 for others.
    pub present: [f32; 5],
    /// Added to the positions of particles there, in the period before, the same, and the next: entry
    /// `w + 5 (wrap + 1)`.
    pub shift: [[u32; 3]; 15],
    /// Whether any shift of the same period is not zero.
    pub wraps: bool,
    /// The first owned particle of each, and one past the last.
    pub owned: [[u32; 2]; 5],
    /// Whether there are ghosts among those who look.
    pub with_ghosts: bool,
}

impl StencilColumns {
    pub fn new(
        data: &PassData<impl Scalar, impl PackedParticle>,
        plane_search: &PlaneSearch,
        plane: usize,
        column: usize,
    ) -> StencilColumns {
        let (geometry, grid) = (data.geometry, data.grid);
        let own = &data.start[(plane * grid.columns_per_plane + column) * grid.cells_per_column..];
        let mut stencil = StencilColumns {
            column: [own.as_ptr(); 5],
            present: [0.0; 5],
            shift: [[0; 3]; 15],
            wraps: false,
            owned: [[0; 2]; 5],
            with_ghosts: false,
        };
        let around = [(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        for (w, (across, up)) in around.into_iter().enumerate() {
            let mut to = [column as i64 + across, plane as i64 + up];
            let mut wrap = 0;
            let mut present = true;
            if to[0] < 0 || to[0] >= grid.columns_per_plane as i64 {
                // In two dimensions a plane is one column, and has none beside it.
                present = geometry.periodic[grid.column_axis] && geometry.dimensions == 3;
                wrap = to[0].div_euclid(grid.columns_per_plane as i64);
                to[0] = to[0].rem_euclid(grid.columns_per_plane as i64);
            }
            if to[1] >= grid.planes as i64 {
                // The copy of the first.
                present &= geometry.periodic[grid.plane_axis];
            }
            if !present {
                continue;
            }
            stencil.present[w] = 1.0;
            stencil.wraps |= wrap != 0;
            let cell = (to[1] as usize * grid.columns_per_plane + to[0] as usize) * grid.cells_per_column;
            stencil.column[w] = data.start[cell..].as_ptr();
            if let Some(owned) = data.owned_of_column.get(cell / grid.cells_per_column) {
                stencil.owned[w] = owned.range;
                stencil.with_ghosts |= w == 0 && owned.with_ghosts;
            }
            for period in 0..3 {
                stencil.shift[w + 5 * period] = plane_search.shift[(wrap + 1) as usize][period];
            }
        }
        stencil
    }
}

/// A cell for each window and particle of a group.
pub type CellIndices = [[i32; SEARCH_GROUP]; 5];

/// The cells, from the first to one past the last, in which particles of a group look for others.
#[derive(Default)]
pub struct CellRanges {
    pub low: CellIndices,
    pub end: CellIndices,
    /// From where to the end of the column they look in the period before, and to where in the next.
    pub before: CellIndices,
    pub after: CellIndices,
}

/// A plane, in the numbers that cell ranges are made of.
pub struct PlaneSearch {
    pub cutoff_squared: f32,
    pub column_width: f32,
    pub plane_edge: f32,
    /// Half the window of the column of the particle itself, in cells.
    pub half_range: f32,
    pub cells_per_length: f32,
    pub periodic: bool,
    pub tilted: bool,
    pub cells_per_column: i32,
    /// Two particles no further apart than this along x look together.
    pub i_cluster_extent: f32,
    /// Added to the positions of particles in columns of the period before, the same, and the next, and there in the same
    /// three periods along x.
    shift: [[[u32; 3]; 3]; 3],
}

impl PlaneSearch {
    #[inline(always)]
    pub fn new(data: &PassData<impl Scalar, impl PackedParticle>, plane: usize) -> PlaneSearch {
        let (geometry, grid) = (data.geometry, data.grid);
        let plane_width = geometry.height(grid.plane_axis) / grid.planes as f64;
        PlaneSearch {
            cutoff_squared: (grid.search_cutoff * grid.search_cutoff) as f32,
            column_width: (geometry.height(grid.column_axis) / grid.columns_per_plane as f64) as f32,
            plane_edge: ((plane + 1) as f64 * plane_width) as f32,
            half_range: (grid.range_half_width * grid.cells_per_column as f64) as f32,
            cells_per_length: (grid.cells_per_column as f64 / geometry.length[0]) as f32,
            periodic: geometry.periodic[0],
            tilted: geometry.is_tilted(),
            cells_per_column: grid.cells_per_column as i32,
            i_cluster_extent: (grid.i_cluster_extent * geometry.length[0] / grid.cells_per_column as f64)
                as f32,
            shift: [-1.0, 0.0, 1.0].map(|wrap| {
                [-geometry.length[0], 0.0, geometry.length[0]].map(|along| {
                    let [x, y, z] = geometry.edge(grid.column_axis).map(|e| wrap * e);
                    [x + along, y, z].map(|shift| 0x1_0001 * u32::from(data.fixed16_scale.shift(shift)))
                })
            }),
        }
    }

    /// The cell ranges of a group: `count` particles from `first` on, of which each `CLUSTER` may look together.
    #[inline(always)]
    pub unsafe fn cell_ranges<I: Isa, const CLUSTER: usize>(
        &self,
        data: &PassData<impl Scalar, impl PackedParticle>,
        column: usize,
        [first, count]: [usize; 2],
        present: &[f32; 5],
        out: &mut CellRanges,
    ) -> RangeFlags {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut flags = RangeFlags::default();
            let mut at = 0;
            while at < count {
                let i = first + at;
                let mut x = data.x.map(|x| x.as_ptr().add(i));
                let left = count - at;
                let mut lanes = [[0.0; 16]; 3];
                if left < I::F32::LANES {
                    // The last in the place of those that are not there.
                    for c in 0..3 {
                        lanes[c] = [*x[c].add(left - 1); 16];
                        std::ptr::copy_nonoverlapping(x[c], lanes[c].as_mut_ptr(), left);
                        x[c] = lanes[c].as_ptr();
                    }
                }
                let x = [I::F32::load(x[0]), I::F32::load(x[1]), I::F32::load(x[2])];
                self.ranges_of_vector::<I, CLUSTER>(data, column, x, at, present, out, &mut flags);
                at += I::F32::LANES;
            }
            flags
        }
    }

    /// The cell ranges of particles at `x`, `y`, `z`, those of a group from `at` on.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn ranges_of_vector<I: Isa, const CLUSTER: usize>(
        &self,
        data: &PassData<impl Scalar, impl PackedParticle>,
        column: usize,
        [x, y, z]: [I::F32; 3],
        at: usize,
        present: &[f32; 5],
        out: &mut CellRanges,
        flags: &mut RangeFlags,
    ) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let zero = I::F32::constant(0.0);
            let whole = I::F32::splat(self.half_range);
            let mut half_range = [whole; 5];
            let mut cell_position = x * I::F32::splat(self.cells_per_length);
            if self.tilted {
                cell_position = fraction_along::<I>(data.geometry, x, y, z)
                    * I::F32::constant(self.cells_per_column as f64);
            } else {
                // Half the chord of the sphere of reach in each column.
                let (across, up) = if data.grid.column_axis == 1 { (y, z) } else { (z, y) };
                let low_edge = I::F32::splat(column as f32 * self.column_width);
                let high_edge = I::F32::splat((column + 1) as f32 * self.column_width);
                let below = (across - low_edge).larger(zero);
                let above = (high_edge - across).larger(zero);
                let over = (I::F32::splat(self.plane_edge) - up).larger(zero);
                let (below, above) = (below * below, above * above);
                let all = I::F32::splat(self.cutoff_squared);
                let left = all - over * over;
                let cells_per_length = I::F32::splat(self.cells_per_length);
                half_range[1] = I::root_or_more(all - above) * cells_per_length;
                half_range[2] = I::root_or_more(left - below) * cells_per_length;
                half_range[3] = I::root_or_more(left) * cells_per_length;
                half_range[4] = I::root_or_more(left - above) * cells_per_length;
            }
            let most = I::F32::constant(self.cells_per_column as f64);
            let one = I::F32::constant(1.0);
            let [mut before, mut after] = [0; 2];
            if self.periodic {
                // The longest span is that of the particle's own column.
                before = (cell_position - half_range[0]).mask_below(zero);
                after = (most - one).mask_below(cell_position + half_range[0]);
            }
            // Team by i-cluster, if no i-cluster is too far apart.
            let first = I::cluster_first::<CLUSTER>(x);
            let far = I::F32::splat(self.i_cluster_extent);
            let close = (x - first).mask_below(far) & (first - x).mask_below(far);
            let together = close.trailing_ones() as usize >= I::F32::LANES;
            let mut w = 0;
            while w < 5 {
                // Columns that are not there get a span without length.
                let h = *half_range.get_unchecked(w) * I::F32::splat(*present.get_unchecked(w));
                let (mut low, mut end) = (cell_position - h, cell_position + h + one);
                end = end.where_below(zero, h);
                if together {
                    (low, end) = (I::cluster_least::<CLUSTER>(low), I::cluster_greatest::<CLUSTER>(end));
                }
                if before != 0 {
                    let low = (low + most).smaller(most);
                    low.store_whole(out.before.get_unchecked_mut(w).as_mut_ptr().add(at));
                }
                if after != 0 {
                    let over = (end - most).larger(zero);
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

/// How the cell ranges of a group end.
#[derive(Clone, Copy, Default)]
pub struct RangeFlags {
    /// Particles whose cell ranges go on in the period before, and in the next: a bit for each.
    pub before: u32,
    pub after: u32,
    /// Vectors in which cell ranges are those of each i-cluster together: a bit for each.
    pub together: u32,
}

/// Fractional coordinates along the first edge.
#[inline(always)]
pub unsafe fn fraction_along<I: Isa>(geometry: &BoxGeometry, x: I::F32, y: I::F32, z: I::F32) -> I::F32 {
    let sz = if geometry.dimensions == 3 {
        z * I::F32::constant(1.0 / geometry.length[2])
    } else {
        I::F32::constant(0.0)
    };
    let sy = (y - I::F32::constant(geometry.tilt[2]) * sz) * I::F32::constant(1.0 / geometry.length[1]);
    let along = x - I::F32::constant(geometry.tilt[0]) * sy - I::F32::constant(geometry.tilt[1]) * sz;
    along * I::F32::constant(1.0 / geometry.length[0])
}
