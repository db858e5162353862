//! The full pair cache: with several densities or species the first pass stores all pairs, with their
//! separations and forces. The second pass then computes the whole force of a pair, and adds it to both
//! particles once; the first pass adds densities only.
//!
//! With one density the cache saves nothing: its weight is added together with the force. Of two species with two densities an
//! evaluation takes 151 ns a particle with it and 176 without at 6 050 particles, 168 and 204 at 48 400 (AVX-512, mixed precision,
//! one thread; 27 November 2026).

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::inputs::PairInputs;
use super::room::make_room;
use crate::ground::arithmetic::{Arithmetic, PackedParticle, PairVector};
use crate::ground::terms::Pass;
use crate::simd::{Isa, Reals, Scalar, Words};
use psidpd_model::kernel::{Shape, ShapeVisitor};
use std::mem::MaybeUninit;

/// The pairs of a plane, field by field. The pairs of each batch begin with a whole vector of every field.
#[derive(Debug, Default)]
pub struct FullPairCache<T> {
    /// Separation `r_i − r_j` ([`SEPARATION`]); force without density terms, over `r` ([`FORCE`]); `−w′(r)/r` of each
    /// density ([`WEIGHT_GRADIENT`]); last the pair weight, if virials are requested.
    pub fields: Vec<Vec<CacheVector<T>>>,
    /// Index of the j-particle, shifted by `OFFSET_BITS`.
    pub j_offsets: Vec<CacheVector<u32>>,
    /// The i-particle, counted in its batch; above [`I_CODE_BITS`] the pair of species, if there are several.
    pub codes: Vec<CacheVector<u32>>,
    pub batches: Vec<CachedBatch>,
    /// Number of vectors in each field.
    end: usize,
    room: usize,
    /// Number of pairs of the largest batch.
    pub most: usize,
}

/// Numbers of the fields: three of separations, one of forces, then the first density.
pub const SEPARATION: usize = 0;
pub const FORCE: usize = 3;
pub const WEIGHT_GRADIENT: usize = 4;

/// Number of bits of a code that contain the i-particle.
pub const I_CODE_BITS: u32 = 4;

/// Sixteen numbers. Lanes beyond the last pair of a batch may stay unwritten; they are not read then.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct CacheVector<T>([MaybeUninit<T>; 16]);

/// A batch in the cache.
#[derive(Debug, Clone, Copy)]
pub struct CachedBatch {
    /// First i-particle of the batch.
    pub first: u32,
    pub members: u32,
    /// Index of the first pair of each i-particle in the batch, and one past the last pair.
    pub begin: [u32; 17],
    /// Index of the vector with the first pair.
    pub vector: usize,
}

/// The address of vector `end` of a field.
///
/// # Safety
/// The field has room for it.
#[inline(always)]
unsafe fn at<T>(field: &mut Vec<CacheVector<T>>, end: usize) -> *mut T {
    // SAFETY: the caller promises room; `reserve` makes room for whole vectors of the next batch in every field.
    unsafe { field.as_mut_ptr().add(end).cast() }
}

impl<T: Scalar> FullPairCache<T> {
    /// Empties the cache, for `passes` densities and, with `tally`, virials.
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

    /// Makes room for `more` pairs, and one vector more.
    #[inline(always)]
    fn reserve(&mut self, more: usize) {
        let more = more / 16 + 2;
        if self.room - self.end < more {
            self.grow(more);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, more: usize) {
        // SAFETY: `end` is within the capacity of every field (`reserve`); elements of `MaybeUninit` may stay unwritten.
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

    /// The address of the next vector of a field.
    ///
    /// # Safety
    /// The field exists, and has room for the vector.
    #[inline(always)]
    unsafe fn field(&mut self, field: usize) -> *mut T {
        // SAFETY: `clear` has made the fields; `reserve` has made room in them.
        unsafe { at(self.fields.get_unchecked_mut(field), self.end) }
    }

    /// Counts the pairs of a batch that were written beyond the last pair, and one unspecified vector after them.
    #[inline(always)]
    fn add(&mut self, batch: Batch) {
        let mut begin = [0; 17];
        let first = batch.begin[0];
        for (to, from) in begin.iter_mut().zip(batch.begin) {
            *to = from - first;
        }
        make_room(&mut self.batches, 1);
        let (first, members) = (batch.first as u32, batch.members as u32);
        self.batches.push(CachedBatch { first, members, begin, vector: self.end });
        self.most = self.most.max(batch.count);
        self.end += batch.count / 16 + 1;
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(|field| field.capacity() * size_of::<CacheVector<T>>()).sum::<usize>()
            + (self.j_offsets.capacity() + self.codes.capacity()) * size_of::<CacheVector<u32>>()
            + self.batches.capacity() * size_of::<CachedBatch>()
    }
}

/// Appends all pairs of a batch.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain distances and forces of the batch;
/// the cache has been cleared for the same number of densities and the same `TALLY`.
#[inline(always)]
pub unsafe fn append_to_cache<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, impl PackedParticle>,
    buffers: &BatchBuffers<A::Scalar>,
    cache: &mut FullPairCache<A::Scalar>,
    batch: Batch,
) {
    // SAFETY: `reserve` makes room for whole vectors and one more; `BatchBuffers` and `SearchBuffers`
    // pad arrays of the batch to whole vectors.
    unsafe {
        type W<I, A> = <<A as Arithmetic<I>>::Reals as Reals>::Words;
        let lanes = A::Reals::LANES;
        let vectors = batch.count.div_ceil(lanes);
        cache.reserve(batch.count);
        let pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        for (pass, term) in inputs.terms.passes.iter().enumerate() {
            let to = cache.field(WEIGHT_GRADIENT + pass);
            term.force_kernel.visit(WeightGradients::<A::Reals> { term, pairs, vectors, to });
        }
        let to_separation = [0, 1, 2].map(|c| cache.field(SEPARATION + c));
        let (to_force, force) = (cache.field(FORCE), buffers.conservative.as_ptr());
        let pair_weight = buffers.pair_weight.as_ptr();
        let to_weight = if TALLY {
            cache.field(WEIGHT_GRADIENT + inputs.terms.passes.len())
        } else {
            std::ptr::null_mut()
        };
        let (j_offsets, codes) = (at(&mut cache.j_offsets, cache.end), at(&mut cache.codes, cache.end));
        let (i, j) = (batch.i_in_batch.as_ptr(), batch.j_offsets.as_ptr());
        let mut v = 0;
        while v < vectors {
            let k = v * lanes;
            let PairVector { geometry, species_pair } = &*pairs.add(v);
            let mut code = W::<I, A>::load_bytes(i.add(k));
            if MULTISPECIES {
                code = code.add(species_pair.0.rotate(I_CODE_BITS));
            }
            code.store(codes.add(k));
            W::<I, A>::load(j.add(k)).store(j_offsets.add(k));
            let mut c = 0;
            while c < 3 {
                geometry.d[c].store(to_separation[c].add(k));
                c += 1;
            }
            A::Reals::load(force.add(k)).store(to_force.add(k));
            if TALLY {
                A::Reals::load(pair_weight.add(k)).store(to_weight.add(k));
            }
            v += 1;
        }
        // The scatter loop adds zero to the particle after the last pair, which must be in the plane.
        *j_offsets.add(batch.count) = *j;
        cache.add(batch);
    }
}

/// The loop over vectors of pairs for one density, compiled for each kernel.
struct WeightGradients<'a, R: Reals> {
    term: &'a Pass<R::Scalar>,
    pairs: *const PairVector<R>,
    vectors: usize,
    to: *mut R::Scalar,
}

impl<R: Reals> ShapeVisitor for WeightGradients<'_, R> {
    type Output = ();

    /// Writes `−w′(r)/r`, which is zero beyond the range and in padding lanes.
    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: `append_to_cache` has made room for whole vectors.
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
