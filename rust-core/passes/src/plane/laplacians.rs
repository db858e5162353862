//! Sums over the pairs of a plane that the Laplacian of the energy is made of: first and second derivatives of densities and pair
//! potentials; and the pairs themselves, with what their forces are made of.

use super::list::{Computed, PairsAt, VectorsOfPairs};
use super::traversal::{BatchVisitor, each_batch};
use crate::cells::sorted::SortedCells;
use crate::ground::arithmetic::{Arithmetic, IParticles, Mixed, MixedParticle, PairGeometry};
use crate::ground::species_pairs::{SpeciesPair, SpeciesPairTable, TableLookup};
use crate::ground::terms::{Pass, Terms};
use crate::instruction_set::InstructionSet;
use crate::pair_batch::accumulators::{Accumulator, PlaneSums};
use crate::pair_batch::batch::Batch;
use crate::pair_batch::scatter::scatter_quads;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Kernel, OFFSET_BITS, Quad, Reals, run};
use psidpd_model::kernel::{CubicSpline, Real, Shape, ShapeVisitor};
use psidpd_threads::SharedSlice;

/// The most densities, whose numbers the quads of a particle have room for.
pub const MOST_DENSITIES: usize = 2;

/// Sums over the neighbours of a particle that are of one species, in a density.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct DensitySums {
    /// The gradient `Σ ∇_i w`, and `Σ w`.
    pub first: [f64; 4],
    /// `Σ ∇²w`; `Σ w′ w′` with the density itself, and with the other one; and `Σ ∇²φ` of all pair potentials. The last two are with the
    /// first density.
    pub second: [f64; 4],
}

impl DensitySums {
    /// Adds the sums over other neighbours.
    #[inline(always)]
    pub fn add(&mut self, other: &DensitySums) {
        self.first.iter_mut().zip(other.first).for_each(|(sum, add)| *sum += add);
        self.second.iter_mut().zip(other.second).for_each(|(sum, add)| *sum += add);
    }
}

/// Pairs of particles of a plane with each other and with the next plane, as parallel arrays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairTerms {
    /// The first and the second particle, counted from the first of the plane, and on through the next plane.
    pub particles: [Vec<u32>; 2],
    /// The components of `r_i − r_j`.
    pub d: [Vec<f32>; 3],
    /// `w′/r` of each density.
    pub weights: [Vec<f32>; MOST_DENSITIES],
    /// `φ′/r`, summed over all pair potentials.
    pub potential: Vec<f32>,
}

impl PairTerms {
    /// Removes all pairs.
    pub fn clear(&mut self) {
        self.particles.iter_mut().for_each(Vec::clear);
        self.d.iter_mut().chain(&mut self.weights).chain([&mut self.potential]).for_each(Vec::clear);
    }
}

/// Particles in the order of cells without ghosts, and what acts between them.
#[derive(Clone, Copy)]
pub struct LaplacianInputs<'a> {
    pub cells: SortedCells<'a>,
    pub packed: SharedSlice<'a, MixedParticle>,
    /// Soft and spline potentials, and a pass for every density, at most [`MOST_DENSITIES`].
    pub terms: &'a Terms<f32>,
    /// The number of dimensions less one.
    pub rest: f64,
    /// Whether second derivatives are summed.
    pub second: bool,
}

impl LaplacianInputs<'_> {
    /// The number of sums of a particle for each species: one for each density, and one without densities.
    pub fn width(&self) -> usize {
        self.terms.passes.len().max(1)
    }
}

/// Scratch arrays of a thread.
#[derive(Debug, Default)]
pub struct LaplacianBuffers {
    search: SearchBuffers,
    batch: BatchArrays,
}

/// Scratch arrays of a batch, with room for whole vectors after the last pair.
#[derive(Debug, Default)]
struct BatchArrays {
    i_particles: IParticles<f32>,
    /// The components of `r_i − r_j`, the distance and its inverse, and `∇²φ` and `φ′/r` of the potentials.
    pairs: [Vec<f32>; 7],
    species_pair: Vec<u32>,
    /// Of each density `w′`, `∇²w` and `w′/r`.
    weights: [[Vec<f32>; 3]; MOST_DENSITIES],
    /// Of each density the quads that are subtracted from the [`DensitySums`] of second particles.
    quads: [[Vec<[f32; 4]>; 2]; MOST_DENSITIES],
    /// Sums over the pairs before.
    running: Vec<Accumulator>,
}

/// The largest number of lanes.
const LANES: usize = 16;

impl BatchArrays {
    fn reserve(&mut self, pairs: usize) {
        if self.species_pair.len() < pairs + LANES {
            let room = 2 * pairs + LANES;
            self.species_pair.resize(room, 0);
            self.pairs.iter_mut().for_each(|of| of.resize(room, 0.0));
            self.weights.as_flattened_mut().iter_mut().for_each(|of| of.resize(room, 0.0));
            self.quads.as_flattened_mut().iter_mut().for_each(|of| of.resize(room, [0.0; 4]));
            self.running.resize(room, Accumulator::default());
        }
    }

    /// Adds the pairs of a batch to those of a plane that begins with the particle `first`.
    #[inline(always)]
    fn append_to(&self, kept: &mut PairTerms, batch: Batch, first: usize, densities: usize) {
        let PairTerms { particles: [i, j], d, weights, potential } = kept;
        let (from, count) = (batch.first - first, batch.count);
        i.extend(batch.i_in_batch[..count].iter().map(|m| from as u32 + u32::from(*m)));
        j.extend(batch.j_offsets[..count].iter().map(|j| (j >> OFFSET_BITS) - first as u32));
        d.iter_mut().zip(&self.pairs).for_each(|(to, of)| to.extend_from_slice(&of[..count]));
        let of_densities = weights.iter_mut().zip(&self.weights).take(densities);
        of_densities.for_each(|(to, [.., of])| to.extend_from_slice(&of[..count]));
        potential.extend_from_slice(&self.pairs[6][..count]);
    }
}

/// Adds the pairs of a plane with each other and with the next plane to the sums of both particles. These are those of the plane's
/// particles and then those of the next: for each particle and species of the other [`LaplacianInputs::width`] sums. The pairs are added to
/// `kept`; a few may be a little beyond the range, without weight and potential.
///
/// # Safety
/// Arrays have the sizes that [`SortedCells`] states, and are filled; no thread writes them. There are sums for all these particles.
pub unsafe fn sum_laplacians(
    set: InstructionSet,
    inputs: &LaplacianInputs,
    plane: usize,
    buffers: &mut LaplacianBuffers,
    sums: &mut [DensitySums],
    kept: Option<&mut PairTerms>,
) {
    assert!(inputs.terms.passes.len() <= MOST_DENSITIES, "room for every density");
    let task = SumPairs { inputs, plane, buffers, sums, kept };
    // SAFETY: the caller's promise is that of the loop.
    unsafe {
        match inputs.terms.species {
            1 => run(set, WithSpecies::<false>(task)),
            _ => run(set, WithSpecies::<true>(task)),
        }
    }
}

struct SumPairs<'a> {
    inputs: &'a LaplacianInputs<'a>,
    plane: usize,
    buffers: &'a mut LaplacianBuffers,
    sums: &'a mut [DensitySums],
    kept: Option<&'a mut PairTerms>,
}

struct WithSpecies<'a, const MULTISPECIES: bool>(SumPairs<'a>);

impl<const MULTISPECIES: bool> Kernel for WithSpecies<'_, MULTISPECIES> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let SumPairs { inputs, plane, buffers, sums, kept } = self.0;
        let LaplacianBuffers { search, batch } = buffers;
        // SAFETY: the caller of `sum_laplacians` promises filled arrays; a plane has a first column.
        unsafe {
            let columns = inputs.cells.grid.columns_per_plane;
            let first = inputs.cells.column(plane, 0)[0];
            let metric = <Mixed as Arithmetic<I>>::metric(inputs.cells.geometry);
            let sums = sums.as_mut_ptr();
            let mut adder = Adder::<I, MULTISPECIES> { inputs, metric, first, sums, arrays: batch, kept };
            each_batch::<I, _>(&inputs.cells, plane, 0..columns, I::F32::LANES, search, &mut adder);
        }
    }
}

struct Adder<'a, I: Isa, const MULTISPECIES: bool> {
    inputs: &'a LaplacianInputs<'a>,
    metric: <Mixed as Arithmetic<I>>::Metric,
    /// The first particle of the plane.
    first: usize,
    sums: *mut DensitySums,
    arrays: &'a mut BatchArrays,
    kept: Option<&'a mut PairTerms>,
}

impl<I: Isa, const MULTISPECIES: bool> BatchVisitor<I> for Adder<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]) {
        // SAFETY: `SortedParticles::make_room` pads `packed` by a vector after the last particle, and `reserve` makes room for the
        // vectors of the batch; its particles are of this plane and the next. The caller promises the rest.
        unsafe {
            let Some(batch) = Batch::of_group(search, slots) else { return };
            self.arrays.reserve(batch.count);
            self.measure(batch);
            let LaplacianInputs { terms, rest, second, .. } = self.inputs;
            let BatchArrays { pairs, weights, quads, .. } = &mut *self.arrays;
            let count = batch.count;
            let mut d = 0;
            while d < terms.passes.len() {
                let pass = terms.passes.get_unchecked(d);
                let (weights, quads) = (weights.get_unchecked_mut(d), quads.get_unchecked_mut(d));
                let rest = *rest;
                let quads = &mut quads[0];
                let of = std::marker::PhantomData;
                pass.kernel.visit(OfDensity::<I::F32> { pass, rest, pairs, count, weights, quads, of });
                d += 1;
            }
            if let Some(kept) = &mut self.kept {
                self.arrays.append_to(kept, batch, self.first, terms.passes.len());
            }
            if *second {
                self.second(count);
            }
            if MULTISPECIES {
                self.add(batch);
            } else {
                self.add_alike(batch);
            }
        }
    }
}

/// Pairs that are nearer are taken as being at one point, where nothing has a direction.
const AT_ONE_POINT: f64 = 1e-12;

impl<I: Isa, const MULTISPECIES: bool> Adder<'_, I, MULTISPECIES> {
    /// Writes distances, pairs of species and Laplacians of potentials to the buffers.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; there is room for the batch.
    #[inline(always)]
    unsafe fn measure(&mut self, batch: Batch) {
        let LaplacianInputs { packed, terms, rest, .. } = self.inputs;
        let BatchArrays { i_particles, pairs, species_pair: kinds, .. } = &mut *self.arrays;
        let [x, y, z, r, inverse, laplacian, potential] = pairs;
        // SAFETY: tables are padded to a vector; the caller promises the rest.
        unsafe {
            let packed = packed.as_ptr();
            <Mixed as Arithmetic<I>>::load_i_particles(packed.add(batch.first), i_particles);
            let (metric, species) = (self.metric, terms.species);
            let computed = Computed::<I, MULTISPECIES> { metric, packed, i_particles, batch, species };
            let rest = I::F32::constant(*rest);
            let zero = I::F32::constant(0.0);
            let mut k = 0;
            while k < batch.count {
                let PairsAt { geometry, species_pair } = computed.at(k);
                let mut sums = [zero; 2];
                let mut t = 0;
                while t < terms.soft.len() {
                    let term = terms.soft.get_unchecked(t);
                    let strength = entry::<I, MULTISPECIES>(&term.strength, species_pair);
                    let inverse_range = entry::<I, MULTISPECIES>(&term.inverse_range, species_pair);
                    let of_term = soft(&geometry, [strength, inverse_range], rest);
                    sums = [sums[0] + of_term[0], sums[1] + of_term[1]];
                    t += 1;
                }
                t = 0;
                while t < terms.spline.len() {
                    let term = terms.spline.get_unchecked(t);
                    let repulsion = entry::<I, MULTISPECIES>(&term.repulsion, species_pair);
                    let attraction = entry::<I, MULTISPECIES>(&term.attraction, species_pair);
                    let inverse_a = entry::<I, MULTISPECIES>(&term.repulsion_inverse_range, species_pair);
                    let inverse_b = entry::<I, MULTISPECIES>(&term.attraction_inverse_range, species_pair);
                    let a = spline(&geometry, [repulsion, inverse_a], rest);
                    let b = spline(&geometry, [attraction, inverse_b], rest);
                    sums = [sums[0] + a[0] - b[0], sums[1] + a[1] - b[1]];
                    t += 1;
                }
                let point = I::F32::constant(AT_ONE_POINT);
                sums[0].where_below(point, geometry.r).store(laplacian.as_mut_ptr().add(k));
                sums[1].where_below(point, geometry.r).store(potential.as_mut_ptr().add(k));
                geometry.d[0].store(x.as_mut_ptr().add(k));
                geometry.d[1].store(y.as_mut_ptr().add(k));
                geometry.d[2].store(z.as_mut_ptr().add(k));
                geometry.r.store(r.as_mut_ptr().add(k));
                geometry.inverse.store(inverse.as_mut_ptr().add(k));
                if MULTISPECIES {
                    crate::simd::Words::store(species_pair.0, kinds.as_mut_ptr().add(k));
                }
                k += I::F32::LANES;
            }
        }
    }

    /// Writes the second quad of each density.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; the buffers have the potentials and weights of the batch.
    #[inline(always)]
    unsafe fn second(&mut self, count: usize) {
        let densities = self.inputs.terms.passes.len();
        let BatchArrays { pairs, weights: [a, b], quads, .. } = &mut *self.arrays;
        let [[_, to_a], [_, to_b]] = quads;
        // SAFETY: the caller promises arrays of the batch.
        unsafe {
            let zero = I::F32::constant(0.0);
            let mut k = 0;
            while k < count {
                let potential = I::F32::load(pairs[5].as_ptr().add(k));
                let (mut slope, mut laplacian, mut both) = (zero, zero, zero);
                if densities > 0 {
                    slope = I::F32::load(a[0].as_ptr().add(k));
                    laplacian = I::F32::load(a[1].as_ptr().add(k));
                }
                if densities > 1 {
                    let other = I::F32::load(b[0].as_ptr().add(k));
                    let laplacian = I::F32::load(b[1].as_ptr().add(k));
                    let columns = [zero - laplacian, zero - other * other, zero, zero];
                    I::F32::store_transposed(columns, to_b.as_mut_ptr().add(k).cast());
                    both = slope * other;
                }
                let columns = [zero - laplacian, zero - slope * slope, zero - both, zero - potential];
                I::F32::store_transposed(columns, to_a.as_mut_ptr().add(k).cast());
                k += I::F32::LANES;
            }
        }
    }

    /// The same as [`Adder::add`] with one species, where the sums of first particles need not be written after every pair.
    ///
    /// # Safety
    /// That of [`Adder::add`].
    #[inline(always)]
    unsafe fn add_alike(&mut self, batch: Batch) {
        let (densities, width) = (self.inputs.terms.passes.len(), self.inputs.width());
        let BatchArrays { quads, running, .. } = &mut *self.arrays;
        // SAFETY: the search lists particles of this plane and the next, which have sums; the caller promises the rest.
        unsafe {
            let sums = PlaneSums::new(self.first, std::ptr::null_mut(), self.sums.cast(), 8 * width);
            let running = running.as_mut_ptr().cast();
            let mut d = 0;
            while d < width {
                let [first, second] = quads.get_unchecked_mut(d);
                if d < densities {
                    let (to, quads) = (sums.densities(2 * d), first.as_mut_ptr().cast());
                    scatter_quads::<I, Mixed>(to, quads, quads, running, [1.0, 1.0, 1.0, -1.0], batch.into());
                }
                if self.inputs.second {
                    let (to, quads) = (sums.densities(2 * d + 1), second.as_mut_ptr().cast());
                    scatter_quads::<I, Mixed>(to, quads, quads, running, [-1.0; 4], batch.into());
                }
                d += 1;
            }
        }
    }

    /// Adds the quads of the batch to the sums of both particles of each pair, with several species.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; the buffers have the quads of the batch.
    #[inline(always)]
    unsafe fn add(&mut self, batch: Batch) {
        let LaplacianInputs { terms, .. } = self.inputs;
        let (species, densities, width) = (terms.species, terms.passes.len(), self.inputs.width());
        let BatchArrays { i_particles, species_pair, quads, .. } = &*self.arrays;
        // SAFETY: the search lists particles of this plane and the next, which have sums; the caller promises the rest.
        unsafe {
            let sign = I::Quad::load([1.0, 1.0, 1.0, -1.0].as_ptr());
            // The quarters of a batch are added in turns, as pairs of one particle follow each other: each would wait for the one before.
            let part = batch.count.div_ceil(TURNS);
            let mut turn = 0;
            while turn < TURNS * part {
                let p = turn % TURNS * part + turn / TURNS;
                turn += 1;
                if p >= batch.count {
                    continue;
                }
                let m = *batch.i_in_batch.get_unchecked(p) as usize;
                let (here, there) = (batch.first + m, *batch.j_offsets.get_unchecked(p) >> OFFSET_BITS);
                let a = i_particles.species[m % LANES] as usize;
                let b = *species_pair.get_unchecked(p) as usize - a * species;
                let here = (here - self.first) * species + b;
                let there = (there as usize - self.first) * species + a;
                let mut d = 0;
                while d < width {
                    let [here, there] = [self.sums.add(here * width + d), self.sums.add(there * width + d)];
                    let [first, second] = quads.get_unchecked(d);
                    if d < densities {
                        let quad = <Mixed as Arithmetic<I>>::load_quad(first.as_ptr().add(p).cast());
                        let (to, other) = ((*here).first.as_mut_ptr(), (*there).first.as_mut_ptr());
                        quad.mul_add(sign, I::Quad::load(to)).store(to);
                        I::Quad::load(other).sub(quad).store(other);
                    }
                    if self.inputs.second {
                        let quad = <Mixed as Arithmetic<I>>::load_quad(second.as_ptr().add(p).cast());
                        let (to, other) = ((*here).second.as_mut_ptr(), (*there).second.as_mut_ptr());
                        I::Quad::load(to).sub(quad).store(to);
                        I::Quad::load(other).sub(quad).store(other);
                    }
                    d += 1;
                }
            }
        }
    }
}

/// The number of parts of a batch whose pairs are added in turns.
const TURNS: usize = 4;

/// The entries of a table for a vector of pairs.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
unsafe fn entry<I: Isa, const MULTISPECIES: bool>(
    table: &SpeciesPairTable<f32>,
    of: SpeciesPair<I::F32>,
) -> I::F32 {
    // SAFETY: the caller promises pairs of the table's species.
    unsafe { TableLookup::<I::F32>::new(table).lookup::<MULTISPECIES>(of) }
}

/// `∇²φ` and `φ′/r` of `½ a R (1 − r/R)²`, of its strength `a` and `1/R`.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
unsafe fn soft<R: Reals>(geometry: &PairGeometry<R>, [strength, inverse_range]: [R; 2], rest: R) -> [R; 2] {
    let (one, s) = (R::constant(1.0), geometry.r * inverse_range);
    let per_length = strength * (s - one) * geometry.inverse;
    // SAFETY: the caller fulfils the contract of `simd`.
    unsafe {
        let laplacian = rest.mul_add(per_length, strength * inverse_range);
        [laplacian.where_below(s, one), per_length.where_below(s, one)]
    }
}

/// `∇²φ` and `φ′/r` of `a W(r/R)` with the cubic spline, of `a` and `1/R`.
///
/// # Safety
/// The caller fulfils the contract of `simd`.
#[inline(always)]
unsafe fn spline<R: Reals>(geometry: &PairGeometry<R>, [strength, inverse_range]: [R; 2], rest: R) -> [R; 2] {
    let (one, s) = (R::constant(1.0), geometry.r * inverse_range);
    let factor = strength * inverse_range;
    let per_length = factor * CubicSpline::slope(s) * geometry.inverse;
    let bend = factor * CubicSpline::curvature(s) * inverse_range;
    // SAFETY: the caller fulfils the contract of `simd`.
    unsafe { [rest.mul_add(per_length, bend).where_below(s, one), per_length.where_below(s, one)] }
}

/// Writes the first quad, `w′`, `∇²w` and `w′/r` of a density.
struct OfDensity<'a, R: Reals> {
    pass: &'a Pass<f32>,
    rest: f64,
    pairs: &'a [Vec<f32>; 7],
    count: usize,
    weights: &'a mut [Vec<f32>; 3],
    quads: &'a mut Vec<[f32; 4]>,
    of: std::marker::PhantomData<R>,
}

impl<R: Reals<Scalar = f32>> ShapeVisitor for OfDensity<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<S: Shape>(self) {
        let OfDensity { pass, rest, pairs: [x, y, z, r, inverse, ..], count, weights, quads, .. } = self;
        let [slopes, laplacians, per_lengths] = weights;
        // SAFETY: `Adder::visit` alone creates this visitor, with arrays of whole vectors; its caller fulfils the contract of `simd`.
        unsafe {
            let (value, inverse_range) = (R::splat(-pass.value), R::splat(pass.inverse_range));
            let (first, second) = (R::splat(-pass.force), R::splat(-pass.force * pass.inverse_range));
            let (one, point, rest) = (R::constant(1.0), R::constant(AT_ONE_POINT), R::constant(rest));
            let mut k = 0;
            while k < count {
                let (r, inverse) = (R::load(r.as_ptr().add(k)), R::load(inverse.as_ptr().add(k)));
                let s = r * inverse_range;
                let slope = (first * S::slope(s)).where_below(s, one).where_below(point, r);
                let bend = (second * S::curvature(s)).where_below(s, one).where_below(point, r);
                let per_length = slope * inverse;
                slope.store(slopes.as_mut_ptr().add(k));
                per_length.store(per_lengths.as_mut_ptr().add(k));
                rest.mul_add(per_length, bend).store(laplacians.as_mut_ptr().add(k));
                let d = [R::load(x.as_ptr().add(k)), R::load(y.as_ptr().add(k)), R::load(z.as_ptr().add(k))];
                // The sign of the weight is opposite to that of the gradient, which the other particle has with the opposite sign.
                let weight = (value * S::value(s)).where_below(s, one);
                let columns = [per_length * d[0], per_length * d[1], per_length * d[2], weight];
                R::store_transposed(columns, quads.as_mut_ptr().add(k).cast());
                k += R::LANES;
            }
        }
    }
}
