//! What each term adds to the pairs, along `ê`.

use crate::engine::sweep::ground::arithmetic::{Arithmetic, PairVector};
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::terms::{Linear, Soft, SpeciesPairTable, Spline};
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::pair_batch::evaluate::StepConstants;
use crate::engine::sweep::pair_batch::thermostat::ThermostatForce;
use crate::engine::sweep::simd::{Isa, Reals, Scalar, Words};
use crate::model::kernel::{CubicSpline, KernelKind, Real, Shape, ShapeVisitor};
use std::marker::PhantomData;

/// Which pair of species each pair of a vector is: the entry of tables.
#[derive(Clone, Copy)]
pub struct SpeciesPair<R: Reals>(pub R::Words);

impl<R: Reals> SpeciesPair<R> {
    /// Of the species of both particles.
    #[inline(always)]
    pub unsafe fn new(species_i: R::Words, species_j: R::Words, species: usize) -> SpeciesPair<R> {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut row = R::Words::splat(0);
            let mut k = 0;
            while k < species {
                row = row.add(species_i);
                k += 1;
            }
            SpeciesPair(row.add(species_j))
        }
    }
}

/// A table at hand: in a loop nothing of it is looked up twice.
#[derive(Clone, Copy)]
pub struct TableLookup<R: Reals> {
    first: R,
    entries: *const R::Scalar,
    fits_vector: bool,
}

impl<R: Reals> TableLookup<R> {
    #[inline(always)]
    pub unsafe fn new(table: &SpeciesPairTable<R::Scalar>) -> TableLookup<R> {
        let entries = table.as_ptr();
        // SAFETY: the contract of `simd`; tables have an entry.
        TableLookup { first: unsafe { R::splat(*entries) }, entries, fits_vector: table.count() <= R::LANES }
    }

    /// The entries of pairs; with one species there is but one.
    #[inline(always)]
    pub unsafe fn lookup<const MULTISPECIES: bool>(&self, species_pair: SpeciesPair<R>) -> R {
        // SAFETY: the contract of `simd`; kinds are below the number of entries, and tables have room for a vector.
        unsafe {
            if !MULTISPECIES {
                self.first
            } else if self.fits_vector {
                R::pick(self.entries, species_pair.0)
            } else {
                R::lookup(self.entries, species_pair.0)
            }
        }
    }
}

/// What is summed over pairs, where it is asked for.
#[derive(Clone, Copy)]
pub struct PairSums<R> {
    pub pair: R,
    pub excess: R,
    pub virial: [R; 6],
    pub thermostat: [R; 6],
}

impl<R: Reals> PairSums<R> {
    #[inline(always)]
    pub fn zero() -> PairSums<R> {
        let zero = R::constant(0.0);
        PairSums { pair: zero, excess: zero, virial: [zero; 6], thermostat: [zero; 6] }
    }
}

/// Adds forces `f d` to a virial.
#[inline(always)]
pub unsafe fn add_virial<R: Reals>(f: R, d: [R; 3], sum_lanes: &mut [R; 6]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let fd = [f * d[0], f * d[1], f * d[2]];
        sum_lanes[0] = fd[0].mul_add(d[0], sum_lanes[0]);
        sum_lanes[1] = fd[1].mul_add(d[1], sum_lanes[1]);
        sum_lanes[2] = fd[2].mul_add(d[2], sum_lanes[2]);
        sum_lanes[3] = fd[0].mul_add(d[1], sum_lanes[3]);
        sum_lanes[4] = fd[0].mul_add(d[2], sum_lanes[4]);
        sum_lanes[5] = fd[1].mul_add(d[2], sum_lanes[5]);
    }
}

/// The sum of the lanes.
#[inline(always)]
pub unsafe fn sum_lanes<R: Reals>(x: R) -> f64 {
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
pub unsafe fn forces<I: Isa, A: Arithmetic<I>, const MULTISPECIES: bool, const TALLY: bool>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    constants: &StepConstants<I, A>,
    buffers: &mut PairBuffers<A::Scalar>,
    batch: Batch,
    sum_laness: &mut PairSums<A::Reals>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let terms = data.terms;
        let vectors = batch.count().div_ceil(A::Reals::LANES);
        let zero = A::Reals::constant(0.0);
        let p_pairs = buffers.pairs.as_ptr().cast::<PairVector<A::Reals>>();
        let p_quads = buffers.quads.as_mut_ptr().cast::<A::Scalar>();
        let p_conservative = buffers.conservative.as_ptr();
        let p_noise = buffers.tags[0].as_ptr();
        let p_pair_weight = buffers.pair_weight.as_ptr();
        let p_weight =
            if data.variables == 1 { buffers.kernel_weights[0].as_ptr() } else { std::ptr::null() };
        let p_cached = if MULTISPECIES && terms.full_cache {
            buffers.conservative.as_mut_ptr()
        } else {
            std::ptr::null_mut()
        };
        let has_more = terms.has_more();
        let soft = SoftAt::<A::Reals>::new(terms.first_soft());
        let thermostat_force = terms.thermostat.as_ref().filter(|_| constants.noise.is_some());
        let thermostat_force = thermostat_force
            .map(|thermostat| ThermostatForce::<A::Reals>::new(thermostat, constants.noise_scale));
        let mut v = 0;
        while v < vectors {
            let k = v * A::Reals::LANES;
            let pairs = &*p_pairs.add(v);
            let (r, species_pair) = (pairs.geometry.r, pairs.species_pair);
            let pair_weight = if TALLY { A::Reals::load(p_pair_weight.add(k)) } else { zero };
            let mut force = if has_more { A::Reals::load(p_conservative.add(k)) } else { zero };
            force =
                soft.add::<MULTISPECIES, TALLY>(r, species_pair, force, pair_weight, &mut sum_laness.pair);
            if TALLY {
                add_virial(
                    force * (pair_weight * pairs.geometry.inverse),
                    pairs.geometry.d,
                    &mut sum_laness.virial,
                );
            }
            if let Some(thermostat_force) = &thermostat_force {
                let word = <A::Reals as Reals>::Words::load(p_noise.add(k));
                let thermostat = thermostat_force.force::<MULTISPECIES>(pairs, word);
                if TALLY {
                    let f = thermostat * (pair_weight * pairs.geometry.inverse);
                    add_virial(f, pairs.geometry.d, &mut sum_laness.thermostat);
                }
                force = force + thermostat;
            }
            if MULTISPECIES && !p_cached.is_null() {
                (force * pairs.geometry.inverse).store(p_cached.add(k));
                v += 1;
                continue;
            }
            let kernel_weight = if p_weight.is_null() { zero } else { A::Reals::load(p_weight.add(k)) };
            let f = force * pairs.geometry.inverse;
            let [dx, dy, dz] = pairs.geometry.d;
            A::Reals::store_transposed([f * dx, f * dy, f * dz, kernel_weight], p_quads.add(4 * k));
            v += 1;
        }
    }
}

/// A term at hand.
trait Term<R: Reals> {
    /// `before − φ′(r)`, and the energy, if it is asked for.
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R;
}

/// Adds the forces of a term to those that the block has.
#[inline(always)]
unsafe fn each<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: impl Term<R>,
    buffers: &mut PairBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
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

/// `φ = ½ a R (1 − r/R)²`.
struct SoftAt<R: Reals> {
    strength: TableLookup<R>,
    inverse_range: TableLookup<R>,
    energy: TableLookup<R>,
}

impl<R: Reals> SoftAt<R> {
    #[inline(always)]
    unsafe fn new(term: &Soft<R::Scalar>) -> Self {
        // SAFETY: the contract of `simd`.
        unsafe {
            SoftAt {
                strength: TableLookup::new(&term.strength),
                inverse_range: TableLookup::new(&term.inverse_range),
                energy: TableLookup::new(&term.energy),
            }
        }
    }
}

impl<R: Reals> Term<R> for SoftAt<R> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
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
#[inline(always)]
pub unsafe fn add_soft<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Soft<R::Scalar>,
    buffers: &mut PairBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
    unsafe { each::<R, MULTISPECIES, TALLY>(SoftAt::<R>::new(term), buffers, vectors, energy) }
}

/// `φ = (c_αβ + c_βα) w(r)`, for one kernel of the force.
struct LinearAt<R: Reals, S> {
    species_pair: KernelKind,
    inverse_range: R,
    force_inverse_range: R,
    force: TableLookup<R>,
    energy: TableLookup<R>,
    shape: PhantomData<S>,
}

impl<R: Reals, S: Shape> Term<R> for LinearAt<R, S> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let one = R::constant(1.0);
            if TALLY {
                let s = r * self.inverse_range;
                let w = self.energy.lookup::<MULTISPECIES>(species_pair) * self.species_pair.visit(Value(s));
                *energy = w.where_below(s, one).mul_add(pair_weight, *energy);
            }
            let s = r * self.force_inverse_range;
            let force = self.force.lookup::<MULTISPECIES>(species_pair) * S::slope(s);
            before + force.where_below(s, one)
        }
    }
}

/// Adds the forces of a density that every ψ is linear in.
#[inline(always)]
pub unsafe fn add_linear<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Linear<R::Scalar>,
    buffers: &mut PairBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    term.force_kernel.visit(AddLinear::<R, MULTISPECIES, TALLY> { term, buffers, vectors, energy });
}

struct AddLinear<'a, R: Reals, const MULTISPECIES: bool, const TALLY: bool> {
    term: &'a Linear<R::Scalar>,
    buffers: &'a mut PairBuffers<R::Scalar>,
    vectors: usize,
    energy: &'a mut R,
}

impl<R: Reals, const MULTISPECIES: bool, const TALLY: bool> ShapeVisitor
    for AddLinear<'_, R, MULTISPECIES, TALLY>
{
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        // SAFETY: the contract of `simd`, by way of `add_linear`.
        unsafe {
            let term = LinearAt::<R, S> {
                species_pair: self.term.kernel,
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
    repulsion: TableLookup<R>,
    attraction: TableLookup<R>,
    repulsion_inverse_range: TableLookup<R>,
    attraction_inverse_range: TableLookup<R>,
}

impl<R: Reals> Term<R> for SplineAt<R> {
    #[inline(always)]
    unsafe fn add<const MULTISPECIES: bool, const TALLY: bool>(
        &self,
        r: R,
        species_pair: SpeciesPair<R>,
        before: R,
        pair_weight: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let inverse_a = self.repulsion_inverse_range.lookup::<MULTISPECIES>(species_pair);
            let inverse_b = self.attraction_inverse_range.lookup::<MULTISPECIES>(species_pair);
            // At s = 1 the shape and its slope vanish; beyond, it stays there.
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
#[inline(always)]
pub unsafe fn add_spline<R: Reals, const MULTISPECIES: bool, const TALLY: bool>(
    term: &Spline<R::Scalar>,
    buffers: &mut PairBuffers<R::Scalar>,
    vectors: usize,
    energy: &mut R,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let term = SplineAt::<R> {
            repulsion: TableLookup::new(&term.repulsion),
            attraction: TableLookup::new(&term.attraction),
            repulsion_inverse_range: TableLookup::new(&term.repulsion_inverse_range),
            attraction_inverse_range: TableLookup::new(&term.attraction_inverse_range),
        };
        each::<R, MULTISPECIES, TALLY>(term, buffers, vectors, energy);
    }
}
