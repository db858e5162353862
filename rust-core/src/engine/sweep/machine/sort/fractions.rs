//! Positions as fractions of the frame, block by block.

use super::{FAR, TWO_TO_32};
use crate::engine::sweep::frame::Frame;
use crate::engine::sweep::grid::Grid;

/// Particles of a block.
pub const BLOCK: usize = 32;

/// Coordinates of a block.
const LANES: usize = 3 * BLOCK;

/// How positions become fractions of the frame in units of 2⁻³², and those the cells of a grid; constants are repeated
/// for each particle of a block, so that loops are over all coordinates alike.
pub struct Fractions<'a> {
    frame: &'a Frame,
    inverse: [f64; 3],
    origin: [f64; LANES],
    scale: [f64; LANES],
    /// Where fractions end that do not wrap.
    ends: [[f64; 2]; LANES],
    is_open: bool,
    /// Cells along each axis, and from one to the next along it.
    of: [u32; LANES],
    step: [u32; LANES],
}

impl<'a> Fractions<'a> {
    pub fn new(frame: &'a Frame, grid: &Grid) -> Fractions<'a> {
        let inverse = frame.length.map(|l| 1.0 / l);
        let flat = if frame.dimensions == 3 { 1.0 } else { 0.0 };
        let scale = [inverse[0] * TWO_TO_32, inverse[1] * TWO_TO_32, flat * inverse[2] * TWO_TO_32];
        let (of, step) = (grid.along(), grid.steps());
        let end = |c: usize, end: f64, beyond: f64| if frame.periodic[c] { beyond } else { end };
        Fractions {
            frame,
            inverse,
            origin: std::array::from_fn(|c| frame.origin[c % 3]),
            scale: std::array::from_fn(|c| scale[c % 3]),
            ends: std::array::from_fn(|c| [end(c % 3, 0.0, -FAR), end(c % 3, TWO_TO_32 - 1.0, FAR)]),
            is_open: !frame.periodic.iter().all(|p| *p),
            of: std::array::from_fn(|c| of[c % 3]),
            step: std::array::from_fn(|c| step[c % 3]),
        }
    }

    /// Fractions of a block of particles; they wrap along periods, and are never beyond the ends where there are none.
    /// Whether all are finite and not too far away.
    #[inline(always)]
    pub fn of_block(&self, x: &[[f64; 3]; BLOCK], units: &mut [[u32; 3]; BLOCK]) -> bool {
        let mut scaled = [0.0; LANES];
        if self.frame.is_tilted() {
            self.lean(x, &mut scaled);
        } else {
            let constants = self.origin.iter().zip(&self.scale);
            for (t, (x, (origin, scale))) in scaled.iter_mut().zip(x.as_flattened().iter().zip(constants)) {
                *t = (x - origin) * scale;
            }
        }
        let mut far = 0u64;
        for t in scaled {
            // Not where it is not a number.
            let near = t.abs() < FAR;
            far |= u64::from(!near);
        }
        if self.is_open {
            self.stay(&mut scaled);
        }
        for (u, t) in units.as_flattened_mut().iter_mut().zip(scaled) {
            *u = (t + WHOLE).to_bits() as u32;
        }
        far == 0
    }

    // Neither of both is common: inlined they would keep the loops around them from becoming vectors.

    /// Fractions in a frame that leans.
    #[inline(never)]
    fn lean(&self, x: &[[f64; 3]; BLOCK], scaled: &mut [f64; LANES]) {
        for (t, x) in scaled.as_chunks_mut::<3>().0.iter_mut().zip(x) {
            *t = self.frame.fraction(x, &self.inverse).map(|s| s * TWO_TO_32);
        }
    }

    /// Fractions no further than the ends of the frame.
    #[inline(never)]
    fn stay(&self, scaled: &mut [f64; LANES]) {
        for (t, [low, high]) in scaled.iter_mut().zip(&self.ends) {
            let above = if *t > *low { *t } else { *low };
            *t = if above < *high { above } else { *high };
        }
    }

    /// Whether the fractions of a particle are finite and not too far away.
    pub fn has(&self, x: &[f64; 3]) -> bool {
        self.frame.fraction(x, &self.inverse).iter().all(|s| (s * TWO_TO_32).abs() < FAR)
    }

    /// What the coordinates of a block of particles add to the numbers of their cells.
    #[inline(always)]
    pub fn cells(&self, units: &[[u32; 3]; BLOCK]) -> [[u32; 3]; BLOCK] {
        let mut parts = [[0; 3]; BLOCK];
        let constants = self.of.iter().zip(&self.step);
        let units = units.as_flattened().iter().zip(constants);
        for (part, (u, (of, step))) in parts.as_flattened_mut().iter_mut().zip(units) {
            *part = ((*u as u64 * *of as u64) >> 32) as u32 * step;
        }
        parts
    }
}

/// Adding this leaves the nearest whole number in the low bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
