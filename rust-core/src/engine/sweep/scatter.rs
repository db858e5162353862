//! What pairs do, added to the accumulators of their particles.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::{Block, PLACE_BITS};
use super::layer::{Part, Shared, Swept};
use super::simd::{Isa, Quad, Reals};
use crate::model::kernel::Real;

/// An accumulator: a force, and the density if there is one variable; aligned so that none straddles lines of the
/// cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Sum(pub [f64; 4]);

const _: () = assert!(size_of::<Sum>() == 1 << PLACE_BITS);

/// Accumulators of a layer: for each particle some rows of four numbers.
#[derive(Clone, Copy)]
pub struct Accumulators {
    /// That of particle 0, were it of the layer.
    base: *mut f64,
    /// Rows of each particle, and which is meant.
    quads: usize,
    quad: usize,
}

impl Accumulators {
    /// One row each.
    #[inline(always)]
    pub fn new(base: *mut f64) -> Accumulators {
        Accumulators { base, quads: 1, quad: 0 }
    }

    /// The row of the particle at 32 times `place`.
    #[inline(always)]
    unsafe fn at(self, place: usize) -> *mut f64 {
        // SAFETY: the caller's.
        unsafe { self.base.byte_add(place * self.quads).add(4 * self.quad) }
    }
}

/// Pairs of particles that follow each other.
#[derive(Clone, Copy)]
pub struct Listed {
    /// 32 times the place of the second particle of each pair, and of any particle of the layer behind the last.
    pub places: *const u32,
    /// Before which pair those of each particle begin, and those of the last end; counted from any number.
    pub begin: *const u32,
    /// The first particle, and how many.
    pub first: usize,
    pub members: usize,
}

impl Listed {
    /// Those in hand.
    #[inline(always)]
    unsafe fn of<T>(block: &Block<T>, part: Part) -> Listed {
        let [first, last] = part.slots;
        // SAFETY: the caller's.
        let (places, begin) =
            unsafe { (block.j.as_ptr().add(part.pairs[0]), block.begin.as_ptr().add(first)) };
        Listed { places, begin, first: part.first, members: last - first }
    }
}

/// Adds the rows of pairs to both particles of each.
#[inline(always)]
pub unsafe fn scatter<I: Isa, A: Arithmetic<I>>(
    sums: Shared<f64>,
    variables: usize,
    offset: isize,
    block: &mut Block<A::Scalar>,
    part: Part,
) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        let to = Accumulators::new(sums.0.offset(4 * offset));
        let rows = block.rows.as_mut_ptr().cast::<A::Scalar>();
        // The second particle gets minus the row, so the weight in it is negative.
        // Nobody asks any more what pairs are, unless there are weights to come.
        let running =
            if variables > 1 { block.running.as_mut_ptr().cast() } else { block.pairs.as_mut_ptr().cast() };
        add_rows::<I, A>(to, rows, rows, running, [1.0, 1.0, 1.0, -1.0], Listed::of(block, part));
    }
}

/// Adds `own` rows times `sign` to the first particles of pairs, minus `rows` to the second ones.
///
/// # Safety
/// The contract of `simd`; accumulators are there, and room for a row and a sum behind the last pair.
#[inline(always)]
pub unsafe fn add_rows<I: Isa, A: Arithmetic<I>>(
    to: Accumulators,
    rows: *mut A::Scalar,
    own: *mut A::Scalar,
    running: *mut f64,
    sign: [f64; 4],
    pairs: Listed,
) {
    // SAFETY: the caller's.
    unsafe {
        let sign = I::Quad::load(sign.as_ptr());
        let Listed { places, begin, first, members } = pairs;
        // One loop over all, not one for each member, none of whose ends is to be foreseen: what a member gets is
        // the difference of two running sums, of which every other one is kept. Behind an odd number nothing follows.
        let zeroth = *begin as usize;
        let count = *begin.add(members) as usize - zeroth;
        rows.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        own.add(4 * count).cast::<[A::Scalar; 4]>().write([A::Scalar::default(); 4]);
        let sums = running;
        let mut sum = I::Quad::zero();
        let mut p = 0;
        while p < count {
            sum.store(sums.add(2 * p));
            let row = A::load_quad(rows.add(4 * p));
            let at = to.at(*places.add(p) as usize);
            I::Quad::load(at).sub(row).store(at);
            let next = A::load_quad(rows.add(4 * p + 4));
            let at = to.at(*places.add(p + 1) as usize);
            I::Quad::load(at).sub(next).store(at);
            let two = if own == rows {
                row.add(next)
            } else {
                A::load_quad(own.add(4 * p)).add(A::load_quad(own.add(4 * p + 4)))
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
            let odd = A::load_quad(own.add(4 * even)).mul(I::Quad::splat((end & 1) as f64));
            let all = I::Quad::load(sums.add(2 * even)).add(odd);
            add_to(to.at((first + m) << PLACE_BITS), all.sub(before).mul(sign));
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
pub unsafe fn add_to<Q: Quad>(p: *mut f64, x: Q) {
    // SAFETY: the contract of `simd`.
    unsafe { Q::load(p).add(x).store(p) }
}

/// `table[which[k]]` in lane `k`; `few` if the table is a vector. A function, as closures are compiled for the least that
/// any processor has if they are not inlined.
///
/// # Safety
/// The contract of `simd`.
#[inline(always)]
pub unsafe fn entry<R: Reals>(table: *const R::Scalar, which: R::Words, few: bool) -> R {
    // SAFETY: the caller's.
    unsafe { if few { R::pick(table, which) } else { R::lookup(table, which) } }
}

/// What is added for a column.
#[derive(Clone, Copy)]
struct WeightOf<T> {
    /// Minus the weights of its density.
    weight: *const T,
    /// Whether the first particle of a pair is of its species, and the second: tables.
    is_species: [*const T; 2],
}

/// Adds weights where there are several densities or species: a column for each density and species of the other
/// particle, four of them to a row.
#[inline(always)]
pub unsafe fn scatter_weights<I: Isa, A: Arithmetic<I>, const SEVERAL: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    offset: isize,
    block: &mut Block<A::Scalar>,
    part: Part,
) {
    // SAFETY: as `scatter`; there are weights and kinds of whole vectors.
    unsafe {
        let terms = swept.terms;
        let quads = swept.variables.div_ceil(4);
        let base = swept.densities.0.offset((4 * quads) as isize * offset);
        let rows = block.rows.as_mut_ptr().cast::<A::Scalar>();
        let own = if SEVERAL { block.own_rows.as_mut_ptr().cast() } else { rows };
        let vectors = part.count().div_ceil(A::Reals::LANES);
        let pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
        let few = terms.species * terms.species <= A::Reals::LANES;
        let zero = A::Reals::constant(0.0);
        let mut quad = 0;
        while quad < quads {
            let columns = 4.min(swept.variables - 4 * quad);
            let mut of = [WeightOf { weight: std::ptr::null(), is_species: [std::ptr::null(); 2] }; 4];
            let mut c = 0;
            while c < 4 {
                // Behind the last there is the last again.
                let column = 4 * quad + c.min(columns - 1);
                let [is_first, is_second] = terms.is_species.get_unchecked(column % terms.species);
                of[c].is_species = [is_first.as_ptr(), is_second.as_ptr()];
                of[c].weight = block.weight.get_unchecked(column / terms.species).as_ptr();
                c += 1;
            }
            let mut v = 0;
            while v < vectors {
                let k = v * A::Reals::LANES;
                let (mut to_second, mut to_first) = ([zero; 4], [zero; 4]);
                let mut c = 0;
                while c < 4 {
                    if c < columns {
                        let weight = A::Reals::load(of[c].weight.add(k));
                        to_second[c] = weight;
                        if SEVERAL {
                            let kind = (*pairs.add(v)).kind.0;
                            let [is_first, is_second] = of[c].is_species;
                            let is_first = entry::<A::Reals>(is_first, kind, few);
                            let is_second = entry::<A::Reals>(is_second, kind, few);
                            to_second[c] = weight * is_first;
                            to_first[c] = weight * is_second;
                        }
                    }
                    c += 1;
                }
                A::Reals::rows(to_second, rows.add(4 * k));
                if SEVERAL {
                    A::Reals::rows(to_first, own.add(4 * k));
                }
                v += 1;
            }
            // Both get minus a row: weights are negative.
            let to = Accumulators { base, quads, quad };
            let running = block.running.as_mut_ptr().cast();
            add_rows::<I, A>(to, rows, own, running, [-1.0; 4], Listed::of(block, part));
            quad += 1;
        }
    }
}
