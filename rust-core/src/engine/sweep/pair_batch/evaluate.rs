//! What a vector's worth of particles and all their pairs do: distances, each term, and the rows that are added to
//! the particles.

use crate::engine::noise::PairNoise;
use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::many_body::full_pair_cache::append_to_cache;
use crate::engine::sweep::many_body::in_range_pairs::InRangePairs;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::pair_batch::kernel_weights::kernel_weights;
use crate::engine::sweep::pair_batch::pair_terms::{
    PairSums, SpeciesPair, add_linear, add_soft, add_spline, forces, sum_lanes,
};
use crate::engine::sweep::pair_batch::scalar_fallback::scalar_fallback;
use crate::engine::sweep::pair_batch::select_in_range::append_in_range;
use crate::engine::sweep::pair_batch::thermostat::{NOISE_UNIT, draw};
use crate::engine::sweep::simd::{Isa, Reals, Scalar, Words};
use crate::engine::tally::Tally;
use crate::model::kernel::Real;

/// Evaluates the pairs of a part, in short loops over vectors of them: in one for all the processor would see but one
/// vector at a time.
///
/// Leaves rows of forces and weights in the block; appends to `in_range` the pairs that a density reaches.
///
/// # Safety
/// The contract of `simd`; the block has the columns of the part.
#[inline(always)]
pub unsafe fn evaluate<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut PairBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    batch: Batch,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        measure_pairs::<I, A, MULTISPECIES>(data, constants, buffers, batch);
        let mut sum_laness = PairSums::<A::Reals>::zero();
        if TALLY {
            pair_weights(data, buffers, batch);
        }
        if data.terms.has_more() {
            further_terms::<I, A, MULTISPECIES, TALLY>(data, buffers, batch, &mut sum_laness, tally);
        }
        kernel_weights::<I, A>(data, buffers, batch);
        forces::<I, A, MULTISPECIES, TALLY>(data, constants, buffers, batch, &mut sum_laness);
        if MULTISPECIES && data.terms.full_cache {
            append_to_cache::<I, A, MULTISPECIES, TALLY>(data, buffers, &mut in_range.full_cache, batch);
        } else {
            in_range.reserve::<TALLY>(batch.count() + 16);
            append_in_range::<I, A, TALLY>(data, buffers, in_range, batch);
        }
        if TALLY {
            tally.pair += sum_lanes(sum_laness.pair);
            tally.excess += sum_lanes(sum_laness.excess);
            for c in 0..6 {
                tally.virial[c] += sum_lanes(sum_laness.virial[c]);
                tally.thermostat_virial[c] += sum_lanes(sum_laness.thermostat[c]);
            }
        }
    }
}

/// What is the same for all blocks of a step.
#[derive(Clone, Copy)]
pub struct StepConstants<I: Isa, A: Arithmetic<I>> {
    metric: A::Metric,
    pub noise: Option<PairNoise>,
    /// Signed words of noise times this are `ξ dt^{−1/2}`.
    pub noise_scale: A::Reals,
    /// 0, 1, 2 …
    lane: A::Reals,
}

impl<I: Isa, A: Arithmetic<I>> StepConstants<I, A> {
    #[inline(always)]
    pub unsafe fn new(data: &PassData<A::Scalar, A::PackedParticle>) -> Self {
        // SAFETY: the contract of `simd`.
        unsafe {
            let thermostat = data.thermostat.filter(|_| data.terms.thermostat.is_some());
            let (noise, inverse_root_dt) = thermostat.unzip();
            let noise_scale = A::Reals::constant(NOISE_UNIT * inverse_root_dt.unwrap_or_default());
            let mut lane = [A::Scalar::default(); 16];
            for (k, lane) in lane.iter_mut().enumerate() {
                *lane = A::Scalar::of(k as f64);
            }
            StepConstants {
                metric: A::metric(data.geometry),
                noise,
                noise_scale,
                lane: A::Reals::load(lane.as_ptr()),
            }
        }
    }
}

/// Where lanes behind the last pair are: out of reach of everything.
const FAR: f64 = 1e18;

/// Distances, kinds and noise of the pairs.
#[inline(always)]
unsafe fn measure_pairs<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the contract of `simd`; blocks have room for all pairs and a vector behind.
    unsafe {
        let packed = data.packed.as_ptr();
        let i_particles: *const _ = &buffers.i_particles;
        let p_i = buffers.i_in_batch.as_ptr().add(batch.pairs[0]);
        let p_j = buffers.j_offsets.as_ptr().add(batch.pairs[0]);
        let count = batch.count();
        let p_pairs = buffers.pairs.as_mut_ptr().cast::<PairVector<A::Reals>>();
        let p_tags = [buffers.tags[0].as_mut_ptr(), buffers.tags[1].as_mut_ptr()];
        let with_velocities = constants.noise.is_some();
        let metric = constants.metric;
        let species = data.terms.species;
        let mut pairs = p_pairs;
        let mut k = 0;
        while k < count {
            let i_in_batch = <A::Reals as Reals>::Words::load_bytes(p_i.add(k));
            let j_offsets = p_j.add(k);
            let (geometry, tags) = if with_velocities || MULTISPECIES {
                A::pair_geometry::<true>(&metric, packed, i_particles, i_in_batch, j_offsets, with_velocities)
            } else {
                A::pair_geometry::<false>(&metric, packed, i_particles, i_in_batch, j_offsets, false)
            };
            (*pairs).geometry = geometry;
            if with_velocities {
                tags.tags[0].store(p_tags[0].add(k));
                tags.tags[1].store(p_tags[1].add(k));
            }
            if MULTISPECIES {
                let species_i = <A::Reals as Reals>::Words::pick((*i_particles).species.as_ptr(), i_in_batch);
                (*pairs).species_pair = SpeciesPair::new(species_i, tags.species_j, species);
            }
            pairs = pairs.add(1);
            k += A::Reals::LANES;
        }
        let left = count % A::Reals::LANES;
        if left > 0 {
            let last = &mut *p_pairs.add(count / A::Reals::LANES);
            let far =
                A::Reals::constant(FAR).where_below(A::Reals::constant(left as f64 - 0.5), constants.lane);
            last.geometry.r =
                last.geometry.r.where_below(constants.lane, A::Reals::constant(left as f64)) + far;
        }
        if let Some(noise) = constants.noise {
            draw::<<I::F32 as Reals>::Words>(noise, p_tags[0], p_tags[1], count);
        }
    }
}

/// The forces of terms beyond the first soft one, which `forces` begins with.
#[inline(always)]
unsafe fn further_terms<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
    sum_laness: &mut PairSums<A::Reals>,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let terms = data.terms;
        let vectors = batch.count().div_ceil(A::Reals::LANES);
        buffers.conservative[..vectors * A::Reals::LANES].fill(A::Scalar::default());
        if !terms.scalar_fallback.is_empty() {
            scalar_fallback::<I, A, MULTISPECIES, TALLY>(data, buffers, batch, tally);
        }
        for term in terms.other_soft() {
            add_soft::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sum_laness.pair);
        }
        for term in &terms.linear {
            add_linear::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sum_laness.excess);
        }
        for term in &terms.spline {
            add_spline::<A::Reals, MULTISPECIES, TALLY>(term, buffers, vectors, &mut sum_laness.pair);
        }
    }
}

/// How much of each pair counts here, nothing beyond the last.
#[inline(never)]
fn pair_weights<T: Scalar>(
    data: &PassData<T, impl crate::engine::sweep::ground::arithmetic::PackedParticle>,
    buffers: &mut PairBuffers<T>,
    batch: Batch,
) {
    let count = batch.count();
    for p in 0..count {
        let [i, j] = buffers.pair(batch, p);
        buffers.pair_weight[p] = T::of(data.pair_weight(i, j));
    }
    // No vector has more lanes.
    buffers.pair_weight[count..count + 16].fill(T::default());
}
