//! What pairs add up on particles.

use crate::engine::sweep::simd::OFFSET_BITS;
use std::marker::PhantomData;

/// Four sums of one particle: the force, and the density if there is one variable. Aligned, so that none straddles two
/// cache lines.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Accumulator(pub [f64; 4]);

const _: () = assert!(size_of::<Accumulator>() == 1 << OFFSET_BITS);

/// The accumulators that the pairs of one plane add to: those of its own particles, then those of the next plane's.
#[derive(Clone, Copy)]
pub struct PlaneSums<'a> {
    /// Where the accumulators of particle 0 would be, if it were in this plane.
    forces: *mut f64,
    densities: *mut f64,
    borrowed: PhantomData<&'a mut [Accumulator]>,
}

impl<'a> PlaneSums<'a> {
    /// The accumulators of a plane whose first particle is `first`. There are as many for densities as for forces, or a
    /// multiple, or none.
    pub fn new(
        first: usize,
        forces: &'a mut [Accumulator],
        densities: &'a mut [Accumulator],
    ) -> PlaneSums<'a> {
        let quads = densities.len().checked_div(forces.len()).unwrap_or(0);
        PlaneSums {
            forces: forces.as_mut_ptr().wrapping_sub(first).cast(),
            densities: densities.as_mut_ptr().wrapping_sub(quads * first).cast(),
            borrowed: PhantomData,
        }
    }

    /// The accumulators of forces.
    #[inline(always)]
    pub fn forces(self) -> PlaneAccumulators {
        PlaneAccumulators { base: self.forces, quads_per_particle: 1, quad: 0 }
    }

    /// Quad number `quad` of the densities of each particle.
    #[inline(always)]
    pub fn densities(self, quads_per_particle: usize, quad: usize) -> PlaneAccumulators {
        PlaneAccumulators { base: self.densities, quads_per_particle, quad }
    }
}

/// Accumulators of a plane: one for each particle, `quads_per_particle` apart.
#[derive(Clone, Copy)]
pub struct PlaneAccumulators {
    base: *mut f64,
    quads_per_particle: usize,
    quad: usize,
}

impl PlaneAccumulators {
    /// The accumulator of a particle, given its index shifted by [`OFFSET_BITS`]. It points to four numbers if the particle
    /// is of the plane or of the next one.
    #[inline(always)]
    pub fn at(self, offset: usize) -> *mut f64 {
        self.base.wrapping_byte_add(offset * self.quads_per_particle).wrapping_add(4 * self.quad)
    }
}
