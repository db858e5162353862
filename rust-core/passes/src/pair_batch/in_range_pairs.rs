//! The pairs within the range of each density: the first pass lists them, the second computes their many-body forces.

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::full_pair_cache::FullPairCache;
use super::inputs::PairInputs;
use super::room::make_room;
use crate::ground::arithmetic::{Arithmetic, PairVector};
use crate::ground::terms::Pass;
use crate::simd::{Isa, OFFSET_BITS, Reals, Scalar, Words};
use psidpd_model::kernel::{Shape, ShapeVisitor};

/// The output of the first pass of a plane for the second: a compact list for each density, or the full pair cache.
#[derive(Debug, Default)]
pub struct InRangePairs<T> {
    /// For each density and pair a quad: `−w′ ê`, and a code of both particles.
    pub weight_gradients: Vec<QuadList<T>>,
    /// If virials are requested, a second quad: `r_i − r_j`, and the pair weight.
    pub separations: Vec<QuadList<T>>,
    /// First i-particle of each batch, and the number of its i-particles.
    pub batches: Vec<[u32; 2]>,
    /// For each batch, the number of pairs in each density.
    pub found: Vec<u32>,
    /// The first particle of the plane.
    pub plane_first: u32,
    /// All pairs, if the plan uses the full pair cache; the lists above are empty then.
    pub full_cache: FullPairCache<T>,
}

/// Number of lowest bits of a code that contain the i-particle, counted in its batch. The bits above
/// contain the j-particle, counted from the first particle of the plane.
pub const I_CODE_BITS: u32 = 4;

/// Number of bits for the j-particle: codes are stored as floating-point numbers.
pub const J_CODE_BITS: u32 = 25;

/// A list of quads that is written in whole vectors.
#[derive(Debug, Clone)]
pub struct QuadList<T>(Vec<[T; 4]>);

impl<T> Default for QuadList<T> {
    fn default() -> Self {
        QuadList(Vec::new())
    }
}

impl<T> QuadList<T> {
    /// The address of the next quad.
    #[inline(always)]
    fn end(&mut self) -> *mut [T; 4] {
        // SAFETY: the address is at most one past the end of the allocation.
        unsafe { self.0.as_mut_ptr().add(self.0.len()) }
    }

    #[inline(always)]
    pub fn as_ptr(&self) -> *const [T; 4] {
        self.0.as_ptr()
    }
}

impl<T: Scalar> InRangePairs<T> {
    /// Empties the lists, for `passes` densities.
    pub fn clear(&mut self, passes: usize, plane_first: u32) {
        self.weight_gradients.resize_with(passes, QuadList::default);
        self.separations.resize_with(passes, QuadList::default);
        self.weight_gradients.iter_mut().chain(&mut self.separations).for_each(|list| list.0.clear());
        self.batches.clear();
        self.found.clear();
        self.plane_first = plane_first;
    }

    /// Makes room for `more` pairs of each density.
    #[inline(always)]
    pub fn reserve<const TALLY: bool>(&mut self, more: usize) {
        for list in &mut self.weight_gradients {
            make_room(&mut list.0, more);
        }
        if TALLY {
            for list in &mut self.separations {
                make_room(&mut list.0, more);
            }
        }
    }

    /// Counts the pairs of a batch that [`append_in_range`] has written after the last pair.
    ///
    /// # Safety
    /// [`append_in_range`] has written `found` pairs of each density, with the same `TALLY`.
    #[inline(always)]
    pub unsafe fn add<const TALLY: bool>(&mut self, found: &[usize], batch: Batch) {
        // SAFETY: the caller promises that the quads are initialised; `reserve` has made room for them,
        // and `found` has an entry for each density.
        unsafe {
            if self.weight_gradients.is_empty() {
                return;
            }
            make_room(&mut self.batches, 1);
            self.batches.push([batch.first as u32, batch.members as u32]);
            make_room(&mut self.found, self.weight_gradients.len());
            for pass in 0..self.weight_gradients.len() {
                let found = *found.get_unchecked(pass);
                self.found.push(found as u32);
                let list = &mut self.weight_gradients.get_unchecked_mut(pass).0;
                list.set_len(list.len() + found);
                if TALLY {
                    let list = &mut self.separations.get_unchecked_mut(pass).0;
                    list.set_len(list.len() + found);
                }
            }
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        let lists = self.weight_gradients.iter().chain(&self.separations);
        lists.map(|list| list.0.capacity() * size_of::<[T; 4]>()).sum::<usize>()
            + self.batches.capacity() * size_of::<[u32; 2]>()
            + self.found.capacity() * size_of::<u32>()
            + self.full_cache.bytes()
    }
}

/// Writes the pairs of a batch within the range of each density after the last pair; `buffers.found` counts them.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain the distances of the batch;
/// [`InRangePairs::reserve`] has made room.
#[inline(always)]
pub unsafe fn append_in_range<I: Isa, A: Arithmetic<I>, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    buffers: &mut BatchBuffers<A::Scalar>,
    in_range: &mut InRangePairs<A::Scalar>,
    batch: Batch,
) {
    for (pass, term) in inputs.terms.passes.iter().enumerate() {
        let found = term.force_kernel.visit(SelectInRange::<A::Reals, TALLY> {
            term,
            pairs: buffers.pairs.as_ptr().cast(),
            vectors: batch.count.div_ceil(A::Reals::LANES),
            i_in_batch: batch.i_in_batch.as_ptr(),
            j_offsets: batch.j_offsets.as_ptr(),
            plane_first: in_range.plane_first,
            pair_weight: buffers.pair_weight.as_ptr(),
            weight_gradients: in_range.weight_gradients[pass].end(),
            separations: in_range.separations[pass].end(),
        });
        buffers.found[pass] = found;
    }
}

/// The loop over vectors of pairs, compiled for each kernel.
struct SelectInRange<'a, R: Reals, const TALLY: bool> {
    term: &'a Pass<R::Scalar>,
    pairs: *const PairVector<R>,
    vectors: usize,
    i_in_batch: *const u8,
    j_offsets: *const u32,
    plane_first: u32,
    pair_weight: *const R::Scalar,
    weight_gradients: *mut [R::Scalar; 4],
    separations: *mut [R::Scalar; 4],
}

impl<R: Reals, const TALLY: bool> ShapeVisitor for SelectInRange<'_, R, TALLY> {
    type Output = usize;

    /// Writes `−w′ ê` and the codes; returns their number.
    #[inline(always)]
    fn visit<S: Shape>(self) -> usize {
        // SAFETY: `append_in_range` alone creates this visitor, and its caller fulfils the contract of
        // `simd`; `reserve` made room for whole vectors.
        unsafe {
            let range = R::splat(self.term.force_range);
            let inverse_range = R::splat(self.term.force_inverse_range);
            let factor = R::splat(self.term.force);
            let first = R::Words::splat(self.plane_first << OFFSET_BITS);
            let mut found = 0;
            let mut v = 0;
            while v < self.vectors {
                let pairs = &(*self.pairs.add(v)).geometry;
                let i = R::Words::load_bytes(self.i_in_batch.add(v * R::LANES));
                let j = R::Words::load(self.j_offsets.add(v * R::LANES)).sub(first);
                let code = R::encode(j.shift_right::<{ OFFSET_BITS - I_CODE_BITS }>().add(i));
                // The distance of padding lanes is out of range.
                let mask = pairs.r.mask_below(range);
                let g = factor * S::slope(pairs.r * inverse_range) * pairs.inverse;
                let [dx, dy, dz] = pairs.d;
                R::store_rows([g * dx, g * dy, g * dz, code], mask, self.weight_gradients.add(found).cast());
                if TALLY {
                    let weight = R::load(self.pair_weight.add(v * R::LANES));
                    R::store_rows([dx, dy, dz, weight], mask, self.separations.add(found).cast());
                }
                found += mask.count_ones() as usize;
                v += 1;
            }
            found
        }
    }
}
