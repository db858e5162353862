//! The steps of a batch: distances and noise, each term, densities, and the quads that are added to the particles.

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::full_pair_cache::append_to_cache;
use super::in_range_pairs::{InRangePairs, append_in_range};
use super::inputs::PairInputs;
use super::kernel_weights::kernel_weights;
use super::pair_terms::{PairSums, add_linear, add_soft, add_spline, forces, sum_lanes};
use super::scalar_fallback::scalar_fallback;
use super::step_constants::StepConstants;
use super::thermostat::draw;
use crate::ground::arithmetic::{Arithmetic, PairVector};
use crate::ground::species_pairs::SpeciesPair;
use crate::simd::{Isa, Reals, Scalar, Words};
use crate::tally::Tally;
use psidpd_model::kernel::Real;

/// Evaluates a batch in short loops over vectors of pairs: in one long loop the processor would work on
/// one vector at a time, and wait for each of its results.
///
/// Writes quads of forces and weights to the buffers, and appends to `in_range` the pairs that the second pass needs.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers have room for the batch, and contain its i-particles.
#[inline(always)]
pub unsafe fn evaluate<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut BatchBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    batch: Batch,
    tally: &mut Tally,
) {
    // SAFETY: every step reads and writes arrays of this batch, which `BatchBuffers::reserve` has padded to vectors.
    unsafe {
        measure_pairs::<I, A, MULTISPECIES>(inputs, constants, buffers, batch);
        let mut sums = PairSums::<A::Reals>::zero();
        if TALLY {
            pair_weights(buffers, batch);
        }
        if inputs.terms.has_more() {
            further_terms::<I, A, MULTISPECIES, TALLY>(inputs, buffers, batch, &mut sums, tally);
        }
        kernel_weights::<I, A>(inputs, buffers, batch);
        forces::<I, A, MULTISPECIES, TALLY>(inputs, constants, buffers, batch, &mut sums);
        if MULTISPECIES && inputs.terms.full_cache {
            append_to_cache::<I, A, MULTISPECIES, TALLY>(inputs, buffers, &mut in_range.full_cache, batch);
        } else {
            in_range.reserve::<TALLY>(batch.count + 16);
            append_in_range::<I, A, TALLY>(inputs, buffers, in_range, batch);
        }
        if TALLY {
            buffers.counts.tallied += 1;
            tally.pair += sum_lanes(sums.pair);
            tally.excess += sum_lanes(sums.excess);
            for c in 0..6 {
                tally.virial[c] += sum_lanes(sums.virial[c]);
                tally.thermostat_virial[c] += sum_lanes(sums.thermostat[c]);
                tally.drag_virial[c] += sum_lanes(sums.drag[c]);
            }
        }
    }
}

/// The distance of padding lanes: beyond the range of every term.
const FAR: f64 = 1e18;

/// Computes distances, pairs of species and noise.
///
/// # Safety
/// The caller fulfils the contract of [`evaluate`].
#[inline(always)]
unsafe fn measure_pairs<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the search pads the lists of the batch by a vector of valid particles;
    // `BatchBuffers::reserve` makes room for whole vectors.
    unsafe {
        let packed = inputs.packed.as_ptr();
        let i_particles: *const _ = &buffers.i_particles;
        let (p_i, p_j) = (batch.i_in_batch.as_ptr(), batch.j_offsets.as_ptr());
        let p_pairs = buffers.pairs.as_mut_ptr().cast::<PairVector<A::Reals>>();
        let p_tags = [buffers.tags[0].as_mut_ptr(), buffers.tags[1].as_mut_ptr()];
        let with_velocities = constants.noise.is_some();
        let metric = constants.metric;
        let species = inputs.terms.species;
        let mut pairs = p_pairs;
        let mut k = 0;
        while k < batch.count {
            let i = <A::Reals as Reals>::Words::load_bytes(p_i.add(k));
            let j = p_j.add(k);
            let (geometry, tags) = if with_velocities || MULTISPECIES {
                A::pair_geometry::<true>(&metric, packed, i_particles, i, j, with_velocities)
            } else {
                A::pair_geometry::<false>(&metric, packed, i_particles, i, j, false)
            };
            (*pairs).geometry = geometry;
            if constants.noise.is_some() {
                tags.tags[0].store(p_tags[0].add(k));
                tags.tags[1].store(p_tags[1].add(k));
            }
            if MULTISPECIES {
                let species_i = <A::Reals as Reals>::Words::pick((*i_particles).species.as_ptr(), i);
                (*pairs).species_pair = SpeciesPair::new(species_i, tags.species_j, species);
            }
            pairs = pairs.add(1);
            k += A::Reals::LANES;
        }
        let left = batch.count % A::Reals::LANES;
        if left > 0 {
            let last = &mut *p_pairs.add(batch.count / A::Reals::LANES);
            let far =
                A::Reals::constant(FAR).where_below(A::Reals::constant(left as f64 - 0.5), constants.lane);
            let r = last.geometry.r.where_below(constants.lane, A::Reals::constant(left as f64));
            last.geometry.r = r + far;
        }
        if let Some(noise) = constants.noise {
            draw::<<I::F32 as Reals>::Words>(noise, p_tags[0], p_tags[1], batch.count);
            buffers.counts.noise += 1;
        }
    }
}

/// Computes forces of the terms other than the first soft one, with which `forces` begins.
///
/// # Safety
/// The caller fulfils the contract of [`evaluate`], and has called [`measure_pairs`].
#[inline(always)]
unsafe fn further_terms<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
    sums: &mut PairSums<A::Reals>,
    tally: &mut Tally,
) {
    // SAFETY: every term reads and writes arrays of this batch, which `BatchBuffers::reserve` has padded to vectors.
    unsafe {
        let terms = inputs.terms;
        let vectors = batch.count.div_ceil(A::Reals::LANES);
        buffers.conservative[..vectors * A::Reals::LANES].fill(A::Scalar::default());
        if !terms.scalar_fallback.is_empty() {
            scalar_fallback::<I, A, MULTISPECIES, TALLY>(inputs, buffers, batch, tally);
        }
        for term in &terms.soft[1..] {
            add_soft::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sums.pair);
        }
        for term in &terms.linear {
            add_linear::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sums.excess);
        }
        for term in &terms.spline {
            add_spline::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sums.pair);
        }
    }
}

/// Pair weights; padding lanes are zero.
#[inline(never)]
fn pair_weights<T: Scalar>(buffers: &mut BatchBuffers<T>, batch: Batch) {
    buffers.pair_weight[..batch.count].fill(T::of(batch.pair_weight()));
    // No vector has more than sixteen lanes.
    buffers.pair_weight[batch.count..batch.count + 16].fill(T::default());
}
