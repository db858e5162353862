//! What the passes over one plane are given.

use super::box_geometry::BoxGeometry;
use super::cell_grid::CellGrid;
use super::fixed_point::FixedPoint16;
use super::shared_ptr::SharedPtr;
use super::terms::Terms;
use crate::engine::noise::PairNoise;

/// Particles in the order of cells, and room for what pairs add to them. Behind the last particle come
/// copies of the first plane, one period further, if planes are periodic: the next plane of the last.
pub struct PassData<'a, T, R> {
    pub geometry: &'a BoxGeometry,
    pub grid: &'a CellGrid,
    /// First particle of each cell, and one past the last; if planes are periodic, then those of the copy of the first
    /// plane, one past the last of which is the last.
    pub start: &'a [u32],
    /// Positions from the origin of the box geometry.
    pub x: [SharedPtr<f32>; 3],
    /// The same in words.
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [SharedPtr<u16>; 3],
    pub packed: SharedPtr<R>,
    /// Species; not there with one.
    pub species: SharedPtr<u8>,
    /// Which are ghosts; empty if there are none.
    pub ghost: &'a [bool],
    /// A bit for each particle that is not.
    pub owned: &'a [u8],
    /// Of each column, then of those of the copy of the first plane; empty if there are no ghosts.
    pub owned_of_column: &'a [OwnedOfColumn],
    pub terms: &'a Terms<T>,
    /// The many-body slopes, a number for each pass and species.
    pub slopes: SharedPtr<f64>,
    /// The same for pairs that are kept in the full pair cache: columns of eight for all particles, then columns of the next eight …, with so
    /// many numbers each time.
    pub packed_slopes: SharedPtr<T>,
    pub packed_slope_stride: usize,
    /// What to add to the number of a particle to get that of its accumulator, for each plane.
    pub accumulator_offset: &'a [isize],
    /// Four numbers for each accumulator: force, and the density if there is one variable.
    pub sums: SharedPtr<f64>,
    /// Densities, if there are more: for each accumulator `variables` numbers, and as many more as fill columns of four.
    pub densities: SharedPtr<f64>,
    pub variables: usize,
    pub thermostat: Option<(PairNoise, f64)>,
}

/// The owned particles of a column.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OwnedOfColumn {
    /// The first, and one past the last.
    pub range: [u32; 2],
    /// Whether the column has ghosts.
    pub with_ghosts: bool,
}

impl<T, R> PassData<'_, T, R> {
    /// How much of a pair counts here: one, a half with a ghost.
    pub fn pair_weight(&self, i: usize, j: usize) -> f64 {
        if self.ghost.is_empty() {
            return 1.0;
        }
        1.0 - 0.5 * (self.ghost[i] as u8 + self.ghost[j] as u8) as f64
    }

    /// A bit for each of the sixteen particles from `at` on that is not a ghost.
    #[inline(always)]
    pub unsafe fn owned_bits(&self, at: usize) -> u32 {
        // SAFETY: there are bits for sixteen particles behind the last, and eight bytes behind those.
        unsafe {
            let bits = self.owned.as_ptr().add(at / 8).cast::<u32>().read_unaligned();
            bits >> (at % 8) & 0xffff
        }
    }

    /// Whether there is a ghost among the particles of a group.
    #[inline(always)]
    pub unsafe fn has_ghosts(&self, [first, count]: [usize; 2]) -> bool {
        // SAFETY: there are bits for the particles, and more than eight bytes behind them.
        let bits = unsafe { self.owned.as_ptr().add(first / 8).cast::<u64>().read_unaligned() };
        let all = (1 << count) - 1;
        bits >> (first % 8) & all != all
    }
}
