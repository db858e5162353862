//! The two passes over the pairs of a plane, for a precision, on an instruction set. Between them ψ and its slopes are
//! evaluated (`workspace::excess`).

pub mod buffers;
pub mod data;
pub mod first;
pub mod second;
pub mod second_cached;
pub mod slopes;

use buffers::PairBuffers;
use data::PassData;
use first::first_pass;
use second::second_pass;

use crate::engine::instruction_set::InstructionSet;
use crate::engine::sweep::ground::arithmetic::{
    Arithmetic, Double, DoubleParticle, Mixed, MixedParticle, PackedParticle,
};
use crate::engine::sweep::ground::terms::Terms;
use crate::engine::sweep::pair_batch::accumulators::PlaneSums;
use crate::engine::sweep::pair_batch::in_range_pairs::InRangePairs;
use crate::engine::sweep::simd::{Isa, Kernel, Scalar, run};
use crate::engine::tally::Tally;
use std::marker::PhantomData;

/// A precision of pairs.
pub trait PairPrecision: Send + Sync + Sized + 'static {
    /// What pairs are computed in.
    type Scalar: Scalar;
    /// What is kept of a particle.
    type PackedParticle: PackedParticle;
    /// The arithmetic on an instruction set.
    type On<I: Isa>: Arithmetic<I, Scalar = Self::Scalar, PackedParticle = Self::PackedParticle>;
}

impl PairPrecision for Mixed {
    type Scalar = f32;
    type PackedParticle = MixedParticle;
    type On<I: Isa> = Mixed;
}

impl PairPrecision for Double {
    type Scalar = f64;
    type PackedParticle = DoubleParticle;
    type On<I: Isa> = Double;
}

/// The passes of one fluid.
pub struct Passes<P> {
    set: InstructionSet,
    /// Whether loops are needed that know species, or that cache all pairs.
    multispecies: bool,
    /// Whether energies and virials are wanted.
    tally: bool,
    precision: PhantomData<P>,
}

impl<P: PairPrecision> Passes<P> {
    pub fn new(set: InstructionSet, terms: &Terms<P::Scalar>, tally: bool) -> Passes<P> {
        Passes { set, multispecies: terms.species > 1 || terms.full_cache, tally, precision: PhantomData }
    }

    /// The first pass over a plane.
    ///
    /// # Safety
    /// As [`first_pass`].
    pub unsafe fn first(
        &self,
        data: &PassData<P::Scalar, P::PackedParticle>,
        plane: usize,
        sums: PlaneSums,
        buffers: &mut PairBuffers<P::Scalar>,
        in_range: &mut InRangePairs<P::Scalar>,
    ) -> Tally {
        let pass = First::<P> { data, plane, sums, buffers, in_range };
        // SAFETY: `first_pass` asks for no more than this function does.
        unsafe {
            match (self.multispecies, self.tally) {
                (false, false) => run(self.set, With::<_, false, false>(pass)),
                (false, true) => run(self.set, With::<_, false, true>(pass)),
                (true, false) => run(self.set, With::<_, true, false>(pass)),
                (true, true) => run(self.set, With::<_, true, true>(pass)),
            }
        }
    }

    /// The second pass over a plane.
    ///
    /// # Safety
    /// As [`second_pass`].
    pub unsafe fn second(
        &self,
        data: &PassData<P::Scalar, P::PackedParticle>,
        sums: PlaneSums,
        in_range: &InRangePairs<P::Scalar>,
        virial: &mut [f64; 6],
    ) {
        let pass = Second::<P> { data, sums, in_range, virial };
        // SAFETY: `second_pass` asks for no more than this function does.
        unsafe {
            match (self.multispecies, self.tally) {
                (false, false) => run(self.set, With::<_, false, false>(pass)),
                (false, true) => run(self.set, With::<_, false, true>(pass)),
                (true, false) => run(self.set, With::<_, true, false>(pass)),
                (true, true) => run(self.set, With::<_, true, true>(pass)),
            }
        }
    }
}

/// A pass, compiled with species or without, with energies and virials or without.
struct With<K, const MULTISPECIES: bool, const TALLY: bool>(K);

struct First<'a, P: PairPrecision> {
    data: &'a PassData<'a, P::Scalar, P::PackedParticle>,
    plane: usize,
    sums: PlaneSums<'a>,
    buffers: &'a mut PairBuffers<P::Scalar>,
    in_range: &'a mut InRangePairs<P::Scalar>,
}

impl<P: PairPrecision, const MULTISPECIES: bool, const TALLY: bool> Kernel
    for With<First<'_, P>, MULTISPECIES, TALLY>
{
    type Out = Tally;

    #[inline(always)]
    unsafe fn run<I: Isa>(self) -> Tally {
        let First { data, plane, sums, buffers, in_range } = self.0;
        // SAFETY: what `first_pass` asks for is promised to `Passes::first`.
        unsafe { first_pass::<I, P::On<I>, MULTISPECIES, TALLY>(data, plane, sums, buffers, in_range) }
    }
}

struct Second<'a, P: PairPrecision> {
    data: &'a PassData<'a, P::Scalar, P::PackedParticle>,
    sums: PlaneSums<'a>,
    in_range: &'a InRangePairs<P::Scalar>,
    virial: &'a mut [f64; 6],
}

impl<P: PairPrecision, const MULTISPECIES: bool, const TALLY: bool> Kernel
    for With<Second<'_, P>, MULTISPECIES, TALLY>
{
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let Second { data, sums, in_range, virial } = self.0;
        // SAFETY: what `second_pass` asks for is promised to `Passes::second`.
        unsafe { second_pass::<I, P::On<I>, MULTISPECIES, TALLY>(data, sums, in_range, virial) }
    }
}
