//! What pairs add up on particles.
//!
//! Each plane has accumulators of its own, for its particles and for those of the next plane. No other plane writes them,
//! so that sums do not depend on which thread does which plane, nor when.

use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::simd::OFFSET_BITS;

/// Four sums of one particle: the force, and the density if there is one variable. Aligned, so that none straddles two
/// cache lines.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Accumulator(pub [f64; 4]);

const _: () = assert!(size_of::<Accumulator>() == 1 << OFFSET_BITS);

/// The accumulators of all planes.
#[derive(Clone, Copy)]
pub struct Accumulators<'a> {
    /// For each plane the number to add to the index of a particle to get that of its accumulator.
    pub offset: &'a [isize],
    /// Force, and density if there is one variable.
    pub sums: SharedPtr<f64>,
    /// Densities, if there are several variables: `variables` numbers for each accumulator, filled up to quads.
    pub densities: SharedPtr<f64>,
    /// How many densities each particle has: one for each density pass and species.
    pub variables: usize,
}

impl Accumulators<'_> {
    /// The force accumulators of a plane.
    ///
    /// # Safety
    /// The plane is one of the grid.
    #[inline(always)]
    pub unsafe fn forces(&self, plane: usize) -> PlaneAccumulators {
        // SAFETY: `lay_out` places the accumulators of the plane at this offset.
        let base = unsafe { self.sums.0.offset(4 * *self.offset.get_unchecked(plane)) };
        PlaneAccumulators { base, quads_per_particle: 1, quad: 0 }
    }

    /// Quads of densities of each particle.
    #[inline(always)]
    pub fn density_quads(&self) -> usize {
        self.variables.div_ceil(4)
    }

    /// The density accumulators of a plane: quad number `quad` of each particle.
    ///
    /// # Safety
    /// The plane is one of the grid, and there are several variables.
    #[inline(always)]
    pub unsafe fn densities(&self, plane: usize, quad: usize) -> PlaneAccumulators {
        let quads_per_particle = self.density_quads();
        // SAFETY: `lay_out` places the accumulators of the plane at this offset.
        let base = unsafe {
            let offset = *self.offset.get_unchecked(plane);
            self.densities.0.offset((4 * quads_per_particle) as isize * offset)
        };
        PlaneAccumulators { base, quads_per_particle, quad }
    }
}

/// The accumulators of one plane.
#[derive(Clone, Copy)]
pub struct PlaneAccumulators {
    /// Where the accumulator of particle 0 would be, if it were in this plane.
    pub base: *mut f64,
    quads_per_particle: usize,
    quad: usize,
}

impl PlaneAccumulators {
    /// The accumulator of a particle, given its index shifted by [`OFFSET_BITS`].
    ///
    /// # Safety
    /// The particle is of the plane or of the next one.
    #[inline(always)]
    pub unsafe fn at(self, offset: usize) -> *mut f64 {
        // SAFETY: accumulators of both planes lie at these offsets (`lay_out`).
        unsafe { self.base.byte_add(offset * self.quads_per_particle).add(4 * self.quad) }
    }
}
