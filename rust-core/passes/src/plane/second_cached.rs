//! The second pass over the full pair cache: whole forces, a vector of pairs at a time.

use super::data::PassData;
use super::slopes::SLOPES_PER_BLOCK;
use crate::ground::arithmetic::Arithmetic;
use crate::ground::species_pairs::table_entry;
use crate::pair_batch::accumulators::{Accumulator, PlaneSums};
use crate::pair_batch::buffers::CacheLines;
use crate::pair_batch::full_pair_cache::{
    CachedBatch, FORCE, FullPairCache, I_CODE_BITS, SEPARATION, WEIGHT_GRADIENT,
};
use crate::pair_batch::pair_terms::{add_virial, sum_lanes};
use crate::pair_batch::scatter::{ScatterPairs, scatter_quads};
use crate::simd::{Isa, Reals, Words};
use psidpd_model::kernel::Real;

/// Does the second pass over the pairs of a plane, or over its rim `with_ghosts`, and adds to the virial with `TALLY`.
///
/// # Safety
/// The caller fulfils the contract of [`second_pass`](super::second::second_pass).
#[inline(always)]
pub unsafe fn second_pass_cached<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    sums: PlaneSums,
    cache: &FullPairCache<A::Scalar>,
    with_ghosts: bool,
    virial: &mut [f64; 6],
) {
    // SAFETY: scratch arrays have room for whole vectors of the largest batch, and a quad more;
    // `append_to_cache` stored the pairs in this evaluation, and the scheduler has waited for the slopes.
    unsafe {
        let to = sums.forces();
        let room = cache.most / 16 + 2;
        let mut quads: Vec<CacheLines<A::Scalar>> = vec![CacheLines::default(); room];
        let mut running: Vec<Accumulator> = vec![Accumulator::default(); 16 * room];
        let mut factors: Vec<CacheLines<A::Scalar>> = vec![CacheLines::default(); room];
        let quads = quads.as_mut_ptr().cast::<A::Scalar>();
        let factors = factors.as_mut_ptr().cast::<A::Scalar>();
        let variables = sums.variables;
        for batch in &cache.batches {
            let count = batch.begin[batch.members as usize] as usize;
            let pairs = CachedPairs { cache, batch, vectors: count.div_ceil(A::Reals::LANES) };
            if variables <= 4 && data.inputs.terms.species <= 2 {
                find_factors::<I, A, MULTISPECIES, 4>(data, &pairs, [0, variables], factors);
            } else {
                let mut first = 0;
                while first < variables {
                    find_factors::<I, A, MULTISPECIES, SLOPES_PER_BLOCK>(
                        data,
                        &pairs,
                        [first, variables],
                        factors,
                    );
                    first += SLOPES_PER_BLOCK;
                }
            }
            whole_forces::<A::Reals, TALLY>(&pairs, factors, quads, virial);
            let listed = ScatterPairs {
                j_offsets: pairs.j_offsets(),
                begin: batch.begin.as_ptr(),
                first: batch.first as usize,
                members: batch.members as usize,
                with_ghosts,
            };
            let running = running.as_mut_ptr().cast();
            scatter_quads::<I, A>(to, quads, quads, running, [1.0, 1.0, 1.0, 0.0], listed);
        }
    }
}

/// The pairs of one batch in the cache.
struct CachedPairs<'a, T> {
    cache: &'a FullPairCache<T>,
    batch: &'a CachedBatch,
    vectors: usize,
}

impl<T> CachedPairs<'_, T> {
    /// The first element of a field of the batch.
    ///
    /// # Safety
    /// The cache has this field.
    #[inline(always)]
    unsafe fn field(&self, field: usize) -> *const T {
        // SAFETY: every field contains the vectors of a batch; the caller promises that the field exists.
        unsafe { self.cache.fields.get_unchecked(field).as_ptr().add(self.batch.vector).cast() }
    }

    #[inline(always)]
    fn j_offsets(&self) -> *const u32 {
        // SAFETY: `append_to_cache` has written the vectors of the batch to every field.
        unsafe { self.cache.j_offsets.as_ptr().add(self.batch.vector).cast() }
    }

    #[inline(always)]
    fn codes(&self) -> *const u32 {
        // SAFETY: `append_to_cache` has written the vectors of the batch to every field.
        unsafe { self.cache.codes.as_ptr().add(self.batch.vector).cast() }
    }
}

/// The factor of a slope.
#[derive(Clone, Copy)]
struct SlopeFactor<T> {
    /// Factor `−w′/r` of its density.
    weight_gradient: *const T,
    /// Tables over pairs of species: 1 where the i-particle, or the j-particle, is of the slope's species.
    is_species: [*const T; 2],
}

/// Slopes of the i-particles of a batch, slope by slope.
#[repr(C, align(64))]
struct ISlopes<T>([[T; 16]; SLOPES_PER_BLOCK]);

/// Adds `Σ (∂ψ_i + ∂ψ_j) (−w′/r)` over up to `N` slopes, beginning with `first`, to the factors of
/// pairs; sets them if `first` is zero. Each particle has a slope for the species of the other. With `N
/// = 4` there are at most two species.
///
/// # Safety
/// The caller fulfils the contract of [`second_pass_cached`]; `factors` has room for the vectors of the batch.
#[inline(always)]
unsafe fn find_factors<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const N: usize>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    pairs: &CachedPairs<A::Scalar>,
    [first, variables]: [usize; 2],
    factors: *mut A::Scalar,
) {
    // SAFETY: the loop reads slopes of existing i-particles only, and j-particles are of the plane or
    // the next one; the caller promises the rest.
    unsafe {
        let zero = A::Reals::constant(0.0);
        let terms = data.inputs.terms;
        let species = terms.species;
        let count = N.min(variables - first);
        let slopes = data.slopes.packed.at(first / SLOPES_PER_BLOCK * data.slopes.stride).cast_const();
        let mut i_slopes = ISlopes([[A::Scalar::default(); 16]; SLOPES_PER_BLOCK]);
        let own_slopes = slopes.add(SLOPES_PER_BLOCK * pairs.batch.first as usize);
        let own = A::load_transposed_in_order(own_slopes, pairs.batch.members as usize);
        let fits_vector = species * species <= A::Reals::LANES;
        let none = SlopeFactor { weight_gradient: std::ptr::null(), is_species: [std::ptr::null(); 2] };
        let mut of = [none; SLOPES_PER_BLOCK];
        let mut c = 0;
        while c < N {
            own[c].store(i_slopes.0[c].as_mut_ptr());
            // The last slope is repeated to fill the block.
            let at = first + c.min(count - 1);
            let [is_i, is_j] = terms.is_species.get_unchecked(at % species);
            of[c].is_species = [is_i.as_ptr(), is_j.as_ptr()];
            of[c].weight_gradient = pairs.field(WEIGHT_GRADIENT + at / species);
            c += 1;
        }
        let mut v = 0;
        while v < pairs.vectors {
            let k = v * A::Reals::LANES;
            let code = <A::Reals as Reals>::Words::load(pairs.codes().add(k));
            let species_pair = code.shift_right::<I_CODE_BITS>();
            let j_slopes = if N == 4 {
                A::load_transposed::<false>(slopes, pairs.j_offsets().add(k))
            } else {
                A::load_transposed::<true>(slopes, pairs.j_offsets().add(k))
            };
            let mut factor = if first == 0 { zero } else { A::Reals::load(factors.add(k)) };
            if MULTISPECIES && N == 4 {
                // The sum over the densities of each species is computed first, and then selected by species.
                let (mut from_i, mut from_j) = ([zero; 2], [zero; 2]);
                let mut c = 0;
                while c < N {
                    if c < count {
                        let gradient = A::Reals::load(of[c].weight_gradient.add(k));
                        let i_slope = A::Reals::pick(i_slopes.0[c].as_ptr(), code);
                        from_i[c % 2] = i_slope.mul_add(gradient, from_i[c % 2]);
                        from_j[c % 2] = j_slopes[c].mul_add(gradient, from_j[c % 2]);
                    }
                    c += 1;
                }
                let mut s = 0;
                while s < 2 {
                    let [is_i, is_j] = of[s].is_species;
                    factor = from_j[s].mul_add(A::Reals::pick(is_i, species_pair), factor);
                    factor = from_i[s].mul_add(A::Reals::pick(is_j, species_pair), factor);
                    s += 1;
                }
            } else {
                let mut c = 0;
                while c < N {
                    if c < count {
                        let gradient = A::Reals::load(of[c].weight_gradient.add(k));
                        let i_slope = A::Reals::pick(i_slopes.0[c].as_ptr(), code);
                        let slope = if MULTISPECIES {
                            let [is_i, is_j] = of[c].is_species;
                            let is_i = table_entry::<A::Reals>(is_i, species_pair, fits_vector);
                            let is_j = table_entry::<A::Reals>(is_j, species_pair, fits_vector);
                            i_slope.mul_add(is_j, j_slopes[c] * is_i)
                        } else {
                            i_slope + j_slopes[c]
                        };
                        factor = slope.mul_add(gradient, factor);
                    }
                    c += 1;
                }
            }
            factor.store(factors.add(k));
            v += 1;
        }
    }
}

/// Writes quads of whole forces, and adds the virial of the many-body part.
///
/// # Safety
/// The caller fulfils the contract of `simd`; `factors` and `quads` have room for the vectors of the batch.
#[inline(always)]
unsafe fn whole_forces<R: Reals, const TALLY: bool>(
    pairs: &CachedPairs<R::Scalar>,
    factors: *const R::Scalar,
    quads: *mut R::Scalar,
    virial: &mut [f64; 6],
) {
    // SAFETY: a batch begins at a vector of its own in every field, and `quads` and `factors` are as
    // long as the largest batch; with `TALLY` the last field contains pair weights.
    unsafe {
        let [x, y, z] = [0, 1, 2].map(|c| pairs.field(SEPARATION + c));
        let force = pairs.field(FORCE);
        let weight = if TALLY { pairs.field(pairs.cache.fields.len() - 1) } else { std::ptr::null() };
        let zero = R::constant(0.0);
        let mut sums = [zero; 6];
        let mut v = 0;
        while v < pairs.vectors {
            let k = v * R::LANES;
            let factor = R::load(factors.add(k));
            let d = [R::load(x.add(k)), R::load(y.add(k)), R::load(z.add(k))];
            let whole = R::load(force.add(k)) + factor;
            R::store_transposed([whole * d[0], whole * d[1], whole * d[2], zero], quads.add(4 * k));
            if TALLY {
                add_virial(factor * R::load(weight.add(k)), d, &mut sums);
            }
            v += 1;
        }
        if TALLY {
            for c in 0..6 {
                virial[c] += sum_lanes(sums[c]);
            }
        }
    }
}
