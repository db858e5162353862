//! Sums over the pairs of each particle.
//!
//! Each plane has its own accumulators, for its particles and for those of the next plane, in one or two sets
//! between which its blocks of columns alternate. No particle of a set gets additions from two blocks, so that sums
//! do not depend on the order of blocks, planes and threads.

use crate::simd::OFFSET_BITS;
use std::marker::PhantomData;

/// Four sums of one particle: the force, and the density if there is one variable. The alignment
/// keeps each within one cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Accumulator(pub [f64; 4]);

const _: () = assert!(size_of::<Accumulator>() == 1 << OFFSET_BITS);

/// The sums of the pairs of one plane: accumulators of its particles, followed by those of the next plane.
#[derive(Clone, Copy)]
pub struct PlaneSums<'a> {
    /// Address that the accumulator of particle 0 would have in this plane: force, and density if there is one variable.
    forces: *mut f64,
    /// Address of density sums as for `forces`, if there are several variables: `variables` numbers each, padded to quads.
    densities: *mut f64,
    /// Number of densities of each particle: one for each density pass and species.
    pub variables: usize,
    borrowed: PhantomData<&'a mut [Accumulator]>,
}

impl<'a> PlaneSums<'a> {
    /// The accumulators of a plane; `forces` and `densities` are the places of those of its particle `first`. Each
    /// particle has one of forces and, if there are several `variables`, as many of densities as quads hold them.
    pub fn new(
        first: usize,
        forces: *mut Accumulator,
        densities: *mut Accumulator,
        variables: usize,
    ) -> PlaneSums<'a> {
        let quads = variables.div_ceil(4);
        PlaneSums {
            forces: forces.wrapping_sub(first).cast(),
            densities: densities.wrapping_sub(quads * first).cast(),
            variables,
            borrowed: PhantomData,
        }
    }

    #[inline(always)]
    pub fn forces(self) -> PlaneAccumulators {
        PlaneAccumulators { base: self.forces, quads_per_particle: 1, quad: 0 }
    }

    /// Number of quads of densities of each particle.
    #[inline(always)]
    pub fn density_quads(self) -> usize {
        self.variables.div_ceil(4)
    }

    /// The density accumulators: quad number `quad` of each particle; only with several variables.
    #[inline(always)]
    pub fn densities(self, quad: usize) -> PlaneAccumulators {
        PlaneAccumulators { base: self.densities, quads_per_particle: self.density_quads(), quad }
    }
}

/// The accumulators of one plane, of forces or of a quad of densities.
#[derive(Clone, Copy)]
pub struct PlaneAccumulators {
    /// Address that the accumulator of particle 0 would have in this plane.
    base: *mut f64,
    quads_per_particle: usize,
    quad: usize,
}

impl PlaneAccumulators {
    /// The address of the four sums of a particle of the plane or of the next one, given its index
    /// shifted by [`OFFSET_BITS`]. The base may be out of bounds, so that the addition wraps.
    #[inline(always)]
    pub fn at(self, offset: usize) -> *mut f64 {
        self.base.wrapping_byte_add(offset * self.quads_per_particle).wrapping_add(4 * self.quad)
    }
}
