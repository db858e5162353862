//! The pairs that a density reaches: kept by the first pass, and given their forces, after ψ, by the second.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::layer::{Part, Swept};
use super::scatter::add_to;
use super::simd::{Isa, Quad, Scalar};
use super::whole::{WholePairs, second_of_whole};

/// What the first pass of a layer leaves for the second.
#[derive(Debug, Clone, Default)]
pub struct NearPairs<T> {
    /// For each density: rows `−w′ ê`, and a code of both particles.
    pub rows: Vec<Rows<T>>,
    /// Rows `r_i − r_j` and the share of each, if virials are wanted.
    pub apart: Vec<Rows<T>>,
    /// The first particles of the pairs, a vector's worth after another: the first, and how many; and how many pairs
    /// those have for each density.
    parts: Vec<[u32; 2]>,
    found: Vec<u32>,
    /// The first particle of the layer.
    pub first: u32,
    /// Instead of all that, if pairs are kept whole.
    pub whole: WholePairs<T>,
}

/// The lowest bits of a code: the number of the first particle in its part. Those above count second particles, from
/// the first of the layer on.
pub const MEMBER_BITS: u32 = 4;

/// How many bits these are: codes pass as numbers.
pub const NEAR_BITS: u32 = 25;

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
}

impl<T: Scalar> NearPairs<T> {
    pub fn clear(&mut self, passes: usize, first: u32) {
        self.rows.resize_with(passes, Rows::default);
        self.apart.resize_with(passes, Rows::default);
        self.rows.iter_mut().chain(&mut self.apart).for_each(|rows| rows.0.clear());
        self.parts.clear();
        self.found.clear();
        self.first = first;
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
    pub unsafe fn add<const TALLY: bool>(&mut self, block: &Block<T>, part: Part) {
        // SAFETY: the rows have been written.
        unsafe {
            if self.rows.is_empty() {
                return;
            }
            make_room(&mut self.parts, 1);
            self.parts.push([part.first as u32, (part.slots[1] - part.slots[0]) as u32]);
            make_room(&mut self.found, self.rows.len());
            for pass in 0..self.rows.len() {
                let found = *block.found.get_unchecked(pass);
                self.found.push(found as u32);
                let rows = &mut self.rows.get_unchecked_mut(pass).0;
                rows.set_len(rows.len() + found);
                if TALLY {
                    let apart = &mut self.apart.get_unchecked_mut(pass).0;
                    apart.set_len(apart.len() + found);
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.rows.iter().chain(&self.apart).map(|rows| rows.0.capacity() * size_of::<[T; 4]>()).sum::<usize>()
            + self.parts.capacity() * size_of::<[u32; 2]>()
            + self.found.capacity() * size_of::<u32>()
            + self.whole.bytes()
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
        if SEVERAL && swept.terms.whole {
            return second_of_whole::<I, A, SEVERAL, TALLY>(swept, layer, &near.whole, virial);
        }
        let offset = *swept.offset.get_unchecked(layer);
        let base = swept.sums.0.offset(4 * offset);
        let layer_base = base.add(4 * near.first as usize);
        let species = swept.terms.species;
        let species_j = swept.species.as_ptr().wrapping_add(near.first as usize);
        let passes = near.rows.len();
        let width = passes * species;
        let mut banks = Banks([[[0.0; 4]; BANKS]; 16]);
        let mut done = vec![0; passes];
        let mut part = 0;
        while part < near.parts.len() {
            let [first, count] = near.parts.get_unchecked(part).map(|n| n as usize);
            let mut pass = 0;
            while pass < passes {
                let rows = &near.rows.get_unchecked(pass).0;
                let apart = &near.apart.get_unchecked(pass).0;
                let slopes = swept.slopes.at(pass * species).cast_const();
                let layer_slopes = slopes.add(width * near.first as usize);
                let own_slopes = slopes.add(width * first);
                let own_species = swept.species.as_ptr().wrapping_add(first);
                let begin = *done.get_unchecked(pass);
                let end = begin + *near.found.get_unchecked(part * passes + pass) as usize;
                let mut p = begin;
                while p < end {
                    let row = rows.as_ptr().add(p).cast::<A::Scalar>();
                    let code = (*row.add(3)).decode();
                    let (j, m) = ((code >> MEMBER_BITS) as usize, (code & ((1 << MEMBER_BITS) - 1)) as usize);
                    let there = layer_slopes.add(width * j);
                    let slope = if SEVERAL {
                        let (i, j) = (*own_species.add(m) as usize, *species_j.add(j) as usize);
                        *own_slopes.add(width * m + j) + *there.add(i)
                    } else {
                        *own_slopes.add(width * m) + *there
                    };
                    let force = A::load_quad(row).mul(I::Quad::splat(slope));
                    let at = layer_base.add(4 * j);
                    I::Quad::load(at).sub(force).store(at);
                    let at = banks.at(m, p);
                    I::Quad::load(at).add(force).store(at);
                    if TALLY {
                        add_dyad(*apart.get_unchecked(p), *rows.get_unchecked(p), slope, virial);
                    }
                    p += 1;
                }
                *done.get_unchecked_mut(pass) = end;
                pass += 1;
            }
            let mut m = 0;
            while m < count {
                add_to(base.add(4 * (first + m)), banks.take::<I::Quad>(m));
                m += 1;
            }
            part += 1;
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
