//! The pairs that a density reaches: kept by the first pass, and given their forces, after ψ, by the second.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::evaluate::{add_to, collect_near, count_bits};
use super::layer::Swept;
use super::simd::{Isa, Quad, Reals, Scalar};

/// What the first pass of a layer leaves for the second.
#[derive(Debug, Clone, Default)]
pub struct NearPairs<T> {
    /// For each density: rows `−w′ ê` and the second particle, those of one particle after another.
    pub rows: Vec<Vec<[T; 4]>>,
    /// `r_i − r_j`, if virials are wanted.
    pub distances: Vec<Vec<[T; 3]>>,
    /// How many there are for each particle that has looked for any.
    pub counts: Vec<Vec<u32>>,
    /// These particles, where they are not all of the layer.
    pub members: Vec<u32>,
    /// `share` of each, if virials are wanted.
    pub shares: Vec<Vec<T>>,
}

impl<T> NearPairs<T> {
    pub fn clear(&mut self, passes: usize) {
        self.rows.resize_with(passes, Vec::new);
        self.distances.resize_with(passes, Vec::new);
        self.counts.resize_with(passes, Vec::new);
        self.shares.resize_with(passes, Vec::new);
        self.rows.iter_mut().for_each(Vec::clear);
        self.distances.iter_mut().for_each(Vec::clear);
        self.counts.iter_mut().for_each(Vec::clear);
        self.members.clear();
        self.shares.iter_mut().for_each(Vec::clear);
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

/// Keeps the pairs within the range of a density for the second pass.
#[inline(always)]
pub unsafe fn keep_near<I: Isa, A: Arithmetic<I>, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    pass: usize,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        if block.count == 0 {
            let counts = &mut near.counts[pass];
            counts.resize(counts.len() + block.members.len(), 0);
            return;
        }
        let found = collect_near::<I, A::Reals, TALLY>(&swept.terms.passes[pass], block);
        A::encode_all(block.near_j.as_ptr(), block.near_code.as_mut_ptr(), found);
        let rows = &mut near.rows[pass];
        make_room(rows, found + 16);
        let out = rows.as_mut_ptr().add(rows.len()).cast::<A::Scalar>();
        let near_at = [block.near[0].as_ptr(), block.near[1].as_ptr(), block.near[2].as_ptr()];
        let code = block.near_code.as_ptr();
        let mut k = 0;
        while k < found {
            let columns = [
                A::Reals::load(near_at[0].add(k)),
                A::Reals::load(near_at[1].add(k)),
                A::Reals::load(near_at[2].add(k)),
                A::Reals::load(code.add(k)),
            ];
            A::Reals::rows(columns, out.add(4 * k));
            k += A::Reals::LANES;
        }
        rows.set_len(rows.len() + found);
        let counts = &mut near.counts[pass];
        let members = block.members.len();
        make_room(counts, members);
        let out = counts.as_mut_ptr().add(counts.len());
        let (begin, bits) = (block.begin.as_ptr(), block.bits.as_ptr());
        let mut from = 0;
        let mut m = 0;
        while m < members {
            let to = *begin.add(m + 1) as usize;
            *out.add(m) = count_bits(bits, from, to);
            from = to;
            m += 1;
        }
        counts.set_len(counts.len() + members);
        if TALLY {
            for k in 0..found {
                near.distances[pass].push([block.near_d[0][k], block.near_d[1][k], block.near_d[2][k]]);
            }
            for p in 0..block.count {
                if block.bits[p / 64] >> (p % 64) & 1 == 1 {
                    near.shares[pass].push(block.share[p]);
                }
            }
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
        let grid = swept.grid;
        let first = swept.start[layer * grid.rows * grid.bins] as usize;
        let offset = *swept.offset.get_unchecked(layer);
        let base = swept.sums.0.offset(4 * offset);
        let species = swept.terms.species;
        let width = swept.terms.passes.len() * species;
        let mut pass = 0;
        while pass < swept.terms.passes.len() {
            let rows = near.rows.get_unchecked(pass);
            let counts = near.counts.get_unchecked(pass);
            let slopes = swept.slopes.as_ptr().add(pass * species);
            let some = !swept.ghost.is_empty();
            let mut p = 0;
            let mut m = 0;
            while m < counts.len() {
                let i = if some { *near.members.get_unchecked(m) as usize } else { first + m };
                let end = p + *counts.get_unchecked(m) as usize;
                let mut sum = I::Quad::zero();
                let own = slopes.add(width * i);
                let si = if SEVERAL { *swept.species.get_unchecked(i) as usize } else { 0 };
                while p < end {
                    let row = rows.as_ptr().add(p).cast::<A::Scalar>();
                    let j = A::decode(*row.add(3)) as usize;
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
                        let share = near.shares[pass][p].wide();
                        add_dyad(near.distances[pass][p], *rows.get_unchecked(p), slope * share, virial);
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
fn add_dyad<T: Scalar>(d: [T; 3], g: [T; 4], factor: f64, virial: &mut [f64; 6]) {
    let d = d.map(T::wide);
    let f = [g[0].wide() * factor, g[1].wide() * factor, g[2].wide() * factor];
    for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        virial[k] += f[a] * d[b];
    }
}
