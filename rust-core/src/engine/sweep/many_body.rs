//! The pairs that a density reaches: kept by the first pass, and given their forces, after ψ, by the second.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::layer::Swept;
use super::scatter::add_to;
use super::simd::{Isa, Quad, Scalar};

/// What the first pass of a layer leaves for the second.
#[derive(Debug, Clone, Default)]
pub struct NearPairs<T> {
    /// For each density: rows `−w′ ê` and the second particle, those of one particle after another.
    pub rows: Vec<Rows<T>>,
    /// Rows `r_i − r_j` and the share of each, if virials are wanted.
    pub apart: Vec<Rows<T>>,
    /// How many there are for each particle that has looked for any.
    pub counts: Vec<Vec<u32>>,
    /// These particles.
    pub members: Vec<u32>,
}

/// Rows of four numbers that whole vectors are written behind.
#[derive(Debug, Clone)]
pub struct Rows<T>(Vec<[T; 4]>);

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Rows(Vec::new())
    }
}

impl<T> Rows<T> {
    /// Where the next row goes.
    #[inline(always)]
    pub fn end(&mut self) -> *mut [T; 4] {
        // SAFETY: one past the last, or before.
        unsafe { self.0.as_mut_ptr().add(self.0.len()) }
    }

    pub fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<[T; 4]>()
    }
}

impl<T> NearPairs<T> {
    pub fn clear(&mut self, passes: usize) {
        self.rows.resize_with(passes, Rows::default);
        self.apart.resize_with(passes, Rows::default);
        self.counts.resize_with(passes, Vec::new);
        self.rows.iter_mut().chain(&mut self.apart).for_each(|rows| rows.0.clear());
        self.counts.iter_mut().for_each(Vec::clear);
        self.members.clear();
    }

    /// Makes room for `more` pairs of each density.
    #[inline(always)]
    pub fn reserve<const TALLY: bool>(&mut self, more: usize) {
        for rows in &mut self.rows {
            make_room(&mut rows.0, more);
        }
        if TALLY {
            for rows in &mut self.apart {
                make_room(&mut rows.0, more);
            }
        }
    }

    /// Counts the pairs that were written behind the last.
    #[inline(always)]
    pub unsafe fn add<const TALLY: bool>(&mut self, block: &Block<T>, [first, last]: [usize; 2])
    where
        T: Scalar,
    {
        // SAFETY: the rows have been written; blocks have bits for all pairs.
        unsafe {
            self.members.extend_from_slice(block.members.get_unchecked(first..last));
            let begin = block.begin.as_ptr();
            let zero = *begin.add(first) as usize;
            for pass in 0..self.rows.len() {
                let found = *block.found.get_unchecked(pass);
                let rows = &mut self.rows.get_unchecked_mut(pass).0;
                rows.set_len(rows.len() + found);
                if TALLY {
                    let apart = &mut self.apart.get_unchecked_mut(pass).0;
                    apart.set_len(apart.len() + found);
                }
                let counts = self.counts.get_unchecked_mut(pass);
                make_room(counts, last - first);
                let out = counts.as_mut_ptr().add(counts.len());
                let bits = block.bits.get_unchecked(pass).as_ptr();
                let mut m = first;
                while m < last {
                    let (from, to) = (*begin.add(m) as usize - zero, *begin.add(m + 1) as usize - zero);
                    *out.add(m - first) = count_bits(bits, from, to);
                    m += 1;
                }
                counts.set_len(counts.len() + last - first);
            }
        }
    }

    /// Counts no pairs for `members`.
    pub fn add_none(&mut self, members: &[u32]) {
        self.members.extend_from_slice(members);
        for counts in &mut self.counts {
            counts.resize(counts.len() + members.len(), 0);
        }
    }
}

/// Room for `more`, an eighth in advance: twice as much, as vectors grow by themselves, would be a good part of
/// all memory.
#[inline(always)]
fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}

/// How many of the pairs `from..to` are set in `bits`.
///
/// # Safety
/// `bits` has them all, and a word behind.
#[inline(always)]
unsafe fn count_bits(bits: *const u64, from: usize, to: usize) -> u32 {
    // SAFETY: the caller's.
    unsafe {
        let (word, shift) = (from / 64, from % 64);
        let length = to - from;
        // Two words hold sixty-four pairs, wherever they begin.
        let here = *bits.add(word) >> shift | *bits.add(word + 1) << 1 << (63 - shift);
        if length <= 64 {
            let mask = if length == 64 { u64::MAX } else { (1u64 << length) - 1 };
            return (here & mask).count_ones();
        }
        let mut count = 0;
        let mut p = from;
        while p < to {
            count += (*bits.add(p / 64) >> (p % 64) & 1) as u32;
            p += 1;
        }
        count
    }
}

/// Second pass: many-body forces of the pairs that the first has kept.
///
/// # Safety
/// As [`first_pass`](super::layer::first_pass).
#[inline(always)]
pub unsafe fn second_pass<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    layer: usize,
    near: &NearPairs<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the caller's.
    unsafe {
        let offset = *swept.offset.get_unchecked(layer);
        let base = swept.sums.0.offset(4 * offset);
        let species = swept.terms.species;
        let width = swept.terms.passes.len() * species;
        let mut pass = 0;
        while pass < swept.terms.passes.len() {
            let rows = &near.rows.get_unchecked(pass).0;
            let apart = &near.apart.get_unchecked(pass).0;
            let counts = near.counts.get_unchecked(pass);
            let slopes = swept.slopes.as_ptr().add(pass * species);
            let mut p = 0;
            let mut m = 0;
            while m < counts.len() {
                let i = *near.members.get_unchecked(m) as usize;
                let end = p + *counts.get_unchecked(m) as usize;
                let mut sum = I::Quad::zero();
                let own = slopes.add(width * i);
                let si = if SEVERAL { *swept.species.get_unchecked(i) as usize } else { 0 };
                while p < end {
                    let row = rows.as_ptr().add(p).cast::<A::Scalar>();
                    let j = (*row.add(3)).decode() as usize;
                    let there = slopes.add(width * j);
                    let slope = if SEVERAL {
                        *own.add(*swept.species.get_unchecked(j) as usize) + *there.add(si)
                    } else {
                        *own + *there
                    };
                    let force = A::load_quad(row).mul(I::Quad::splat(slope));
                    sum = sum.add(force);
                    let at = base.add(4 * j);
                    I::Quad::load(at).sub(force).store(at);
                    if TALLY {
                        add_dyad(apart[p], *rows.get_unchecked(p), slope, virial);
                    }
                    p += 1;
                }
                add_to(base.add(4 * i), sum);
                m += 1;
            }
            pass += 1;
        }
    }
}

#[inline(never)]
fn add_dyad<T: Scalar>(apart: [T; 4], g: [T; 4], slope: f64, virial: &mut [f64; 6]) {
    let d = apart.map(T::wide);
    let factor = slope * d[3];
    let f = [g[0].wide() * factor, g[1].wide() * factor, g[2].wide() * factor];
    for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        virial[k] += f[a] * d[b];
    }
}
