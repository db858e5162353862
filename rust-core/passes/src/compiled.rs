//! The passes over a plane, compiled for each precision and instruction set.

use crate::ground::arithmetic::{Arithmetic, Double, DoubleParticle, Mixed, MixedParticle, PackedParticle};
use crate::ground::terms::Terms;
use crate::instruction_set::InstructionSet;
use crate::pair_batch::accumulators::PlaneSums;
use crate::pair_batch::in_range_pairs::InRangePairs;
use crate::plane::buffers::PairBuffers;
use crate::plane::data::PassData;
use crate::plane::first::first_pass;
use crate::plane::second::second_pass;
use crate::simd::{Isa, Kernel, Scalar, run};
use crate::tally::Tally;
use std::marker::PhantomData;
use std::ops::Range;

/// A precision of pairs.
///
/// The passes are compiled in this crate: its two methods are not generic, so that no other crate compiles them again.
pub trait PairPrecision: Send + Sync + Sized + 'static {
    /// Type of the numbers that pairs are computed in.
    type Scalar: Scalar;
    /// Type of a packed particle.
    type PackedParticle: PackedParticle;
    /// The arithmetic on an instruction set.
    type On<I: Isa>: Arithmetic<I, Scalar = Self::Scalar, PackedParticle = Self::PackedParticle>;

    /// Does the first pass over a plane.
    ///
    /// # Safety
    /// The caller fulfils the contract of [`first_pass`].
    unsafe fn first(passes: &Passes<Self>, pass: First<Self>) -> Tally;

    /// Does the second pass over a plane.
    ///
    /// # Safety
    /// The caller fulfils the contract of [`second_pass`].
    unsafe fn second(passes: &Passes<Self>, pass: Second<Self>);
}

macro_rules! precisions {
    ($($precision:ident: $scalar:ty, $particle:ty);+) => {$(
        impl PairPrecision for $precision {
            type Scalar = $scalar;
            type PackedParticle = $particle;
            type On<I: Isa> = $precision;

            #[inline(never)]
            unsafe fn first(passes: &Passes<$precision>, pass: First<$precision>) -> Tally {
                // SAFETY: the scheduler starts a first pass after it has filled this plane and the next, and
                // lets no other thread have its sums.
                unsafe { passes.run(pass) }
            }

            #[inline(never)]
            unsafe fn second(passes: &Passes<$precision>, pass: Second<$precision>) {
                // SAFETY: the scheduler starts a second pass after the first pass of its plane, when slopes are complete.
                unsafe { passes.run(pass) }
            }
        }
    )+};
}

precisions!(Mixed: f32, MixedParticle; Double: f64, DoubleParticle);

/// The passes of one fluid.
pub struct Passes<P> {
    set: InstructionSet,
    /// Whether the loops must distinguish species, or cache all pairs.
    multispecies: bool,
    tally: bool,
    precision: PhantomData<P>,
}

impl<P: PairPrecision> Passes<P> {
    pub fn new(set: InstructionSet, terms: &Terms<P::Scalar>, tally: bool) -> Passes<P> {
        Passes { set, multispecies: terms.species > 1 || terms.full_cache, tally, precision: PhantomData }
    }

    /// Runs the loops of a pass for this fluid.
    ///
    /// # Safety
    /// The caller fulfils the contract of the pass.
    #[inline(always)]
    unsafe fn run<K, O>(&self, pass: K) -> O
    where
        With<K, false, false>: Kernel<Out = O>,
        With<K, false, true>: Kernel<Out = O>,
        With<K, true, false>: Kernel<Out = O>,
        With<K, true, true>: Kernel<Out = O>,
    {
        // SAFETY: the caller fulfils the contract of the pass; `set` exists only for instructions of this processor.
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

/// A pass, compiled with or without species, and with or without energies and virials.
struct With<K, const MULTISPECIES: bool, const TALLY: bool>(K);

/// Arguments of the first pass over columns of a plane.
pub struct First<'a, P: PairPrecision> {
    pub data: &'a PassData<'a, P::Scalar, P::PackedParticle>,
    pub plane: usize,
    pub columns: Range<usize>,
    pub sums: PlaneSums<'a>,
    pub buffers: &'a mut PairBuffers<P::Scalar>,
    pub in_range: &'a mut InRangePairs<P::Scalar>,
    /// The pairs with ghosts.
    pub rim: &'a mut InRangePairs<P::Scalar>,
}

impl<P: PairPrecision, const MULTISPECIES: bool, const TALLY: bool> Kernel
    for With<First<'_, P>, MULTISPECIES, TALLY>
{
    type Out = Tally;

    #[inline(always)]
    unsafe fn run<I: Isa>(self) -> Tally {
        let First { data, plane, columns, sums, buffers, in_range, rim } = self.0;
        // SAFETY: the caller of `PairPrecision::first` fulfils the contract of `first_pass`.
        unsafe {
            first_pass::<I, P::On<I>, MULTISPECIES, TALLY>(data, plane, columns, sums, buffers, in_range, rim)
        }
    }
}

/// Arguments of the second pass over a plane.
pub struct Second<'a, P: PairPrecision> {
    pub data: &'a PassData<'a, P::Scalar, P::PackedParticle>,
    pub sums: PlaneSums<'a>,
    pub in_range: &'a InRangePairs<P::Scalar>,
    /// Whether these pairs are those with ghosts.
    pub is_rim: bool,
    pub virial: &'a mut [f64; 6],
}

impl<P: PairPrecision, const MULTISPECIES: bool, const TALLY: bool> Kernel
    for With<Second<'_, P>, MULTISPECIES, TALLY>
{
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let Second { data, sums, in_range, is_rim, virial } = self.0;
        // SAFETY: the caller of `PairPrecision::second` fulfils the contract of `second_pass`.
        unsafe {
            if is_rim {
                second_pass::<I, P::On<I>, MULTISPECIES, TALLY, true>(data, sums, in_range, virial);
            } else {
                second_pass::<I, P::On<I>, MULTISPECIES, TALLY, false>(data, sums, in_range, virial);
            }
        }
    }
}
