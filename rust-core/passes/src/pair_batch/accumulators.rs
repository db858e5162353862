//! What pairs add up on particles.
//!
//! Each plane has accumulators of its own, for its particles and for those of the next plane. No other plane writes them,
//! so that sums do not depend on which thread does which plane, nor when.

use crate::simd::OFFSET_BITS;
use std::marker::PhantomData;

/// Four sums of one particle: the force, and the density if there is one variable. Aligned, so that none straddles two
/// cache lines.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Accumulator(pub [f64; 4]);

const _: () = assert!(size_of::<Accumulator>() == 1 << OFFSET_BITS);

/// What the pairs of one plane add to: accumulators of its particles, then of those of the next plane.
#[derive(Clone, Copy)]
pub struct PlaneSums<'a> {
    /// Where the accumulators of particle 0 would be, if it were of this plane: force, and density if there is one variable.
    forces: *mut f64,
    /// The same of densities, if there are several variables: `variables` numbers each, filled up to quads.
    densities: *mut f64,
    /// How many densities each particle has: one for each density pass and species.
    pub variables: usize,
    borrowed: PhantomData<&'a mut [Accumulator]>,
}

impl<'a> PlaneSums<'a> {
    /// The accumulators of a plane whose first particle is `first`; of each particle one of forces, and as many of densities
    /// as quads hold `variables`, if there are several.
    pub fn new(
        first: usize,
        forces: &'a mut [Accumulator],
        densities: &'a mut [Accumulator],
        variables: usize,
    ) -> PlaneSums<'a> {
        let quads = variables.div_ceil(4);
        PlaneSums {
            forces: forces.as_mut_ptr().wrapping_sub(first).cast(),
            densities: densities.as_mut_ptr().wrapping_sub(quads * first).cast(),
            variables,
            borrowed: PhantomData,
        }
    }

    /// The force accumulators.
    #[inline(always)]
    pub fn forces(self) -> PlaneAccumulators {
        PlaneAccumulators { base: self.forces, quads_per_particle: 1, quad: 0 }
    }

    /// Quads of densities of each particle.
    #[inline(always)]
    pub fn density_quads(self) -> usize {
        self.variables.div_ceil(4)
    }

    /// The density accumulators: quad number `quad` of each particle. Only if there are several variables.
    #[inline(always)]
    pub fn densities(self, quad: usize) -> PlaneAccumulators {
        PlaneAccumulators { base: self.densities, quads_per_particle: self.density_quads(), quad }
    }
}

/// The accumulators of one plane, of forces or of a quad of densities.
#[derive(Clone, Copy)]
pub struct PlaneAccumulators {
    /// Where the accumulator of particle 0 would be, if it were in this plane.
    base: *mut f64,
    quads_per_particle: usize,
    quad: usize,
}

impl PlaneAccumulators {
    /// The accumulator of a particle, given its index shifted by [`OFFSET_BITS`]: four numbers, if the particle is of the plane
    /// or of the next one. The base may be out of bounds, so this computes with addresses that wrap.
    #[inline(always)]
    pub fn at(self, offset: usize) -> *mut f64 {
        self.base.wrapping_byte_add(offset * self.quads_per_particle).wrapping_add(4 * self.quad)
    }
}
