//! The pairs that a density reaches: kept by the first pass, and given their forces, after ψ, by the second.

use crate::engine::sweep::ground::arithmetic::Arithmetic;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::many_body::full_pair_cache::{FullPairCache, second_pass_cached};
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::pair_batch::scatter::add_quad;
use crate::engine::sweep::simd::{Isa, Quad, Scalar};

/// What the first pass of a plane leaves for the second.
#[derive(Debug, Clone, Default)]
pub struct InRangePairs<T> {
    /// For each density: rows `−w′ ê`, and a code of both particles.
    pub weight_gradients: Vec<QuadList<T>>,
    /// Rows `r_i − r_j` and the share of each, if virials are wanted.
    pub separations: Vec<QuadList<T>>,
    /// The first particles of the pairs, a vector's worth after another: the first, and how many; and how many pairs
    /// those have for each density.
    batches: Vec<[u32; 2]>,
    found: Vec<u32>,
    /// The first particle of the plane.
    pub first: u32,
    /// Instead of all that, if pairs are kept in the full pair cache.
    pub full_cache: FullPairCache<T>,
}

/// The lowest bits of a code: the number of the first particle in its part. Those above count second particles, from
/// the first of the plane on.
pub const I_CODE_BITS: u32 = 4;

/// How many bits these are: codes pass as numbers.
pub const J_CODE_BITS: u32 = 25;

/// Rows of four numbers that whole vectors are written behind.
#[derive(Debug, Clone)]
pub struct QuadList<T>(Vec<[T; 4]>);

impl<T> Default for QuadList<T> {
    fn default() -> Self {
        QuadList(Vec::new())
    }
}

impl<T> QuadList<T> {
    /// Where the next row goes.
    #[inline(always)]
    pub fn end(&mut self) -> *mut [T; 4] {
        // SAFETY: one past the last, or before.
        unsafe { self.0.as_mut_ptr().add(self.0.len()) }
    }
}

impl<T: Scalar> InRangePairs<T> {
    pub fn clear(&mut self, passes: usize, first: u32) {
        self.weight_gradients.resize_with(passes, QuadList::default);
        self.separations.resize_with(passes, QuadList::default);
        self.weight_gradients
            .iter_mut()
            .chain(&mut self.separations)
            .for_each(|weight_gradients| weight_gradients.0.clear());
        self.batches.clear();
        self.found.clear();
        self.first = first;
    }

    /// Makes room for `more` pairs of each density.
    #[inline(always)]
    pub fn reserve<const TALLY: bool>(&mut self, more: usize) {
        for weight_gradients in &mut self.weight_gradients {
            make_room(&mut weight_gradients.0, more);
        }
        if TALLY {
            for weight_gradients in &mut self.separations {
                make_room(&mut weight_gradients.0, more);
            }
        }
    }

    /// Counts the pairs that were written behind the last.
    #[inline(always)]
    pub unsafe fn add<const TALLY: bool>(&mut self, buffers: &PairBuffers<T>, batch: Batch) {
        // SAFETY: the rows have been written.
        unsafe {
            if self.weight_gradients.is_empty() {
                return;
            }
            make_room(&mut self.batches, 1);
            self.batches.push([batch.first as u32, (batch.slots[1] - batch.slots[0]) as u32]);
            make_room(&mut self.found, self.weight_gradients.len());
            for pass in 0..self.weight_gradients.len() {
                let found = *buffers.found.get_unchecked(pass);
                self.found.push(found as u32);
                let weight_gradients = &mut self.weight_gradients.get_unchecked_mut(pass).0;
                weight_gradients.set_len(weight_gradients.len() + found);
                if TALLY {
                    let separations = &mut self.separations.get_unchecked_mut(pass).0;
                    separations.set_len(separations.len() + found);
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.weight_gradients
            .iter()
            .chain(&self.separations)
            .map(|weight_gradients| weight_gradients.0.capacity() * size_of::<[T; 4]>())
            .sum::<usize>()
            + self.batches.capacity() * size_of::<[u32; 2]>()
            + self.found.capacity() * size_of::<u32>()
            + self.full_cache.bytes()
    }
}

/// Room for `more`, an eighth in advance: twice as much, as vectors grow by themselves, would be a good part of
/// all memory.
#[inline(always)]
pub fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}

/// How many sums of each member take turns: one alone would wait for itself at every pair.
const BANKS: usize = 4;

/// What pairs add to their first particles: sums for each of a vector's worth of members. All zero between uses.
#[repr(C, align(64))]
struct Banks([[[f64; 4]; BANKS]; 16]);

impl Banks {
    /// The sum of member `m` in turn `p`; there are sixteen members.
    #[inline(always)]
    unsafe fn at(&mut self, m: usize, p: usize) -> *mut f64 {
        // SAFETY: the caller's.
        unsafe { self.0.as_mut_ptr().cast::<[f64; 4]>().add(BANKS * m + p % BANKS).cast() }
    }

    /// The sum of member `m`, which is zero then.
    #[inline(always)]
    unsafe fn take<Q: Quad>(&mut self, m: usize) -> Q {
        // SAFETY: the caller's.
        unsafe {
            let mut sums = [Q::zero(); BANKS];
            let mut p = 0;
            while p < BANKS {
                sums[p] = Q::load(self.at(m, p));
                Q::zero().store(self.at(m, p));
                p += 1;
            }
            sums[0].add(sums[1]).add(sums[2].add(sums[3]))
        }
    }
}

/// Second pass: many-body forces of the pairs that the first has kept.
///
/// # Safety
/// As [`first_pass`](crate::engine::sweep::first_pass::first_pass).
#[inline(always)]
pub unsafe fn second_pass<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    plane: usize,
    in_range: &InRangePairs<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the caller's.
    unsafe {
        if MULTISPECIES && data.terms.full_cache {
            return second_pass_cached::<I, A, MULTISPECIES, TALLY>(
                data,
                plane,
                &in_range.full_cache,
                virial,
            );
        }
        let offset = *data.accumulator_offset.get_unchecked(plane);
        let base = data.sums.0.offset(4 * offset);
        let plane_base = base.add(4 * in_range.first as usize);
        let species = data.terms.species;
        let species_j = data.species.as_ptr().wrapping_add(in_range.first as usize);
        let passes = in_range.weight_gradients.len();
        let width = passes * species;
        let mut banks = Banks([[[0.0; 4]; BANKS]; 16]);
        let mut done = vec![0; passes];
        let mut batch = 0;
        while batch < in_range.batches.len() {
            let [first, count] = in_range.batches.get_unchecked(batch).map(|n| n as usize);
            let mut pass = 0;
            while pass < passes {
                let weight_gradients = &in_range.weight_gradients.get_unchecked(pass).0;
                let separations = &in_range.separations.get_unchecked(pass).0;
                let slopes = data.slopes.at(pass * species).cast_const();
                let plane_slopes = slopes.add(width * in_range.first as usize);
                let own_slopes = slopes.add(width * first);
                let own_species = data.species.as_ptr().wrapping_add(first);
                let begin = *done.get_unchecked(pass);
                let end = begin + *in_range.found.get_unchecked(batch * passes + pass) as usize;
                let mut p = begin;
                while p < end {
                    let row = weight_gradients.as_ptr().add(p).cast::<A::Scalar>();
                    let code = (*row.add(3)).decode();
                    let (j, m) = ((code >> I_CODE_BITS) as usize, (code & ((1 << I_CODE_BITS) - 1)) as usize);
                    let there = plane_slopes.add(width * j);
                    let slope = if MULTISPECIES {
                        let (i, j) = (*own_species.add(m) as usize, *species_j.add(j) as usize);
                        *own_slopes.add(width * m + j) + *there.add(i)
                    } else {
                        *own_slopes.add(width * m) + *there
                    };
                    let force = A::load_quad(row).mul(I::Quad::splat(slope));
                    let at = plane_base.add(4 * j);
                    I::Quad::load(at).sub(force).store(at);
                    let at = banks.at(m, p);
                    I::Quad::load(at).add(force).store(at);
                    if TALLY {
                        add_dyad(
                            *separations.get_unchecked(p),
                            *weight_gradients.get_unchecked(p),
                            slope,
                            virial,
                        );
                    }
                    p += 1;
                }
                *done.get_unchecked_mut(pass) = end;
                pass += 1;
            }
            let mut m = 0;
            while m < count {
                add_quad(base.add(4 * (first + m)), banks.take::<I::Quad>(m));
                m += 1;
            }
            batch += 1;
        }
    }
}

#[inline(never)]
fn add_dyad<T: Scalar>(separations: [T; 4], g: [T; 4], slope: f64, virial: &mut [f64; 6]) {
    let d = separations.map(T::wide);
    let factor = slope * d[3];
    let f = [g[0].wide() * factor, g[1].wide() * factor, g[2].wide() * factor];
    for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        virial[k] += f[a] * d[b];
    }
}
