//! Pairs of which everything is kept for the second pass: with several densities or species, it finds the whole force of a
//! pair, and adds it to both particles once.
//!
//! The first pass then adds weights alone. Nothing is gained for one density: its weight goes with the force.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::{Block, Lines};
use super::forces::{add_virial, sum};
use super::layer::{Part, Swept};
use super::many_body::make_room;
use super::scatter::{Accumulators, Listed, Sum, add_rows, entry};
use super::simd::{Isa, Reals, Scalar, Words};
use super::terms::Pass;
use crate::model::kernel::{Real, Shape, ShapeVisitor};

/// What the first pass of a layer leaves for the second: columns of pairs, those of a vector's worth of first particles
/// after those of another, each from a whole vector on.
#[derive(Debug, Clone, Default)]
pub struct WholePairs<T> {
    /// `r_i − r_j`; the force that needs no density, over `r`; `−w′(r)/r` of each density; and the share of each pair, if
    /// virials are wanted.
    columns: Vec<Vec<Vector<T>>>,
    /// The second particle: 32 times its place in the order of cells.
    places: Vec<Vector<u32>>,
    /// The first particle, a number in its part; with several species also 16 times the pair of species.
    codes: Vec<Vector<u32>>,
    parts: Vec<WholePart>,
    /// Vectors that each column has, and has room for.
    end: usize,
    room: usize,
    /// Most pairs of a part.
    most: usize,
}

/// Columns of `r_i − r_j`, of forces, and the first of the densities.
const APART: usize = 0;
const FORCE: usize = 3;
const NEAR: usize = 4;

/// Sixteen numbers.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Vector<T>([T; 16]);

/// A vector's worth of first particles.
#[derive(Debug, Clone, Copy)]
struct WholePart {
    /// The first of them, and how many.
    first: u32,
    members: u32,
    /// Before which pair those of each begin, and those of the last end.
    begin: [u32; 17],
    /// The vector that holds the first pair.
    vector: usize,
}

/// The bits of a code that tell the first particle.
const MEMBER_BITS: u32 = 4;

/// Where vector `end` goes, one past the last.
#[inline(always)]
unsafe fn at<T>(column: &mut Vec<Vector<T>>, end: usize) -> *mut T {
    // SAFETY: the caller's.
    unsafe { column.as_mut_ptr().add(end).cast() }
}

impl<T: Scalar> WholePairs<T> {
    pub fn clear(&mut self, passes: usize, tally: bool) {
        self.columns.resize_with(NEAR + passes + tally as usize, Vec::new);
        self.columns.iter_mut().for_each(Vec::clear);
        self.places.clear();
        self.codes.clear();
        self.parts.clear();
        (self.end, self.most) = (0, 0);
        self.find_room();
    }

    fn find_room(&mut self) {
        let columns = self.columns.iter().map(Vec::capacity).min().unwrap_or(0);
        self.room = columns.min(self.places.capacity()).min(self.codes.capacity());
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
            for column in &mut self.columns {
                column.set_len(self.end);
                make_room(column, more);
            }
            for column in [&mut self.places, &mut self.codes] {
                column.set_len(self.end);
                make_room(column, more);
            }
        }
        self.find_room();
    }

    /// The end of a column, which there is.
    #[inline(always)]
    unsafe fn column(&mut self, column: usize) -> *mut T {
        // SAFETY: the caller's.
        unsafe { at(self.columns.get_unchecked_mut(column), self.end) }
    }

    /// Counts the pairs that were written behind the last, and something behind them.
    #[inline(always)]
    unsafe fn add(&mut self, block: &Block<T>, part: Part) {
        // SAFETY: the caller's.
        unsafe {
            let [slot, last] = part.slots;
            let mut begin = [0; 17];
            let mut m = 1;
            while m <= last - slot {
                begin[m] = *block.begin.get_unchecked(slot + m) - part.pairs[0] as u32;
                m += 1;
            }
            let members = (last - slot) as u32;
            make_room(&mut self.parts, 1);
            self.parts.push(WholePart { first: part.first as u32, members, begin, vector: self.end });
        }
        self.most = self.most.max(part.count());
        self.end += part.count() / 16 + 1;
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.columns.iter().map(|column| column.capacity() * size_of::<Vector<T>>()).sum::<usize>()
            + (self.places.capacity() + self.codes.capacity()) * size_of::<Vector<u32>>()
            + self.parts.capacity() * size_of::<WholePart>()
    }
}

/// Appends all pairs of a part.
#[inline(always)]
pub unsafe fn keep_whole<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &Block<A::Scalar>,
    whole: &mut WholePairs<A::Scalar>,
    part: Part,
) {
    // SAFETY: the contract of `simd`; blocks have whole vectors.
    unsafe {
        type W<I, A> = <<A as Arithmetic<I>>::Reals as Reals>::Words;
        let lanes = A::Reals::LANES;
        let count = part.count();
        let vectors = count.div_ceil(lanes);
        whole.reserve(count);
        let pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
        for (pass, term) in swept.terms.passes.iter().enumerate() {
            let to = whole.column(NEAR + pass);
            term.force_kind.visit(Slopes::<A::Reals> { term, pairs, vectors, to });
        }
        let to_apart = [0, 1, 2].map(|c| whole.column(APART + c));
        let (to_force, force) = (whole.column(FORCE), block.conservative.as_ptr());
        let share = block.share.as_ptr();
        let to_share =
            if TALLY { whole.column(NEAR + swept.terms.passes.len()) } else { std::ptr::null_mut() };
        let (places, codes) = (at(&mut whole.places, whole.end), at(&mut whole.codes, whole.end));
        let which = block.which.as_ptr().add(part.pairs[0]);
        let j = block.j.as_ptr().add(part.pairs[0]);
        let mut v = 0;
        while v < vectors {
            let k = v * lanes;
            let Pairs { apart, kind } = &*pairs.add(v);
            let mut code = W::<I, A>::load_bytes(which.add(k));
            if SEVERAL {
                code = code.add(kind.0.rotate(MEMBER_BITS));
            }
            code.store(codes.add(k));
            W::<I, A>::load(j.add(k)).store(places.add(k));
            let mut c = 0;
            while c < 3 {
                apart.d[c].store(to_apart[c].add(k));
                c += 1;
            }
            A::Reals::load(force.add(k)).store(to_force.add(k));
            if TALLY {
                A::Reals::load(share.add(k)).store(to_share.add(k));
            }
            v += 1;
        }
        // What is behind the last is added to some particle of the layer: nothing.
        *places.add(count) = *j;
        whole.add(block, part);
    }
}

/// The loop over vectors for one density, of one kernel.
struct Slopes<'a, R: Reals> {
    term: &'a Pass<R::Scalar>,
    pairs: *const Pairs<R>,
    vectors: usize,
    to: *mut R::Scalar,
}

impl<R: Reals> ShapeVisitor for Slopes<'_, R> {
    type Output = ();

    /// `−w′(r)/r`, zero beyond the range: lanes behind the last pair are out of reach.
    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `keep_whole`; there is room for whole vectors.
        unsafe {
            let range = R::splat(self.term.force_range);
            let inverse_range = R::splat(self.term.force_inverse_range);
            let factor = R::splat(self.term.force);
            let mut v = 0;
            while v < self.vectors {
                let pairs = &(*self.pairs.add(v)).apart;
                let g = factor * S::slope(pairs.r * inverse_range) * pairs.inverse;
                g.where_below(pairs.r, range).store(self.to.add(v * R::LANES));
                v += 1;
            }
        }
    }
}

/// Slopes of a particle that are read at once.
pub const SLOPES: usize = 8;

/// Second pass over pairs that were kept whole.
///
/// # Safety
/// As [`first_pass`](super::layer::first_pass).
#[inline(always)]
pub unsafe fn second_of_whole<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    layer: usize,
    whole: &WholePairs<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the caller's.
    unsafe {
        let offset = *swept.offset.get_unchecked(layer);
        let to = Accumulators::new(swept.sums.0.offset(4 * offset));
        // As many as whole vectors have, and a row behind.
        let room = whole.most / 16 + 2;
        let mut rows: Vec<Lines<A::Scalar>> = vec![Lines::default(); room];
        let mut running: Vec<Sum> = vec![Sum::default(); 8 * room];
        let mut factors: Vec<Lines<A::Scalar>> = vec![Lines::default(); room];
        let rows = rows.as_mut_ptr().cast::<A::Scalar>();
        let factors = factors.as_mut_ptr().cast::<A::Scalar>();
        for part in &whole.parts {
            let pairs = InHand {
                whole,
                part,
                vectors: (part.begin[part.members as usize] as usize).div_ceil(A::Reals::LANES),
            };
            if swept.variables <= 4 && swept.terms.species <= 2 {
                find_factors::<I, A, SEVERAL, 4>(swept, &pairs, 0, factors);
            } else {
                let mut first = 0;
                while first < swept.variables {
                    find_factors::<I, A, SEVERAL, SLOPES>(swept, &pairs, first, factors);
                    first += SLOPES;
                }
            }
            push::<A::Reals, TALLY>(&pairs, factors, rows, virial);
            let listed = Listed {
                places: pairs.places(),
                begin: part.begin.as_ptr(),
                first: part.first as usize,
                members: part.members as usize,
            };
            add_rows::<I, A>(to, rows, rows, running.as_mut_ptr().cast(), [1.0, 1.0, 1.0, 0.0], listed);
        }
    }
}

/// The pairs of a part.
struct InHand<'a, T> {
    whole: &'a WholePairs<T>,
    part: &'a WholePart,
    vectors: usize,
}

impl<T> InHand<'_, T> {
    #[inline(always)]
    unsafe fn column(&self, column: usize) -> *const T {
        // SAFETY: the caller's.
        unsafe { self.whole.columns.get_unchecked(column).as_ptr().add(self.part.vector).cast() }
    }

    #[inline(always)]
    unsafe fn places(&self) -> *const u32 {
        // SAFETY: the caller's.
        unsafe { self.whole.places.as_ptr().add(self.part.vector).cast() }
    }

    #[inline(always)]
    unsafe fn codes(&self) -> *const u32 {
        // SAFETY: the caller's.
        unsafe { self.whole.codes.as_ptr().add(self.part.vector).cast() }
    }
}

/// What a slope is multiplied by.
#[derive(Clone, Copy)]
struct SlopeOf<T> {
    /// `−w′/r` of its density.
    near: *const T,
    /// Whether the first particle of a pair is of its species, and the second: tables.
    is_species: [*const T; 2],
}

/// Slopes of a vector's worth of particles, column by column.
#[repr(C, align(64))]
struct OwnSlopes<T>([[T; 16]; SLOPES]);

/// Adds `Σ (∂ψ_i + ∂ψ_j) (−w′/r)` over up to `N` slopes to the factors of pairs, or begins these. Each particle has a slope
/// for the species of the other. With four there are at most two species.
#[inline(always)]
unsafe fn find_factors<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const N: usize>(
    swept: &Swept<A::Scalar, A::Record>,
    pairs: &InHand<A::Scalar>,
    first: usize,
    factors: *mut A::Scalar,
) {
    // SAFETY: the contract of `simd`; there are slopes of a vector's worth behind the last particle.
    unsafe {
        let zero = A::Reals::constant(0.0);
        let species = swept.terms.species;
        let count = N.min(swept.variables - first);
        let slopes = swept.slope_rows.at(first / SLOPES * swept.slope_room).cast_const();
        let mut own = OwnSlopes([[A::Scalar::default(); 16]; SLOPES]);
        let columns = A::own_columns(slopes.add(SLOPES * pairs.part.first as usize));
        // Tables of a vector, or more.
        let few = species * species <= A::Reals::LANES;
        let mut of = [SlopeOf { near: std::ptr::null(), is_species: [std::ptr::null(); 2] }; SLOPES];
        let mut c = 0;
        while c < N {
            columns[c].store(own.0[c].as_mut_ptr());
            // Behind the last there is the last again.
            let at = first + c.min(count - 1);
            let [is_first, is_second] = swept.terms.is_species.get_unchecked(at % species);
            of[c].is_species = [is_first.as_ptr(), is_second.as_ptr()];
            of[c].near = pairs.column(NEAR + at / species);
            c += 1;
        }
        let mut v = 0;
        while v < pairs.vectors {
            let k = v * A::Reals::LANES;
            let code = <A::Reals as Reals>::Words::load(pairs.codes().add(k));
            let kind = code.shift_right::<MEMBER_BITS>();
            let there = if N == 4 {
                A::columns_at::<false>(slopes, pairs.places().add(k))
            } else {
                A::columns_at::<true>(slopes, pairs.places().add(k))
            };
            let mut factor = if first == 0 { zero } else { A::Reals::load(factors.add(k)) };
            if SEVERAL && N == 4 {
                // One species after the other.
                let (mut from_i, mut from_j) = ([zero; 2], [zero; 2]);
                let mut c = 0;
                while c < N {
                    if c < count {
                        let near = A::Reals::load(of[c].near.add(k));
                        let here = A::Reals::pick(own.0[c].as_ptr(), code);
                        from_i[c % 2] = here.mul_add(near, from_i[c % 2]);
                        from_j[c % 2] = there[c].mul_add(near, from_j[c % 2]);
                    }
                    c += 1;
                }
                let mut s = 0;
                while s < 2 {
                    let [is_first, is_second] = of[s].is_species;
                    factor = from_j[s].mul_add(A::Reals::pick(is_first, kind), factor);
                    factor = from_i[s].mul_add(A::Reals::pick(is_second, kind), factor);
                    s += 1;
                }
            } else {
                let mut c = 0;
                while c < N {
                    if c < count {
                        let near = A::Reals::load(of[c].near.add(k));
                        let here = A::Reals::pick(own.0[c].as_ptr(), code);
                        let slope = if SEVERAL {
                            let [is_first, is_second] = of[c].is_species;
                            let is_first = entry::<A::Reals>(is_first, kind, few);
                            let is_second = entry::<A::Reals>(is_second, kind, few);
                            here.mul_add(is_second, there[c] * is_first)
                        } else {
                            here + there[c]
                        };
                        factor = slope.mul_add(near, factor);
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
unsafe fn push<R: Reals, const TALLY: bool>(
    pairs: &InHand<R::Scalar>,
    factors: *const R::Scalar,
    rows: *mut R::Scalar,
    virial: &mut [f64; 6],
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let [x, y, z] = [0, 1, 2].map(|c| pairs.column(APART + c));
        let force = pairs.column(FORCE);
        let share = if TALLY { pairs.column(pairs.whole.columns.len() - 1) } else { std::ptr::null() };
        let zero = R::constant(0.0);
        let mut sums = [zero; 6];
        let mut v = 0;
        while v < pairs.vectors {
            let k = v * R::LANES;
            let factor = R::load(factors.add(k));
            let d = [R::load(x.add(k)), R::load(y.add(k)), R::load(z.add(k))];
            let whole = R::load(force.add(k)) + factor;
            R::rows([whole * d[0], whole * d[1], whole * d[2], zero], rows.add(4 * k));
            if TALLY {
                add_virial(factor * R::load(share.add(k)), d, &mut sums);
            }
            v += 1;
        }
        if TALLY {
            for c in 0..6 {
                virial[c] += sum(sums[c]);
            }
        }
    }
}
