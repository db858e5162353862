//! Pairs of which everything is kept for the second pass: with several densities or species, it finds the whole force of a
//! pair, and adds it to both particles once.
//!
//! The first pass then adds weights alone. Nothing is gained for one density: its weight goes with the force.

use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::terms::Pass;
use crate::engine::sweep::many_body::in_range_pairs::make_room;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::{CacheLines, PairBuffers};
use crate::engine::sweep::pair_batch::pair_terms::{add_virial, sum_lanes};
use crate::engine::sweep::pair_batch::scatter::{
    Accumulator, PlaneAccumulators, ScatterPairs, scatter_quads, table_entry,
};
use crate::engine::sweep::simd::{Isa, Reals, Scalar, Words};
use crate::model::kernel::{Real, Shape, ShapeVisitor};

/// What the first pass of a plane leaves for the second: columns of pairs, those of a vector's worth of first particles
/// after those of another, each from a whole vector on.
#[derive(Debug, Clone, Default)]
pub struct FullPairCache<T> {
    /// `r_i − r_j`; the force that needs no density, over `r`; `−w′(r)/r` of each density; and the share of each pair, if
    /// virials are wanted.
    fields: Vec<Vec<CacheVector<T>>>,
    /// The second particle: 32 times its place in the order of cells.
    j_offsets: Vec<CacheVector<u32>>,
    /// The first particle, a number in its part; with several species also 16 times the pair of species.
    codes: Vec<CacheVector<u32>>,
    batches: Vec<CachedBatch>,
    /// Vectors that each column has, and has room for.
    end: usize,
    room: usize,
    /// Most pairs of a part.
    most: usize,
}

/// Columns of `r_i − r_j`, of forces, and the first of the densities.
const SEPARATION: usize = 0;
const FORCE: usize = 3;
const WEIGHT_GRADIENT: usize = 4;

/// Sixteen numbers.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct CacheVector<T>([T; 16]);

/// A vector's worth of first particles.
#[derive(Debug, Clone, Copy)]
struct CachedBatch {
    /// The first of them, and how many.
    first: u32,
    members: u32,
    /// Before which pair those of each begin, and those of the last end.
    begin: [u32; 17],
    /// The vector that holds the first pair.
    vector: usize,
}

/// The bits of a code that tell the first particle.
const I_CODE_BITS: u32 = 4;

/// Where vector `end` goes, one past the last.
#[inline(always)]
unsafe fn at<T>(field: &mut Vec<CacheVector<T>>, end: usize) -> *mut T {
    // SAFETY: the caller's.
    unsafe { field.as_mut_ptr().add(end).cast() }
}

impl<T: Scalar> FullPairCache<T> {
    pub fn clear(&mut self, passes: usize, tally: bool) {
        self.fields.resize_with(WEIGHT_GRADIENT + passes + tally as usize, Vec::new);
        self.fields.iter_mut().for_each(Vec::clear);
        self.j_offsets.clear();
        self.codes.clear();
        self.batches.clear();
        (self.end, self.most) = (0, 0);
        self.find_room();
    }

    fn find_room(&mut self) {
        let fields = self.fields.iter().map(Vec::capacity).min().unwrap_or(0);
        self.room = fields.min(self.j_offsets.capacity()).min(self.codes.capacity());
    }

    /// Makes room for `more` pairs, and a vector behind.
    #[inline(always)]
    unsafe fn reserve(&mut self, more: usize) {
        let more = more / 16 + 2;
        if self.room - self.end < more {
            // SAFETY: that many have been written.
            unsafe { self.grow(more) }
        }
    }

    #[cold]
    #[inline(never)]
    unsafe fn grow(&mut self, more: usize) {
        // SAFETY: the caller's.
        unsafe {
            for field in &mut self.fields {
                field.set_len(self.end);
                make_room(field, more);
            }
            for field in [&mut self.j_offsets, &mut self.codes] {
                field.set_len(self.end);
                make_room(field, more);
            }
        }
        self.find_room();
    }

    /// The end of a column, which there is.
    #[inline(always)]
    unsafe fn field(&mut self, field: usize) -> *mut T {
        // SAFETY: the caller's.
        unsafe { at(self.fields.get_unchecked_mut(field), self.end) }
    }

    /// Counts the pairs that were written behind the last, and something behind them.
    #[inline(always)]
    unsafe fn add(&mut self, buffers: &PairBuffers<T>, batch: Batch) {
        // SAFETY: the caller's.
        unsafe {
            let [slot, last] = batch.slots;
            let mut begin = [0; 17];
            let mut m = 1;
            while m <= last - slot {
                begin[m] = *buffers.begin.get_unchecked(slot + m) - batch.pairs[0] as u32;
                m += 1;
            }
            let members = (last - slot) as u32;
            make_room(&mut self.batches, 1);
            self.batches.push(CachedBatch { first: batch.first as u32, members, begin, vector: self.end });
        }
        self.most = self.most.max(batch.count());
        self.end += batch.count() / 16 + 1;
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(|field| field.capacity() * size_of::<CacheVector<T>>()).sum::<usize>()
            + (self.j_offsets.capacity() + self.codes.capacity()) * size_of::<CacheVector<u32>>()
            + self.batches.capacity() * size_of::<CachedBatch>()
    }
}

/// Appends all pairs of a part.
#[inline(always)]
pub unsafe fn append_to_cache<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    buffers: &PairBuffers<A::Scalar>,
    cache: &mut FullPairCache<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: the contract of `simd`; blocks have whole vectors.
    unsafe {
        type W<I, A> = <<A as Arithmetic<I>>::Reals as Reals>::Words;
        let lanes = A::Reals::LANES;
        let count = batch.count();
        let vectors = count.div_ceil(lanes);
        cache.reserve(count);
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        for (pass, term) in data.terms.passes.iter().enumerate() {
            let to = cache.field(WEIGHT_GRADIENT + pass);
            term.force_kernel.visit(Slopes::<A::Reals> { term, pairs, vectors, to });
        }
        let to_apart = [0, 1, 2].map(|c| cache.field(SEPARATION + c));
        let (to_force, force) = (cache.field(FORCE), buffers.conservative.as_ptr());
        let pair_weight = buffers.pair_weight.as_ptr();
        let to_share =
            if TALLY { cache.field(WEIGHT_GRADIENT + data.terms.passes.len()) } else { std::ptr::null_mut() };
        let (j_offsets, codes) = (at(&mut cache.j_offsets, cache.end), at(&mut cache.codes, cache.end));
        let i_in_batch = buffers.i_in_batch.as_ptr().add(batch.pairs[0]);
        let j = buffers.j_offsets.as_ptr().add(batch.pairs[0]);
        let mut v = 0;
        while v < vectors {
            let k = v * lanes;
            let PairVector { geometry, species_pair } = &*pairs.add(v);
            let mut code = W::<I, A>::load_bytes(i_in_batch.add(k));
            if MULTISPECIES {
                code = code.add(species_pair.0.rotate(I_CODE_BITS));
            }
            code.store(codes.add(k));
            W::<I, A>::load(j.add(k)).store(j_offsets.add(k));
            let mut c = 0;
            while c < 3 {
                geometry.d[c].store(to_apart[c].add(k));
                c += 1;
            }
            A::Reals::load(force.add(k)).store(to_force.add(k));
            if TALLY {
                A::Reals::load(pair_weight.add(k)).store(to_share.add(k));
            }
            v += 1;
        }
        // What is behind the last is added to some particle of the plane: nothing.
        *j_offsets.add(count) = *j;
        cache.add(buffers, batch);
    }
}

/// The loop over vectors for one density, of one kernel.
struct Slopes<'a, R: Reals> {
    term: &'a Pass<R::Scalar>,
    pairs: *const PairVector<R>,
    vectors: usize,
    to: *mut R::Scalar,
}

impl<R: Reals> ShapeVisitor for Slopes<'_, R> {
    type Output = ();

    /// `−w′(r)/r`, zero beyond the range: lanes behind the last pair are out of reach.
    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `append_to_cache`; there is room for whole vectors.
        unsafe {
            let range = R::splat(self.term.force_range);
            let inverse_range = R::splat(self.term.force_inverse_range);
            let factor = R::splat(self.term.force);
            let mut v = 0;
            while v < self.vectors {
                let pairs = &(*self.pairs.add(v)).geometry;
                let g = factor * S::slope(pairs.r * inverse_range) * pairs.inverse;
                g.where_below(pairs.r, range).store(self.to.add(v * R::LANES));
                v += 1;
            }
        }
    }
}

/// Slopes of a particle that are read at once.
pub const SLOPES_PER_PASS: usize = 8;

/// Second pass over pairs that were kept in the full pair cache.
///
/// # Safety
/// As [`first_pass`](crate::engine::sweep::first_pass::first_pass).
#[inline(always)]
pub unsafe fn second_pass_cached<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane: usize,
    cache: &FullPairCache<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the caller's.
    unsafe {
        let offset = *data.accumulator_offset.get_unchecked(plane);
        let to = PlaneAccumulators::new(data.sums.0.offset(4 * offset));
        // As many as whole vectors have, and a row behind.
        let room = cache.most / 16 + 2;
        let mut quads: Vec<CacheLines<A::Scalar>> = vec![CacheLines::default(); room];
        let mut running: Vec<Accumulator> = vec![Accumulator::default(); 8 * room];
        let mut factors: Vec<CacheLines<A::Scalar>> = vec![CacheLines::default(); room];
        let quads = quads.as_mut_ptr().cast::<A::Scalar>();
        let factors = factors.as_mut_ptr().cast::<A::Scalar>();
        for batch in &cache.batches {
            let pairs = BatchInCache {
                cache,
                batch,
                vectors: (batch.begin[batch.members as usize] as usize).div_ceil(A::Reals::LANES),
            };
            if data.variables <= 4 && data.terms.species <= 2 {
                find_factors::<I, A, MULTISPECIES, 4>(data, &pairs, 0, factors);
            } else {
                let mut first = 0;
                while first < data.variables {
                    find_factors::<I, A, MULTISPECIES, SLOPES_PER_PASS>(data, &pairs, first, factors);
                    first += SLOPES_PER_PASS;
                }
            }
            forces_of_batch::<A::Reals, TALLY>(&pairs, factors, quads, virial);
            let listed = ScatterPairs {
                j_offsets: pairs.j_offsets(),
                begin: batch.begin.as_ptr(),
                first: batch.first as usize,
                members: batch.members as usize,
            };
            scatter_quads::<I, A>(
                to,
                quads,
                quads,
                running.as_mut_ptr().cast(),
                [1.0, 1.0, 1.0, 0.0],
                listed,
            );
        }
    }
}

/// The pairs of a part.
struct BatchInCache<'a, T> {
    cache: &'a FullPairCache<T>,
    batch: &'a CachedBatch,
    vectors: usize,
}

impl<T> BatchInCache<'_, T> {
    #[inline(always)]
    unsafe fn field(&self, field: usize) -> *const T {
        // SAFETY: the caller's.
        unsafe { self.cache.fields.get_unchecked(field).as_ptr().add(self.batch.vector).cast() }
    }

    #[inline(always)]
    unsafe fn j_offsets(&self) -> *const u32 {
        // SAFETY: the caller's.
        unsafe { self.cache.j_offsets.as_ptr().add(self.batch.vector).cast() }
    }

    #[inline(always)]
    unsafe fn codes(&self) -> *const u32 {
        // SAFETY: the caller's.
        unsafe { self.cache.codes.as_ptr().add(self.batch.vector).cast() }
    }
}

/// What a slope is multiplied by.
#[derive(Clone, Copy)]
struct SlopeTerm<T> {
    /// `−w′/r` of its density.
    weight_gradient: *const T,
    /// Whether the first particle of a pair is of its species, and the second: tables.
    is_species: [*const T; 2],
}

/// Slopes of a vector's worth of particles, column by column.
#[repr(C, align(64))]
struct ISlopes<T>([[T; 16]; SLOPES_PER_PASS]);

/// Adds `Σ (∂ψ_i + ∂ψ_j) (−w′/r)` over up to `N` slopes to the factors of pairs, or begins these. Each particle has a slope
/// for the species of the other. With four there are at most two species.
#[inline(always)]
unsafe fn find_factors<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const N: usize>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    pairs: &BatchInCache<A::Scalar>,
    first: usize,
    factors: *mut A::Scalar,
) {
    // SAFETY: the contract of `simd`; there are slopes of a vector's worth behind the last particle.
    unsafe {
        let zero = A::Reals::constant(0.0);
        let species = data.terms.species;
        let count = N.min(data.variables - first);
        let slopes = data.packed_slopes.at(first / SLOPES_PER_PASS * data.packed_slope_stride).cast_const();
        let mut i_slopes = ISlopes([[A::Scalar::default(); 16]; SLOPES_PER_PASS]);
        let fields = A::load_transposed_in_order(slopes.add(SLOPES_PER_PASS * pairs.batch.first as usize));
        // Tables of a vector, or more.
        let fits_vector = species * species <= A::Reals::LANES;
        let mut of = [SlopeTerm { weight_gradient: std::ptr::null(), is_species: [std::ptr::null(); 2] };
            SLOPES_PER_PASS];
        let mut c = 0;
        while c < N {
            fields[c].store(i_slopes.0[c].as_mut_ptr());
            // Behind the last there is the last again.
            let at = first + c.min(count - 1);
            let [is_first, is_second] = data.terms.is_species.get_unchecked(at % species);
            of[c].is_species = [is_first.as_ptr(), is_second.as_ptr()];
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
                // One species after the other.
                let (mut from_i, mut from_j) = ([zero; 2], [zero; 2]);
                let mut c = 0;
                while c < N {
                    if c < count {
                        let weight_gradient = A::Reals::load(of[c].weight_gradient.add(k));
                        let i_slope = A::Reals::pick(i_slopes.0[c].as_ptr(), code);
                        from_i[c % 2] = i_slope.mul_add(weight_gradient, from_i[c % 2]);
                        from_j[c % 2] = j_slopes[c].mul_add(weight_gradient, from_j[c % 2]);
                    }
                    c += 1;
                }
                let mut s = 0;
                while s < 2 {
                    let [is_first, is_second] = of[s].is_species;
                    factor = from_j[s].mul_add(A::Reals::pick(is_first, species_pair), factor);
                    factor = from_i[s].mul_add(A::Reals::pick(is_second, species_pair), factor);
                    s += 1;
                }
            } else {
                let mut c = 0;
                while c < N {
                    if c < count {
                        let weight_gradient = A::Reals::load(of[c].weight_gradient.add(k));
                        let i_slope = A::Reals::pick(i_slopes.0[c].as_ptr(), code);
                        let slope = if MULTISPECIES {
                            let [is_first, is_second] = of[c].is_species;
                            let is_first = table_entry::<A::Reals>(is_first, species_pair, fits_vector);
                            let is_second = table_entry::<A::Reals>(is_second, species_pair, fits_vector);
                            i_slope.mul_add(is_second, j_slopes[c] * is_first)
                        } else {
                            i_slope + j_slopes[c]
                        };
                        factor = slope.mul_add(weight_gradient, factor);
                    }
                    c += 1;
                }
            }
            factor.store(factors.add(k));
            v += 1;
        }
    }
}

/// Rows of whole forces, and the virial of what came from densities.
#[inline(always)]
unsafe fn forces_of_batch<R: Reals, const TALLY: bool>(
    pairs: &BatchInCache<R::Scalar>,
    factors: *const R::Scalar,
    quads: *mut R::Scalar,
    virial: &mut [f64; 6],
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let [x, y, z] = [0, 1, 2].map(|c| pairs.field(SEPARATION + c));
        let force = pairs.field(FORCE);
        let pair_weight = if TALLY { pairs.field(pairs.cache.fields.len() - 1) } else { std::ptr::null() };
        let zero = R::constant(0.0);
        let mut sum_laness = [zero; 6];
        let mut v = 0;
        while v < pairs.vectors {
            let k = v * R::LANES;
            let factor = R::load(factors.add(k));
            let d = [R::load(x.add(k)), R::load(y.add(k)), R::load(z.add(k))];
            let cache = R::load(force.add(k)) + factor;
            R::store_transposed([cache * d[0], cache * d[1], cache * d[2], zero], quads.add(4 * k));
            if TALLY {
                add_virial(factor * R::load(pair_weight.add(k)), d, &mut sum_laness);
            }
            v += 1;
        }
        if TALLY {
            for c in 0..6 {
                virial[c] += sum_lanes(sum_laness[c]);
            }
        }
    }
}
