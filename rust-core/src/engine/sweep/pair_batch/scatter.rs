//! What pairs do, added to the accumulators of their particles.

use crate::engine::sweep::ground::arithmetic::OFFSET_BITS;
use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::simd::{Isa, Quad, Reals};
use crate::model::kernel::Real;

/// An accumulator: a force, and the density if there is one variable; aligned so that none straddles lines of the
/// cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Accumulator(pub [f64; 4]);

const _: () = assert!(size_of::<Accumulator>() == 1 << OFFSET_BITS);

/// Accumulators of a plane: for each particle some rows of four numbers.
#[derive(Clone, Copy)]
pub struct PlaneAccumulators {
    /// That of particle 0, were it of the plane.
    base: *mut f64,
    /// Rows of each particle, and which is meant.
    quads_per_particle: usize,
    quad: usize,
}

impl PlaneAccumulators {
    /// One row each.
    #[inline(always)]
    pub fn new(base: *mut f64) -> PlaneAccumulators {
        PlaneAccumulators { base, quads_per_particle: 1, quad: 0 }
    }

    /// The row of the particle at 32 times `offset`.
    #[inline(always)]
    unsafe fn at(self, offset: usize) -> *mut f64 {
        // SAFETY: the caller's.
        unsafe { self.base.byte_add(offset * self.quads_per_particle).add(4 * self.quad) }
    }
}

/// Pairs of particles that follow each other.
#[derive(Clone, Copy)]
pub struct ScatterPairs {
    /// 32 times the place of the second particle of each pair, and of any particle of the plane behind the last.
    pub j_offsets: *const u32,
    /// Before which pair those of each particle begin, and those of the last end; counted from any number.
    pub begin: *const u32,
    /// The first particle, and how many.
    pub first: usize,
    pub members: usize,
}

impl ScatterPairs {
    /// Those in hand.
    #[inline(always)]
    unsafe fn of<T>(buffers: &PairBuffers<T>, batch: Batch) -> ScatterPairs {
        let [first, last] = batch.slots;
        // SAFETY: the caller's.
        let (j_offsets, begin) =
            unsafe { (buffers.j_offsets.as_ptr().add(batch.pairs[0]), buffers.begin.as_ptr().add(first)) };
        ScatterPairs { j_offsets, begin, first: batch.first, members: last - first }
    }
}

/// Adds the rows of pairs to both particles of each.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(
    sums: SharedPtr<f64>,
    variables: usize,
    offset: isize,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the plane and the next.
    unsafe {
        let to = PlaneAccumulators::new(sums.0.offset(4 * offset));
        let quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        // The second particle gets minus the row, so the weight in it is negative.
        // Nobody asks any more what pairs are, unless there are weights to come.
        let running = if variables > 1 {
            buffers.running.as_mut_ptr().cast()
        } else {
            buffers.pairs.as_mut_ptr().cast()
        };
        scatter_quads::<I, A>(
            to,
            quads,
            quads,
            running,
            [1.0, 1.0, 1.0, -1.0],
            ScatterPairs::of(buffers, batch),
        );
    }
}

/// Adds `i_quads` rows times `sign` to the first particles of pairs, minus `quads` to the second ones.
///
/// # Safety
/// The contract of `simd`; accumulators are there, and room for a row and a sum behind the last pair.
#[inline(always)]
pub unsafe fn scatter_quads<I: Isa, A: Arithmetic<I>>(
    to: PlaneAccumulators,
    quads: *mut A::Scalar,
    i_quads: *mut A::Scalar,
    running: *mut f64,
    sign: [f64; 4],
    pairs: ScatterPairs,
) {
    // SAFETY: the caller's.
    unsafe {
        let sign = I::Quad::load(sign.as_ptr());
        let ScatterPairs { j_offsets, begin, first, members } = pairs;
        // One loop over all, not one for each member, none of whose ends is to be foreseen: what a member gets is
        // the difference of two running sums, of which every other one is kept. Behind an odd number nothing follows.
        let zeroth = *begin as usize;
        let count = *begin.add(members) as usize - zeroth;
        quads.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        i_quads.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        let sums = running;
        let mut sum = I::Quad::zero();
        let mut p = 0;
        while p < count {
            sum.store(sums.add(2 * p));
            let row = A::load_quad(quads.add(4 * p));
            let at = to.at(*j_offsets.add(p) as usize);
            I::Quad::load(at).sub(row).store(at);
            let next = A::load_quad(quads.add(4 * p + 4));
            let at = to.at(*j_offsets.add(p + 1) as usize);
            I::Quad::load(at).sub(next).store(at);
            let two = if i_quads == quads {
                row.add(next)
            } else {
                A::load_quad(i_quads.add(4 * p)).add(A::load_quad(i_quads.add(4 * p + 4)))
            };
            sum = sum.add(two);
            p += 2;
        }
        sum.store(sums.add(2 * p));
        let mut before = I::Quad::zero();
        let mut m = 0;
        while m < members {
            let end = *begin.add(m + 1) as usize - zeroth;
            let even = end & !1;
            let odd = A::load_quad(i_quads.add(4 * even)).mul(I::Quad::splat((end & 1) as f64));
            let all = I::Quad::load(sums.add(2 * even)).add(odd);
            add_quad(to.at((first + m) << OFFSET_BITS), all.sub(before).mul(sign));
            before = all;
            m += 1;
        }
    }
}

/// Adds a row to an accumulator.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn add_quad<Q: Quad>(p: *mut f64, x: Q) {
    // SAFETY: the contract of `simd`.
    unsafe { Q::load(p).add(x).store(p) }
}

/// `table[index[k]]` in lane `k`; `fits_vector` if the table is a vector. A function, as closures are compiled for the least that
/// any processor has if they are not inlined.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn table_entry<R: Reals>(table: *const R::Scalar, index: R::Words, fits_vector: bool) -> R {
    // SAFETY: the caller's.
    unsafe { if fits_vector { R::pick(table, index) } else { R::lookup(table, index) } }
}

/// What is added for a column.
#[derive(Clone, Copy)]
struct WeightOf<T> {
    /// Minus the weights of its density.
    kernel_weights: *const T,
    /// Whether the first particle of a pair is of its species, and the second: tables.
    is_species: [*const T; 2],
}

/// Adds weights where there are several densities or species: a column for each density and species of the other
/// particle, four of them to a row.
#[inline(always)]
pub unsafe fn scatter_kernel_weights<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    offset: isize,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: as `scatter`; there are weights and kinds of whole vectors.
    unsafe {
        let terms = data.terms;
        let quads_per_particle = data.variables.div_ceil(4);
        let base = data.densities.0.offset((4 * quads_per_particle) as isize * offset);
        let quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        let i_quads = if MULTISPECIES { buffers.i_quads.as_mut_ptr().cast() } else { quads };
        let vectors = batch.count().div_ceil(A::Reals::LANES);
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        let fits_vector = terms.species * terms.species <= A::Reals::LANES;
        let zero = A::Reals::constant(0.0);
        let mut quad = 0;
        while quad < quads_per_particle {
            let variables = 4.min(data.variables - 4 * quad);
            let mut of =
                [WeightOf { kernel_weights: std::ptr::null(), is_species: [std::ptr::null(); 2] }; 4];
            let mut c = 0;
            while c < 4 {
                // Behind the last there is the last again.
                let variable = 4 * quad + c.min(variables - 1);
                let [is_first, is_second] = terms.is_species.get_unchecked(variable % terms.species);
                of[c].is_species = [is_first.as_ptr(), is_second.as_ptr()];
                of[c].kernel_weights =
                    buffers.kernel_weights.get_unchecked(variable / terms.species).as_ptr();
                c += 1;
            }
            let mut v = 0;
            while v < vectors {
                let k = v * A::Reals::LANES;
                let (mut to_second, mut to_first) = ([zero; 4], [zero; 4]);
                let mut c = 0;
                while c < 4 {
                    if c < variables {
                        let kernel_weights = A::Reals::load(of[c].kernel_weights.add(k));
                        to_second[c] = kernel_weights;
                        if MULTISPECIES {
                            let species_pair = (*pairs.add(v)).species_pair.0;
                            let [is_first, is_second] = of[c].is_species;
                            let is_first = table_entry::<A::Reals>(is_first, species_pair, fits_vector);
                            let is_second = table_entry::<A::Reals>(is_second, species_pair, fits_vector);
                            to_second[c] = kernel_weights * is_first;
                            to_first[c] = kernel_weights * is_second;
                        }
                    }
                    c += 1;
                }
                A::Reals::store_transposed(to_second, quads.add(4 * k));
                if MULTISPECIES {
                    A::Reals::store_transposed(to_first, i_quads.add(4 * k));
                }
                v += 1;
            }
            // Both get minus a row: weights are negative.
            let to = PlaneAccumulators { base, quads_per_particle, quad };
            let running = buffers.running.as_mut_ptr().cast();
            scatter_quads::<I, A>(to, quads, i_quads, running, [-1.0; 4], ScatterPairs::of(buffers, batch));
            quad += 1;
        }
    }
}
