//! Positions as fractions of the box geometry, block by block.

use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;

pub const TWO_TO_32: f64 = 4_294_967_296.0;

/// Limit of scaled coordinates, far below the largest whole number that `WHOLE` can extract.
const FAR: f64 = 1e15;

/// A number above those of all cells: a particle with such a contribution is outside of the box geometry.
pub const OUTSIDE: u32 = 1 << 30;

/// Number of particles of a block.
pub const SORT_BLOCK: usize = 32;

/// Number of coordinates of a block.
const COORDINATES: usize = 3 * SORT_BLOCK;

/// Converts positions to fractions of the box geometry in units of 2⁻³², and these to cells of a grid.
/// Constants are repeated for each particle of a block, so that loops treat all coordinates alike.
pub struct Fractions<'a> {
    geometry: &'a BoxGeometry,
    inverse: [f64; 3],
    origin: [f64; COORDINATES],
    scale: [f64; COORDINATES],
    /// The smallest and the largest fraction along open directions, where fractions do not wrap.
    lowest: [f64; COORDINATES],
    highest: [f64; COORDINATES],
    pub is_open: bool,
    /// For coordinates along open directions [`OUTSIDE`], else 0.
    outside: [u32; COORDINATES],
    /// Number of cells along each axis, and the difference of neighbouring cells' numbers along it.
    of: [u32; COORDINATES],
    step: [u32; COORDINATES],
}

impl<'a> Fractions<'a> {
    pub fn new(geometry: &'a BoxGeometry, grid: &CellGrid) -> Fractions<'a> {
        let inverse = geometry.length.map(|l| 1.0 / l);
        let flat = if geometry.dimensions == 3 { 1.0 } else { 0.0 };
        let scale = [inverse[0] * TWO_TO_32, inverse[1] * TWO_TO_32, flat * inverse[2] * TWO_TO_32];
        let (of, step) = (grid.along(), grid.steps());
        let end = |c: usize, end: f64, beyond: f64| if geometry.periodic[c] { beyond } else { end };
        Fractions {
            geometry,
            inverse,
            origin: std::array::from_fn(|c| geometry.origin[c % 3]),
            scale: std::array::from_fn(|c| scale[c % 3]),
            lowest: std::array::from_fn(|c| end(c % 3, 0.0, -FAR)),
            highest: std::array::from_fn(|c| end(c % 3, TWO_TO_32 - 1.0, FAR)),
            is_open: !geometry.periodic.iter().all(|p| *p),
            outside: std::array::from_fn(|c| match c % 3 {
                c if c < geometry.dimensions && !geometry.periodic[c] => OUTSIDE,
                _ => 0,
            }),
            of: std::array::from_fn(|c| of[c % 3]),
            step: std::array::from_fn(|c| step[c % 3]),
        }
    }

    /// Computes fractions of a block of particles; they wrap along periodic directions, and are limited
    /// to the ends along open ones. Returns whether all are finite and not too far away.
    #[inline(always)]
    pub fn of_block<const OPEN: bool>(
        &self,
        x: &[[f64; 3]; SORT_BLOCK],
        fixed32: &mut [[u32; 3]; SORT_BLOCK],
    ) -> bool {
        let mut scaled = [0.0; COORDINATES];
        if self.geometry.is_tilted() {
            self.tilt(x, &mut scaled);
        } else {
            let constants = self.origin.iter().zip(&self.scale);
            for (t, (x, (origin, scale))) in scaled.iter_mut().zip(x.as_flattened().iter().zip(constants)) {
                *t = (x - origin) * scale;
            }
        }
        let mut far = 0u64;
        for t in scaled {
            // The comparison is false for NaN.
            let near = t.abs() < FAR;
            far |= u64::from(!near);
        }
        if OPEN {
            for (t, (low, high)) in scaled.iter_mut().zip(self.lowest.iter().zip(&self.highest)) {
                let above = if *t > *low { *t } else { *low };
                *t = if above < *high { above } else { *high };
            }
        }
        for (u, t) in fixed32.as_flattened_mut().iter_mut().zip(scaled) {
            *u = (t + WHOLE).to_bits() as u32;
        }
        far == 0
    }

    // Tilted boxes are rare: inlined, this function would prevent the loops around it from vectorising.

    /// Corrects fractions in a tilted box.
    #[inline(never)]
    fn tilt(&self, x: &[[f64; 3]; SORT_BLOCK], scaled: &mut [f64; COORDINATES]) {
        for (t, x) in scaled.as_chunks_mut::<3>().0.iter_mut().zip(x) {
            *t = self.geometry.fraction(x, &self.inverse).map(|s| s * TWO_TO_32);
        }
    }

    /// Whether the fractions of a particle are finite and not too far away.
    pub fn has(&self, x: &[f64; 3]) -> bool {
        self.geometry.fraction(x, &self.inverse).iter().all(|s| (s * TWO_TO_32).abs() < FAR)
    }

    /// The contributions of the coordinates of a block of particles to the numbers of their cells; with `GHOSTS` more than
    /// [`OUTSIDE`] for a coordinate that has been limited to an end along an open direction.
    #[inline(always)]
    pub fn cells<const GHOSTS: bool>(&self, fixed32: &[[u32; 3]; SORT_BLOCK]) -> [[u32; 3]; SORT_BLOCK] {
        let mut parts = [[0; 3]; SORT_BLOCK];
        let constants = self.of.iter().zip(&self.step);
        let coordinates = fixed32.as_flattened();
        let fixed32 = coordinates.iter().zip(constants);
        for (part, (u, (of, step))) in parts.as_flattened_mut().iter_mut().zip(fixed32) {
            *part = ((*u as u64 * *of as u64) >> 32) as u32 * step;
        }
        if GHOSTS {
            let ends = parts.as_flattened_mut().iter_mut().zip(coordinates.iter().zip(&self.outside));
            for (part, (u, outside)) in ends {
                *part |= if u.wrapping_sub(1) >= u32::MAX - 1 { *outside } else { 0 };
            }
        }
        parts
    }
}

/// Adding this constant leaves the nearest whole number in the low bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
