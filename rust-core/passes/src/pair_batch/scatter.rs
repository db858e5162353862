//! Adds forces and weights of pairs to the accumulators of both particles.

use super::accumulators::{PlaneAccumulators, PlaneSums};
use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::inputs::PairInputs;
use crate::ground::arithmetic::{Arithmetic, PackedParticle, PairVector};
use crate::ground::species_pairs::table_entry;
use crate::simd::{Isa, OFFSET_BITS, Quad, Reals};
use psidpd_model::kernel::Real;

/// Pairs sorted by their i-particles.
#[derive(Clone, Copy)]
pub struct ScatterPairs {
    /// The j-particle of each pair: its index shifted by `OFFSET_BITS`; the list has one more entry after the last pair.
    pub j_offsets: *const u32,
    /// Index of the first pair of each i-particle, and one past the last pair of the last one; the first index may be any.
    pub begin: *const u32,
    /// First i-particle.
    pub first: usize,
    pub members: usize,
    /// Whether the j-particles are ghosts: nothing is added to them.
    pub with_ghosts: bool,
}

impl From<Batch<'_>> for ScatterPairs {
    #[inline(always)]
    fn from(batch: Batch) -> ScatterPairs {
        let Batch { first, members, with_ghosts, .. } = batch;
        let (j_offsets, begin) = (batch.j_offsets.as_ptr(), batch.begin.as_ptr());
        ScatterPairs { j_offsets, begin, first, members, with_ghosts }
    }
}

/// Adds the forces of a batch, and the weights if there is one density.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The sums are those of the batch's plane, and the buffers contain its quads.
#[inline(always)]
pub unsafe fn scatter_forces<I: Isa, A: Arithmetic<I>>(
    sums: PlaneSums,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the half stencil of the search lists only particles of the plane and of the next.
    unsafe {
        let to = sums.forces();
        let quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        // The memory of the pairs, which is in the cache, is reused unless weights still need it.
        let running = if sums.variables > 1 {
            buffers.running.as_mut_ptr().cast()
        } else {
            buffers.pairs.as_mut_ptr().cast()
        };
        // The loop subtracts the quad from the j-particle, so that the weight in it is negative.
        scatter_quads::<I, A>(to, quads, quads, running, [1.0, 1.0, 1.0, -1.0], batch.into());
    }
}

/// Adds `i_quads` times `sign` to the i-particles of pairs, and subtracts `quads` from the j-particles unless they are ghosts.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The accumulators include both particles of each pair;
/// there is room for a quad and a running sum after the last pair.
#[inline(always)]
pub unsafe fn scatter_quads<I: Isa, A: Arithmetic<I>>(
    to: PlaneAccumulators,
    quads: *mut A::Scalar,
    i_quads: *mut A::Scalar,
    running: *mut f64,
    sign: [f64; 4],
    pairs: ScatterPairs,
) {
    // SAFETY: the search lists particles of the plane and of the next, whose accumulators the scheduler
    // has made; `BatchBuffers::reserve` and `second_pass_cached` leave room after the last pair.
    unsafe {
        let sign = I::Quad::load(sign.as_ptr());
        let ScatterPairs { j_offsets, begin, first, members, with_ghosts } = pairs;
        // One loop runs over all pairs: the processor would mispredict the end of a loop for each
        // i-particle. The sum of an i-particle is the difference of two running sums, of which every
        // second one is stored. A zero follows an odd number of pairs.
        let zeroth = *begin as usize;
        let count = *begin.add(members) as usize - zeroth;
        if with_ghosts {
            return add_to_first::<I, A>(to, i_quads, running, sign, pairs);
        }
        quads.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        i_quads.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        let mut sum = I::Quad::zero();
        let mut p = 0;
        while p < count {
            sum.store(running.add(2 * p));
            let one = A::load_quad(quads.add(4 * p));
            let at = to.at(*j_offsets.add(p) as usize);
            I::Quad::load(at).sub(one).store(at);
            let next = A::load_quad(quads.add(4 * p + 4));
            let at = to.at(*j_offsets.add(p + 1) as usize);
            I::Quad::load(at).sub(next).store(at);
            let two = if i_quads == quads {
                one.add(next)
            } else {
                A::load_quad(i_quads.add(4 * p)).add(A::load_quad(i_quads.add(4 * p + 4)))
            };
            sum = sum.add(two);
            p += 2;
        }
        sum.store(running.add(2 * p));
        let mut before = I::Quad::zero();
        let mut m = 0;
        while m < members {
            let end = *begin.add(m + 1) as usize - zeroth;
            let even = end & !1;
            let odd = A::load_quad(i_quads.add(4 * even)).mul(I::Quad::splat((end & 1) as f64));
            let all = I::Quad::load(running.add(2 * even)).add(odd);
            add_quad(to.at((first + m) << OFFSET_BITS), all.sub(before).mul(sign));
            before = all;
            m += 1;
        }
    }
}

/// Adds `i_quads` times `sign` to the i-particles of pairs.
///
/// # Safety
/// As that of [`scatter_quads`].
#[inline(always)]
unsafe fn add_to_first<I: Isa, A: Arithmetic<I>>(
    to: PlaneAccumulators,
    i_quads: *const A::Scalar,
    running: *mut f64,
    sign: I::Quad,
    ScatterPairs { begin, first, members, .. }: ScatterPairs,
) {
    // SAFETY: the caller promises quads of all pairs, with room for as many running sums and one more.
    unsafe {
        let zeroth = *begin as usize;
        let count = *begin.add(members) as usize - zeroth;
        let mut sum = I::Quad::zero();
        let mut p = 0;
        while p < count {
            sum = sum.add(A::load_quad(i_quads.add(4 * p)));
            p += 1;
            sum.store(running.add(4 * p));
        }
        I::Quad::zero().store(running);
        let mut before = I::Quad::zero();
        let mut m = 0;
        while m < members {
            let all = I::Quad::load(running.add(4 * (*begin.add(m + 1) as usize - zeroth)));
            add_quad(to.at((first + m) << OFFSET_BITS), all.sub(before).mul(sign));
            before = all;
            m += 1;
        }
    }
}

/// Adds a quad to an accumulator.
///
/// # Safety
/// The caller fulfils the contract of `simd`, and passes the address of four numbers.
#[inline(always)]
pub unsafe fn add_quad<Q: Quad>(p: *mut f64, x: Q) {
    // SAFETY: the caller promises four numbers at `p`, as `PlaneAccumulators::at` returns.
    unsafe { Q::load(p).add(x).store(p) }
}

/// The weights of one variable.
#[derive(Clone, Copy)]
struct WeightSource<T> {
    /// The negative weights of its density.
    weights: *const T,
    /// Tables over pairs of species: 1 where the i-particle, or the j-particle, is of the variable's species.
    is_species: [*const T; 2],
}

/// Adds weights where there are several variables: one for each density and species of the
/// other particle, four in each quad.
///
/// # Safety
/// The caller fulfils the contract of [`scatter_forces`]; the buffers contain the weights of the batch.
#[inline(always)]
pub unsafe fn scatter_weights<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool>(
    inputs: &PairInputs<A::Scalar, impl PackedParticle>,
    sums: PlaneSums,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the accumulators are as in `scatter_forces`; `BatchBuffers::reserve` pads weights and
    // pairs of species to whole vectors.
    unsafe {
        let terms = inputs.terms;
        let quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        let i_quads = if MULTISPECIES { buffers.i_quads.as_mut_ptr().cast() } else { quads };
        let vectors = batch.count.div_ceil(A::Reals::LANES);
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        let fits_vector = terms.species * terms.species <= A::Reals::LANES;
        let zero = A::Reals::constant(0.0);
        let mut quad = 0;
        while quad < sums.density_quads() {
            let variables = 4.min(sums.variables - 4 * quad);
            let none = WeightSource { weights: std::ptr::null(), is_species: [std::ptr::null(); 2] };
            let mut sources = [none; 4];
            let mut c = 0;
            while c < 4 {
                // The last variable is repeated to fill its quad.
                let variable = 4 * quad + c.min(variables - 1);
                let [is_i, is_j] = terms.is_species.get_unchecked(variable % terms.species);
                sources[c].is_species = [is_i.as_ptr(), is_j.as_ptr()];
                sources[c].weights = buffers.kernel_weights.get_unchecked(variable / terms.species).as_ptr();
                c += 1;
            }
            let mut v = 0;
            while v < vectors {
                let k = v * A::Reals::LANES;
                let (mut to_j, mut to_i) = ([zero; 4], [zero; 4]);
                let mut c = 0;
                while c < 4 {
                    if c < variables {
                        let weight = A::Reals::load(sources[c].weights.add(k));
                        to_j[c] = weight;
                        if MULTISPECIES {
                            let species_pair = (*pairs.add(v)).species_pair.0;
                            let [is_i, is_j] = sources[c].is_species;
                            let is_i = table_entry::<A::Reals>(is_i, species_pair, fits_vector);
                            let is_j = table_entry::<A::Reals>(is_j, species_pair, fits_vector);
                            to_j[c] = weight * is_i;
                            to_i[c] = weight * is_j;
                        }
                    }
                    c += 1;
                }
                A::Reals::store_transposed(to_j, quads.add(4 * k));
                if MULTISPECIES {
                    A::Reals::store_transposed(to_i, i_quads.add(4 * k));
                }
                v += 1;
            }
            // Weights are negative, so that the loop subtracts quads from both particles.
            let to = sums.densities(quad);
            let running = buffers.running.as_mut_ptr().cast();
            scatter_quads::<I, A>(to, quads, i_quads, running, [-1.0; 4], batch.into());
            quad += 1;
        }
    }
}
