//! What each term adds to the pairs, along `ê`.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::Block;
use super::evaluate::Kit;
use super::layer::{Part, Swept};
use super::simd::{Isa, Reals, Scalar, Words};
use super::terms::{Linear, Soft, Spline, Table};
use super::thermostat::Pull;
use crate::model::kernel::{CubicSpline, KernelKind, Real, Shape, ShapeVisitor};
use std::marker::PhantomData;

/// Which pair of species each pair of a vector is: the entry of tables.
#[derive(Clone, Copy)]
pub struct Kind<R: Reals>(pub R::Words);

impl<R: Reals> Kind<R> {
    /// Of the species of both particles.
    #[inline(always)]
    pub unsafe fn new(species_i: R::Words, species_j: R::Words, species: usize) -> Kind<R> {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut row = R::Words::splat(0);
            let mut k = 0;
            while k < species {
                row = row.add(species_i);
                k += 1;
            }
            Kind(row.add(species_j))
        }
    }
}

/// A table at hand: in a loop nothing of it is looked up twice.
#[derive(Clone, Copy)]
pub struct At<R: Reals> {
    first: R,
    entries: *const R::Scalar,
    few: bool,
}

impl<R: Reals> At<R> {
    #[inline(always)]
    pub unsafe fn new(table: &Table<R::Scalar>) -> At<R> {
        let entries = table.as_ptr();
        // SAFETY: the contract of `simd`; tables have an entry.
        At { first: unsafe { R::splat(*entries) }, entries, few: table.count() <= R::LANES }
    }

    /// The entries of pairs; with one species there is but one.
    #[inline(always)]
    pub unsafe fn of<const SEVERAL: bool>(&self, kind: Kind<R>) -> R {
        // SAFETY: the contract of `simd`; kinds are below the number of entries, and tables have room for a vector.
        unsafe {
            if !SEVERAL {
                self.first
            } else if self.few {
                R::pick(self.entries, kind.0)
            } else {
                R::lookup(self.entries, kind.0)
            }
        }
    }
}

/// What is summed over pairs, where it is asked for.
#[derive(Clone, Copy)]
pub struct Sums<R> {
    pub pair: R,
    pub excess: R,
    pub virial: [R; 6],
    pub thermostat: [R; 6],
}

impl<R: Reals> Sums<R> {
    #[inline(always)]
    pub fn zero() -> Sums<R> {
        let zero = R::constant(0.0);
        Sums { pair: zero, excess: zero, virial: [zero; 6], thermostat: [zero; 6] }
    }
}

/// Adds forces `f d` to a virial.
#[inline(always)]
pub unsafe fn add_virial<R: Reals>(f: R, d: [R; 3], sum: &mut [R; 6]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let fd = [f * d[0], f * d[1], f * d[2]];
        sum[0] = fd[0].mul_add(d[0], sum[0]);
        sum[1] = fd[1].mul_add(d[1], sum[1]);
        sum[2] = fd[2].mul_add(d[2], sum[2]);
        sum[3] = fd[0].mul_add(d[1], sum[3]);
        sum[4] = fd[0].mul_add(d[2], sum[4]);
        sum[5] = fd[1].mul_add(d[2], sum[5]);
    }
}

/// The sum of the lanes.
#[inline(always)]
pub unsafe fn sum<R: Reals>(x: R) -> f64 {
    let mut lanes = [R::Scalar::default(); 16];
    // SAFETY: no vector has more lanes.
    unsafe { x.store(lanes.as_mut_ptr()) };
    let mut sum = 0.0;
    for lane in &lanes[..R::LANES] {
        sum += lane.wide();
    }
    sum
}

/// Rows of forces, and of minus the weight if there is one density: of the first soft term, drag and noise, and
/// whatever other terms have left in `conservative`.
#[inline(always)]
pub unsafe fn forces<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    kit: &Kit<I, A>,
    block: &mut Block<A::Scalar>,
    part: Part,
    sums: &mut Sums<A::Reals>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let terms = swept.terms;
        let vectors = part.count().div_ceil(A::Reals::LANES);
        let zero = A::Reals::constant(0.0);
        let p_pairs = block.pairs.as_ptr().cast::<Pairs<A::Reals>>();
        let p_rows = block.rows.as_mut_ptr().cast::<A::Scalar>();
        let p_conservative = block.conservative.as_ptr();
        let p_noise = block.tags[0].as_ptr();
        let p_share = block.share.as_ptr();
        let p_weight = if swept.variables == 1 { block.weight[0].as_ptr() } else { std::ptr::null() };
        let p_whole =
            if SEVERAL && terms.whole { block.conservative.as_mut_ptr() } else { std::ptr::null_mut() };
        let more = terms.has_more();
        let soft = SoftAt::<A::Reals>::new(terms.first_soft());
        let pull = terms.drag.as_ref().filter(|_| kit.noise.is_some());
        let pull = pull.map(|drag| Pull::<A::Reals>::new(drag, kit.unit));
        let mut v = 0;
        while v < vectors {
            let k = v * A::Reals::LANES;
            let pairs = &*p_pairs.add(v);
            let (r, kind) = (pairs.apart.r, pairs.kind);
            let share = if TALLY { A::Reals::load(p_share.add(k)) } else { zero };
            let mut force = if more { A::Reals::load(p_conservative.add(k)) } else { zero };
            force = soft.add::<SEVERAL, TALLY>(r, kind, force, share, &mut sums.pair);
            if TALLY {
                add_virial(force * (share * pairs.apart.inverse), pairs.apart.d, &mut sums.virial);
            }
            if let Some(pull) = &pull {
                let word = <A::Reals as Reals>::Words::load(p_noise.add(k));
                let thermostat = pull.force::<SEVERAL>(pairs, word);
                if TALLY {
                    let f = thermostat * (share * pairs.apart.inverse);
                    add_virial(f, pairs.apart.d, &mut sums.thermostat);
                }
                force = force + thermostat;
            }
            if SEVERAL && !p_whole.is_null() {
                (force * pairs.apart.inverse).store(p_whole.add(k));
                v += 1;
                continue;
            }
            let weight = if p_weight.is_null() { zero } else { A::Reals::load(p_weight.add(k)) };
            let f = force * pairs.apart.inverse;
            let [dx, dy, dz] = pairs.apart.d;
            A::Reals::rows([f * dx, f * dy, f * dz, weight], p_rows.add(4 * k));
            v += 1;
        }
    }
}

/// A term at hand.
trait Term<R: Reals> {
    /// `before − φ′(r)`, and the energy, if it is asked for.
    unsafe fn add<const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R;
}

/// Adds the forces of a term to those that the block has.
#[inline(always)]
unsafe fn each<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: impl Term<R>,
    block: &mut Block<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let p_pairs = block.pairs.as_ptr().cast::<Pairs<R>>();
        let p_force = block.conservative.as_mut_ptr();
        let p_share = block.share.as_ptr();
        let mut v = 0;
        while v < vectors {
            let pairs = &*p_pairs.add(v);
            let p = p_force.add(v * R::LANES);
            let share = if TALLY { R::load(p_share.add(v * R::LANES)) } else { R::constant(0.0) };
            term.add::<SEVERAL, TALLY>(pairs.apart.r, pairs.kind, R::load(p), share, energy).store(p);
            v += 1;
        }
    }
}

/// `φ = ½ a R (1 − r/R)²`.
struct SoftAt<R: Reals> {
    strength: At<R>,
    inverse_range: At<R>,
    energy: At<R>,
}

impl<R: Reals> SoftAt<R> {
    #[inline(always)]
    unsafe fn new(term: &Soft<R::Scalar>) -> Self {
        // SAFETY: the contract of `simd`.
        unsafe {
            SoftAt {
                strength: At::new(&term.strength),
                inverse_range: At::new(&term.inverse_range),
                energy: At::new(&term.energy),
            }
        }
    }
}

impl<R: Reals> Term<R> for SoftAt<R> {
    #[inline(always)]
    unsafe fn add<const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let t = (one - r * self.inverse_range.of::<SEVERAL>(kind)).larger(zero);
            if TALLY {
                *energy = (t * t).mul_add(share * self.energy.of::<SEVERAL>(kind), *energy);
            }
            t.mul_add(self.strength.of::<SEVERAL>(kind), before)
        }
    }
}

/// Adds the forces of a soft term.
#[inline(always)]
pub unsafe fn add_soft<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: &Soft<R::Scalar>,
    block: &mut Block<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
    unsafe { each::<R, SEVERAL, TALLY>(SoftAt::<R>::new(term), block, vectors, energy) }
}

/// `φ = (c_αβ + c_βα) w(r)`, for one kernel of the force.
struct LinearAt<R: Reals, S> {
    kind: KernelKind,
    inverse_range: R,
    force_inverse_range: R,
    force: At<R>,
    energy: At<R>,
    shape: PhantomData<S>,
}

impl<R: Reals, S: Shape> Term<R> for LinearAt<R, S> {
    #[inline(always)]
    unsafe fn add<const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let one = R::constant(1.0);
            if TALLY {
                let s = r * self.inverse_range;
                let w = self.energy.of::<SEVERAL>(kind) * self.kind.visit(Value(s));
                *energy = w.where_below(s, one).mul_add(share, *energy);
            }
            let s = r * self.force_inverse_range;
            let force = self.force.of::<SEVERAL>(kind) * S::slope(s);
            before + force.where_below(s, one)
        }
    }
}

/// Adds the forces of a density that every ψ is linear in.
#[inline(always)]
pub unsafe fn add_linear<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: &Linear<R::Scalar>,
    block: &mut Block<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    term.force_kind.visit(AddLinear::<R, SEVERAL, TALLY> { term, block, vectors, energy });
}

struct AddLinear<'a, R: Reals, const SEVERAL: bool, const TALLY: bool> {
    term: &'a Linear<R::Scalar>,
    block: &'a mut Block<R::Scalar>,
    vectors: usize,
    energy: &'a mut R,
}

impl<R: Reals, const SEVERAL: bool, const TALLY: bool> ShapeVisitor for AddLinear<'_, R, SEVERAL, TALLY> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `add_linear`.
        unsafe {
            let term = LinearAt::<R, S> {
                kind: self.term.kind,
                inverse_range: R::splat(self.term.inverse_range),
                force_inverse_range: R::splat(self.term.force_inverse_range),
                force: At::new(&self.term.force),
                energy: At::new(&self.term.energy),
                shape: PhantomData,
            };
            each::<R, SEVERAL, TALLY>(term, self.block, self.vectors, self.energy);
        }
    }
}

/// `W(s)`.
struct Value<R>(R);

impl<R: Reals> ShapeVisitor for Value<R> {
    type Output = R;
    #[inline(always)]
    fn visit<S: Shape>(self) -> R {
        S::value(self.0)
    }
}

/// `φ = a [A W(r, R_A) − B W(r, R_B)]`.
struct SplineAt<R: Reals> {
    repulsion: At<R>,
    attraction: At<R>,
    repulsion_inverse_range: At<R>,
    attraction_inverse_range: At<R>,
}

impl<R: Reals> Term<R> for SplineAt<R> {
    #[inline(always)]
    unsafe fn add<const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let inverse_a = self.repulsion_inverse_range.of::<SEVERAL>(kind);
            let inverse_b = self.attraction_inverse_range.of::<SEVERAL>(kind);
            // At s = 1 the shape and its slope vanish; beyond, it stays there.
            let a = one - (one - r * inverse_a).larger(zero);
            let b = one - (one - r * inverse_b).larger(zero);
            let repulsion = self.repulsion.of::<SEVERAL>(kind);
            let attraction = self.attraction.of::<SEVERAL>(kind);
            if TALLY {
                let phi = repulsion * CubicSpline::value(a) - attraction * CubicSpline::value(b);
                *energy = phi.mul_add(share, *energy);
            }
            let slope = repulsion * inverse_a * CubicSpline::slope(a)
                - attraction * inverse_b * CubicSpline::slope(b);
            before - slope
        }
    }
}

/// Adds the forces of spline potentials.
#[inline(always)]
pub unsafe fn add_spline<R: Reals, const SEVERAL: bool, const TALLY: bool>(
    term: &Spline<R::Scalar>,
    block: &mut Block<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let term = SplineAt::<R> {
            repulsion: At::new(&term.repulsion),
            attraction: At::new(&term.attraction),
            repulsion_inverse_range: At::new(&term.repulsion_inverse_range),
            attraction_inverse_range: At::new(&term.attraction_inverse_range),
        };
        each::<R, SEVERAL, TALLY>(term, block, vectors, energy);
    }
}
