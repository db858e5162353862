//! The forces of each term along `ê`.

use super::batch::Batch;
use super::buffers::BatchBuffers;
use super::inputs::PairInputs;
use super::step_constants::StepConstants;
use super::thermostat::ThermostatForce;
use crate::ground::arithmetic::{Arithmetic, PairVector};
use crate::ground::species_pairs::{SpeciesPair, TableLookup};
use crate::ground::terms::{Linear, Soft, Spline};
use crate::simd::{Isa, Reals, Scalar, Words};
use psidpd_model::kernel::{CubicSpline, KernelKind, Real, Shape, ShapeVisitor};
use std::marker::PhantomData;

/// Energies and virials, with one sum in each lane.
#[derive(Clone, Copy)]
pub struct PairSums<R> {
    pub pair: R,
    pub excess: R,
    pub virial: [R; 6],
    pub thermostat: [R; 6],
    /// That of drag alone.
    pub drag: [R; 6],
}

impl<R: Reals> PairSums<R> {
    #[inline(always)]
    pub fn zero() -> PairSums<R> {
        let zero = R::constant(0.0);
        PairSums { pair: zero, excess: zero, virial: [zero; 6], thermostat: [zero; 6], drag: [zero; 6] }
    }
}

/// Adds the virial of the forces `f d`.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
pub unsafe fn add_virial<R: Reals>(f: R, d: [R; 3], sum: &mut [R; 6]) {
    // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
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
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
pub unsafe fn sum_lanes<R: Reals>(x: R) -> f64 {
    let mut lanes = [R::Scalar::default(); 16];
    // SAFETY: no vector has more lanes than `lanes` has elements.
    unsafe { x.store(lanes.as_mut_ptr()) };
    let mut sum = 0.0;
    for lane in &lanes[..R::LANES] {
        sum += lane.wide();
    }
    sum
}

/// Writes the quads of the batch, `fx, fy, fz` and with one density `−w`: the first soft term, the
/// thermostat, and the forces of the other terms in `conservative`. For the full pair cache it writes
/// forces over `r` to `conservative` instead.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain distances, noise and weights of the batch.
#[inline(always)]
pub unsafe fn forces<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    inputs: &PairInputs<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut BatchBuffers<A::Scalar>,
    batch: Batch,
    sums: &mut PairSums<A::Reals>,
) {
    // SAFETY: `BatchBuffers::reserve` has made room for whole vectors in every array.
    unsafe {
        let terms = inputs.terms;
        let vectors = batch.count.div_ceil(A::Reals::LANES);
        let zero = A::Reals::constant(0.0);
        let p_pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        let p_quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        let p_conservative = buffers.conservative.as_mut_ptr();
        let p_noise = buffers.tags[0].as_ptr();
        let p_pair_weight = buffers.pair_weight.as_ptr();
        let p_weight =
            if terms.variables() == 1 { buffers.kernel_weights[0].as_ptr() } else { std::ptr::null() };
        let to_cache = MULTISPECIES && terms.full_cache;
        let has_more = terms.has_more();
        let soft = SoftTerm::<A::Reals>::new(&terms.soft[0]);
        let thermostat = terms.thermostat.as_ref().filter(|_| constants.noise.is_some());
        let thermostat = thermostat.map(|t| ThermostatForce::<A::Reals>::new(t, constants.noise_scale));
        let mut v = 0;
        while v < vectors {
            let k = v * A::Reals::LANES;
            let pairs = &*p_pairs.add(v);
            let (r, species_pair) = (pairs.geometry.r, pairs.species_pair);
            let pair_weight = if TALLY { A::Reals::load(p_pair_weight.add(k)) } else { zero };
            let mut force = if has_more { A::Reals::load(p_conservative.add(k)) } else { zero };
            force = soft.add::<MULTISPECIES, TALLY>(r, species_pair, force, pair_weight, &mut sums.pair);
            if TALLY {
                let f = force * (pair_weight * pairs.geometry.inverse);
                add_virial(f, pairs.geometry.d, &mut sums.virial);
            }
            if let Some(thermostat) = &thermostat {
                let word = <A::Reals as Reals>::Words::load(p_noise.add(k));
                let [f, drag] = thermostat.force::<MULTISPECIES>(pairs, word);
                if TALLY {
                    let per_length = pair_weight * pairs.geometry.inverse;
                    add_virial(f * per_length, pairs.geometry.d, &mut sums.thermostat);
                    add_virial(drag * per_length, pairs.geometry.d, &mut sums.drag);
                }
                force = force + f;
            }
            if to_cache {
                (force * pairs.geometry.inverse).store(p_conservative.add(k));
                v += 1;
                continue;
            }
            let weight = if p_weight.is_null() { zero } else { A::Reals::load(p_weight.add(k)) };
            let f = force * pairs.geometry.inverse;
            let [dx, dy, dz] = pairs.geometry.d;
            A::Reals::store_transposed([f * dx, f * dy, f * dz, weight], p_quads.add(4 * k));
            v += 1;
        }
    }
}

/// A term, prepared for a loop over pairs. Callers of its functions fulfil the contract of `simd`.
trait Term<R: Reals> {
    /// Returns `before − φ′(r)`; adds to the energy with `TALLY`.
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R;
}

/// Adds the forces of a term to those in the buffers.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The buffers contain the distances of `vectors` vectors.
#[inline(always)]
unsafe fn each<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: impl Term<R>,
    buffers: &mut BatchBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: `BatchBuffers::reserve` pads all arrays of a batch to whole vectors.
    unsafe {
        let p_pairs = buffers.pairs.as_ptr().cast::<PairVector<R>>();
        let p_force = buffers.conservative.as_mut_ptr();
        let p_pair_weight = buffers.pair_weight.as_ptr();
        let mut v = 0;
        while v < vectors {
            let pairs = &*p_pairs.add(v);
            let p = p_force.add(v * R::LANES);
            let pair_weight = if TALLY { R::load(p_pair_weight.add(v * R::LANES)) } else { R::constant(0.0) };
            term.add::<MULTISPECIES, TALLY>(
                pairs.geometry.r,
                pairs.species_pair,
                R::load(p),
                pair_weight,
                energy,
            )
            .store(p);
            v += 1;
        }
    }
}

/// The potential `φ = ½ a R (1 − r/R)²`.
struct SoftTerm<R: Reals> {
    strength: TableLookup<R>,
    inverse_range: TableLookup<R>,
    energy: TableLookup<R>,
}

impl<R: Reals> SoftTerm<R> {
    #[inline(always)]
    unsafe fn new(term: &Soft<R::Scalar>) -> Self {
        // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
        unsafe {
            SoftTerm {
                strength: TableLookup::new(&term.strength),
                inverse_range: TableLookup::new(&term.inverse_range),
                energy: TableLookup::new(&term.energy),
            }
        }
    }
}

impl<R: Reals> Term<R> for SoftTerm<R> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the caller fulfils the contract of `simd`; `SpeciesPairTable::new` pads tables.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let t = (one - r * self.inverse_range.lookup::<MULTISPECIES>(species_pair)).larger(zero);
            if TALLY {
                *energy =
                    (t * t).mul_add(pair_weight * self.energy.lookup::<MULTISPECIES>(species_pair), *energy);
            }
            t.mul_add(self.strength.lookup::<MULTISPECIES>(species_pair), before)
        }
    }
}

/// Adds the forces of a soft term.
///
/// # Safety
/// The caller fulfils the contract of `each`.
#[inline(always)]
pub unsafe fn add_soft<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Soft<R::Scalar>,
    buffers: &mut BatchBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
    unsafe { each::<R, MULTISPECIES, TALLY>(SoftTerm::<R>::new(term), buffers, vectors, energy) }
}

/// The potential `φ = (c_αβ + c_βα) w(r)`, for one kernel of the force.
struct LinearTerm<R: Reals, S> {
    kernel: KernelKind,
    inverse_range: R,
    force_inverse_range: R,
    force: TableLookup<R>,
    energy: TableLookup<R>,
    shape: PhantomData<S>,
}

impl<R: Reals, S: Shape> Term<R> for LinearTerm<R, S> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the caller fulfils the contract of `simd`; `SpeciesPairTable::new` pads tables.
        unsafe {
            let one = R::constant(1.0);
            if TALLY {
                let s = r * self.inverse_range;
                let w = self.energy.lookup::<MULTISPECIES>(species_pair) * self.kernel.visit(Value(s));
                *energy = w.where_below(s, one).mul_add(pair_weight, *energy);
            }
            let s = r * self.force_inverse_range;
            let force = self.force.lookup::<MULTISPECIES>(species_pair) * S::slope(s);
            before + force.where_below(s, one)
        }
    }
}

/// Adds the forces of a density that every ψ is linear in.
///
/// # Safety
/// The caller fulfils the contract of `each`.
#[inline(always)]
pub unsafe fn add_linear<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Linear<R::Scalar>,
    buffers: &mut BatchBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    term.force_kernel.visit(AddLinear::<R, MULTISPECIES, TALLY> { term, buffers, vectors, energy });
}

struct AddLinear<'a, R: Reals, const MULTISPECIES: bool, const TALLY: bool> {
    term: &'a Linear<R::Scalar>,
    buffers: &'a mut BatchBuffers<R::Scalar>,
    vectors: usize,
    energy: &'a mut R,
}

impl<R: Reals, const MULTISPECIES: bool, const TALLY: bool> ShapeVisitor
    for AddLinear<'_, R, MULTISPECIES, TALLY>
{
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: `add_linear` alone creates this visitor, and its caller fulfils the contract of `each`.
        unsafe {
            let term = LinearTerm::<R, S> {
                kernel: self.term.kernel,
                inverse_range: R::splat(self.term.inverse_range),
                force_inverse_range: R::splat(self.term.force_inverse_range),
                force: TableLookup::new(&self.term.force),
                energy: TableLookup::new(&self.term.energy),
                shape: PhantomData,
            };
            each::<R, MULTISPECIES, TALLY>(term, self.buffers, self.vectors, self.energy);
        }
    }
}

/// Computes the kernel shape `W(s)`.
struct Value<R>(R);

impl<R: Reals> ShapeVisitor for Value<R> {
    type Output = R;
    #[inline(always)]
    fn visit<S: Shape>(self) -> R {
        S::value(self.0)
    }
}

/// The potential `φ = a [A W(r, R_A) − B W(r, R_B)]`.
struct SplineTerm<R: Reals> {
    repulsion: TableLookup<R>,
    attraction: TableLookup<R>,
    repulsion_inverse_range: TableLookup<R>,
    attraction_inverse_range: TableLookup<R>,
}

impl<R: Reals> Term<R> for SplineTerm<R> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the caller fulfils the contract of `simd`; `SpeciesPairTable::new` pads tables.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let inverse_a = self.repulsion_inverse_range.lookup::<MULTISPECIES>(species_pair);
            let inverse_b = self.attraction_inverse_range.lookup::<MULTISPECIES>(species_pair);
            // At s = 1 the shape and its slope vanish; larger s are set to 1.
            let a = one - (one - r * inverse_a).larger(zero);
            let b = one - (one - r * inverse_b).larger(zero);
            let repulsion = self.repulsion.lookup::<MULTISPECIES>(species_pair);
            let attraction = self.attraction.lookup::<MULTISPECIES>(species_pair);
            if TALLY {
                let phi = repulsion * CubicSpline::value(a) - attraction * CubicSpline::value(b);
                *energy = phi.mul_add(pair_weight, *energy);
            }
            let slope = repulsion * inverse_a * CubicSpline::slope(a)
                - attraction * inverse_b * CubicSpline::slope(b);
            before - slope
        }
    }
}

/// Adds the forces of spline potentials.
///
/// # Safety
/// The caller fulfils the contract of `each`.
#[inline(always)]
pub unsafe fn add_spline<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Spline<R::Scalar>,
    buffers: &mut BatchBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: tables are padded to a vector by `SpeciesPairTable::new`.
    unsafe {
        let term = SplineTerm::<R> {
            repulsion: TableLookup::new(&term.repulsion),
            attraction: TableLookup::new(&term.attraction),
            repulsion_inverse_range: TableLookup::new(&term.repulsion_inverse_range),
            attraction_inverse_range: TableLookup::new(&term.attraction_inverse_range),
        };
        each::<R, MULTISPECIES, TALLY>(term, buffers, vectors, energy);
    }
}
