//! Lists the pairs of a plane within the range of the thermostat, for integrators that apply it apart from the forces.

use super::traversal::{BatchVisitor, each_batch};
use crate::cells::sorted::SortedCells;
use crate::ground::arithmetic::{Arithmetic, Double, IParticles, Mixed, MixedParticle, PairGeometry};
use crate::ground::species_pairs::{SpeciesPair, SpeciesPairTable, TableLookup};
use crate::ground::terms::Exponent;
use crate::instruction_set::InstructionSet;
use crate::pair_batch::batch::Batch;
use crate::pair_batch::room::make_room;
use crate::pair_batch::thermostat::ThermostatWeight;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Kernel, OFFSET_BITS, Quad, Reals, Words, run};
use psidpd_model::kernel::Real;
use psidpd_threads::SharedSlice;
use std::ops::Range;

/// A pair: its vector `g`, and the second particle.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(16))]
pub struct Pair {
    /// Vector `ê √(½ Δt γ) w_R` from the second particle to the first.
    pub g: [f32; 3],
    /// Index of the second particle, counted from the first particle of the first particle's plane, through the next plane;
    /// of a ghost counted from the first of all.
    pub j: u32,
}

/// A pair in double precision.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct ExactPair {
    pub g: [f64; 3],
    j: u64,
}

impl ExactPair {
    pub fn new(g: [f64; 3], j: u32) -> ExactPair {
        ExactPair { g, j: j.into() }
    }

    /// Index of the second particle, as that of [`Pair`].
    #[inline(always)]
    pub fn j(&self) -> u32 {
        // The high word is that of the number in which vectors store it.
        self.j as u32
    }
}

/// A pair in either precision.
pub trait Entry {
    /// Index of the second particle, as that of [`Pair`].
    fn j(&self) -> usize;
    /// The vector `g`, and 0.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    unsafe fn g<I: Isa>(&self) -> I::Quad;
}

impl Entry for Pair {
    #[inline(always)]
    fn j(&self) -> usize {
        // SAFETY: it is a reference. The read is volatile: otherwise the compiler loads it together with `g`, and extracts it.
        unsafe { (&raw const self.j).read_volatile() as usize }
    }

    #[inline(always)]
    unsafe fn g<I: Isa>(&self) -> I::Quad {
        // SAFETY: `j`, which has the same size, follows the three numbers of `g`.
        unsafe { I::Quad::load_three_f32((&raw const *self).cast()) }
    }
}

impl Entry for ExactPair {
    #[inline(always)]
    fn j(&self) -> usize {
        ExactPair::j(self) as usize
    }

    #[inline(always)]
    unsafe fn g<I: Isa>(&self) -> I::Quad {
        // SAFETY: `j` follows the three numbers of `g`, and the size of the structure is that of four numbers.
        unsafe { I::Quad::load_three((&raw const *self).cast()) }
    }
}

/// Pairs whose first particles follow each other in the order of cells, sorted by first particle.
#[derive(Debug, Clone, Default)]
pub struct PairList {
    /// The first of these particles.
    pub first: usize,
    /// The particle that indices of second particles count from.
    pub j_from: usize,
    /// Index of each particle's first pair; the last entry is one past the last pair.
    pub start: Vec<u32>,
    /// The pairs in single precision; empty if they are listed in double precision.
    pub pairs: Vec<Pair>,
    /// The pairs in double precision, if these have been computed; otherwise empty.
    pub exact: Vec<ExactPair>,
    /// For each vector of pairs of a batch the mask of those that are kept, and the number of those kept before.
    kept: Vec<[u32; 2]>,
}

/// The listed pairs of owned particles of a plane, or of a part of it.
#[derive(Debug, Clone, Default)]
pub struct Listed {
    /// The pairs of these particles with each other and with owned particles of the next plane.
    pub own: PairList,
    /// The pairs of these particles with ghosts of any plane, without entries for the last particles.
    pub with_ghosts: PairList,
}

impl Listed {
    /// Empties the lists of a plane that begins with `plane_first`; their first particle will be `first`.
    pub fn clear(&mut self, first: usize, plane_first: usize) {
        self.own.clear(first, plane_first);
        self.with_ghosts.clear(first, 0);
    }

    /// Appends lists whose particles follow.
    pub fn append(&mut self, next: &Listed) {
        self.own.append(&next.own);
        self.with_ghosts.append(&next.with_ghosts);
    }

    /// The list for a batch.
    #[inline(always)]
    pub fn of(&mut self, batch: Batch) -> &mut PairList {
        if batch.with_ghosts { &mut self.with_ghosts } else { &mut self.own }
    }
}

/// The particles of a plane, counted from its first, each with the range of its pairs in the list.
#[inline(always)]
pub fn pairs_of_each(
    start: &[u32],
) -> impl DoubleEndedIterator<Item = (usize, Range<usize>)> + ExactSizeIterator {
    start.windows(2).map(|ends| ends[0] as usize..ends[1] as usize).enumerate()
}

impl PairList {
    /// Empties the list; its first particle will be `first`, and indices of second particles count from `j_from`.
    pub fn clear(&mut self, first: usize, j_from: usize) {
        (self.first, self.j_from) = (first, j_from);
        self.start.clear();
        self.start.push(0);
        self.pairs.clear();
        self.exact.clear();
    }

    /// Appends a list whose particles follow.
    fn append(&mut self, next: &PairList) {
        self.begin_at(next.first);
        let count = self.count() as u32;
        self.start.extend(next.start.iter().skip(1).map(|start| count + start));
        self.pairs.extend_from_slice(&next.pairs);
        self.exact.extend_from_slice(&next.exact);
    }

    /// Number of pairs.
    pub fn count(&self) -> usize {
        self.pairs.len().max(self.exact.len())
    }

    /// Number of particles that may be the first of a pair.
    pub fn particles(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Gives no pairs to the particles before `place` that are not listed yet.
    #[inline(always)]
    pub fn begin_at(&mut self, place: usize) {
        let count = self.count() as u32;
        self.start.resize(place - self.first + 1, count);
    }

    /// The vector `g` of a pair, in the highest precision available.
    #[inline(always)]
    pub fn g(&self, k: usize) -> [f64; 3] {
        self.exact.get(k).map_or_else(|| self.pairs[k].g.map(f64::from), |pair| pair.g)
    }

    /// The index of a pair's second particle.
    #[inline(always)]
    pub fn second(&self, k: usize) -> usize {
        self.exact.get(k).map_or_else(|| self.pairs[k].j, ExactPair::j) as usize
    }
}

/// Factors of the pairs, by pairs of species.
#[derive(Debug, Clone)]
pub struct WeightTables<T> {
    pub species: usize,
    /// Amplitude `√(½ Δt γ)`; zero without drag.
    pub amplitude: SpeciesPairTable<T>,
    pub inverse_range: SpeciesPairTable<T>,
    pub exponent: Exponent<T>,
}

impl WeightTables<f64> {
    /// The inverse ranges; of a range of zero the largest number, beyond which every pair is.
    pub fn inverse_ranges(ranges: &[f64]) -> SpeciesPairTable<f64> {
        SpeciesPairTable::new(ranges.iter().map(|range| if *range > 0.0 { 1.0 / range } else { f64::MAX }))
    }
}

/// The pairs that are listed.
#[derive(Debug, Clone)]
pub struct ListTerms {
    mixed: WeightTables<f32>,
    double: WeightTables<f64>,
}

impl ListTerms {
    /// In single precision all ranges are longer by the fraction `margin`.
    pub fn new(double: WeightTables<f64>, margin: f64) -> ListTerms {
        let table = |table: &SpeciesPairTable<f64>, factor: f64| {
            SpeciesPairTable::new((0..table.count()).map(|k| (table[k] * factor).min(f32::MAX.into()) as f32))
        };
        let mixed = WeightTables {
            species: double.species,
            amplitude: table(&double.amplitude, 1.0),
            inverse_range: table(&double.inverse_range, 1.0 / (1.0 + margin)),
            exponent: match &double.exponent {
                Exponent::One => Exponent::One,
                Exponent::Two => Exponent::Two,
                Exponent::Quarters(quarters) => Exponent::Quarters(*quarters),
                Exponent::Any(exponent) => Exponent::Any(table(exponent, 1.0)),
            },
        };
        ListTerms { mixed, double }
    }

    pub fn species(&self) -> usize {
        self.mixed.species
    }
}

/// What the list needs of a vector of pairs.
pub struct PairsAt<R: Reals> {
    pub geometry: PairGeometry<R>,
    /// Read only with several species.
    pub species_pair: SpeciesPair<R>,
}

/// The pairs of a batch, a vector at a time.
pub trait VectorsOfPairs<I: Isa, A: Arithmetic<I>> {
    /// The pairs from number `k` on; lanes beyond the last pair are unspecified.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; `k` is a multiple of the lanes, and a number of a pair.
    unsafe fn at(&self, k: usize) -> PairsAt<A::Reals>;
}

/// A precision in which pairs are listed. Callers of its functions fulfil the contract of `simd`.
#[allow(clippy::missing_safety_doc)]
pub trait ListArithmetic<I: Isa>: Arithmetic<I> {
    /// A pair of four numbers, the last of which has the bits of the index.
    type Pair;
    fn tables(terms: &ListTerms) -> &WeightTables<Self::Scalar>;
    fn pairs(list: &mut PairList) -> &mut Vec<Self::Pair>;
    /// Numbers that have the words as bits.
    unsafe fn of_words(words: <Self::Reals as Reals>::Words) -> Self::Reals;
}

impl<I: Isa> ListArithmetic<I> for Mixed {
    type Pair = Pair;

    #[inline(always)]
    fn tables(terms: &ListTerms) -> &WeightTables<f32> {
        &terms.mixed
    }

    #[inline(always)]
    fn pairs(list: &mut PairList) -> &mut Vec<Pair> {
        &mut list.pairs
    }

    #[inline(always)]
    unsafe fn of_words(words: <I::F32 as Reals>::Words) -> I::F32 {
        // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
        unsafe { I::of_bits(words) }
    }
}

impl<I: Isa> ListArithmetic<I> for Double {
    type Pair = ExactPair;

    #[inline(always)]
    fn tables(terms: &ListTerms) -> &WeightTables<f64> {
        &terms.double
    }

    #[inline(always)]
    fn pairs(list: &mut PairList) -> &mut Vec<ExactPair> {
        &mut list.exact
    }

    #[inline(always)]
    unsafe fn of_words(words: <I::F64 as Reals>::Words) -> I::F64 {
        // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
        unsafe { I::F64::encode(words) }
    }
}

/// Appends the pairs of a batch within their range to a list.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The list has no particle of the batch or after it yet.
#[inline(always)]
pub unsafe fn append_batch<I: Isa, A: ListArithmetic<I>, const MULTISPECIES: bool>(
    list: &mut PairList,
    terms: &ListTerms,
    batch: Batch,
    vectors: &impl VectorsOfPairs<I, A>,
) {
    list.begin_at(batch.first);
    let (before, room) = (list.count(), batch.count + 16);
    let pairs = A::pairs(list);
    make_room(pairs, room);
    // SAFETY: room for more pairs than there are has been made.
    let to_pairs = unsafe { pairs.as_mut_ptr().add(before) };
    let j_from = (list.j_from as u32) << OFFSET_BITS;
    let PairList { start, kept, .. } = list;
    let (lanes, tables) = (A::Reals::LANES, A::tables(terms));
    make_room(start, batch.members);
    kept.resize(kept.len().max(room), [0; 2]);
    // SAFETY: the search pads lists of the batch; room for all its pairs and a vector has been reserved, and `found`
    // written pairs are initialised. The caller promises the rest.
    unsafe {
        let weight = ThermostatWeight::<A::Reals>::new(&tables.inverse_range, &tables.exponent);
        let amplitude = TableLookup::<A::Reals>::new(&tables.amplitude);
        let j_from = <A::Reals as Reals>::Words::splat(j_from);
        let mut found = 0;
        let mut k = 0;
        while k < batch.count {
            let PairsAt { geometry, species_pair } = vectors.at(k);
            let w = weight.weight::<MULTISPECIES>(geometry.r, species_pair);
            let factor = amplitude.lookup::<MULTISPECIES>(species_pair) * w * geometry.inverse;
            let mut mask = A::Reals::constant(0.0).mask_below(factor);
            if batch.count - k < lanes {
                mask &= (1 << (batch.count - k)) - 1;
            }
            *kept.get_unchecked_mut(k / lanes) = [mask, found as u32];
            let [dx, dy, dz] = geometry.d;
            let j = <A::Reals as Reals>::Words::load(batch.j_offsets.as_ptr().add(k));
            let j = j.sub(j_from).shift_right::<OFFSET_BITS>();
            let columns = [factor * dx, factor * dy, factor * dz, A::of_words(j)];
            A::Reals::store_rows(columns, mask, to_pairs.add(found).cast());
            found += mask.count_ones() as usize;
            k += lanes;
        }
        *kept.get_unchecked_mut(k / lanes) = [0, found as u32];
        let first = *batch.begin.get_unchecked(0);
        for end in batch.begin.get_unchecked(1..=batch.members) {
            let at = (end - first) as usize;
            let [mask, found] = *kept.get_unchecked(at / lanes);
            let below = mask & !(u32::MAX << (at % lanes));
            start.push(before as u32 + found + below.count_ones());
        }
        A::pairs(list).set_len(before + found);
    }
}

/// Scratch arrays of a search whose pairs are only listed.
#[derive(Debug, Default)]
pub struct ListBuffers {
    search: SearchBuffers,
    i_particles: IParticles<f32>,
}

/// Particles in the order of cells, and the pairs of them that are listed.
#[derive(Clone, Copy)]
pub struct ListInputs<'a> {
    pub cells: SortedCells<'a>,
    pub packed: SharedSlice<'a, MixedParticle>,
    pub terms: &'a ListTerms,
}

/// Lists the pairs of owned particles of a plane with each other and with the next plane, each pair once, and those with
/// ghosts.
///
/// # Safety
/// Arrays have the sizes that [`SortedCells`] states, and are filled; no thread writes them.
pub unsafe fn list_pairs(
    set: InstructionSet,
    inputs: &ListInputs,
    plane: usize,
    buffers: &mut ListBuffers,
    lists: &mut Listed,
) {
    // SAFETY: the caller promises a plane of the grid.
    let first = unsafe { inputs.cells.column(plane, 0)[0] };
    lists.clear(first, first);
    let task = ListPairs { inputs, plane, buffers, lists };
    // SAFETY: `PairLists::find` sorts all particles of the box into the arrays before it lists any
    // plane, and writes none of them while it lists.
    unsafe {
        match inputs.terms.species() {
            1 => run(set, WithSpecies::<false>(task)),
            _ => run(set, WithSpecies::<true>(task)),
        }
    }
}

struct ListPairs<'a> {
    inputs: &'a ListInputs<'a>,
    plane: usize,
    buffers: &'a mut ListBuffers,
    lists: &'a mut Listed,
}

struct WithSpecies<'a, const MULTISPECIES: bool>(ListPairs<'a>);

impl<const MULTISPECIES: bool> Kernel for WithSpecies<'_, MULTISPECIES> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let ListPairs { inputs, plane, buffers: ListBuffers { search, i_particles }, lists } = self.0;
        // SAFETY: the caller of `list_pairs` promises filled arrays; a plane has a first column.
        unsafe {
            let columns = inputs.cells.grid.columns_per_plane;
            let end = inputs.cells.column(plane, columns - 1)[1];
            let metric = <Mixed as Arithmetic<I>>::metric(inputs.cells.geometry);
            let mut lister = Lister::<I, MULTISPECIES> { inputs, metric, i_particles, lists };
            each_batch::<I, _>(&inputs.cells, plane, 0..columns, I::F32::LANES, search, &mut lister);
            lists.own.begin_at(end);
        }
    }
}

struct Lister<'a, I: Isa, const MULTISPECIES: bool> {
    inputs: &'a ListInputs<'a>,
    metric: <Mixed as Arithmetic<I>>::Metric,
    i_particles: &'a mut IParticles<f32>,
    lists: &'a mut Listed,
}

impl<I: Isa, const MULTISPECIES: bool> BatchVisitor<I> for Lister<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]) {
        // SAFETY: `SortedParticles::make_room` pads `packed` by a vector after the last particle. The caller
        // promises the rest.
        unsafe {
            let Some(batch) = Batch::of_group(search, slots) else { return };
            let ListInputs { packed, terms, .. } = self.inputs;
            let packed = packed.as_ptr();
            <Mixed as Arithmetic<I>>::load_i_particles(packed.add(batch.first), self.i_particles);
            let (metric, i_particles, species) = (self.metric, &*self.i_particles, terms.species());
            let computed = Computed::<I, MULTISPECIES> { metric, packed, i_particles, batch, species };
            append_batch::<I, Mixed, MULTISPECIES>(self.lists.of(batch), terms, batch, &computed);
        }
    }
}

/// Computes the pairs of a batch in single precision.
pub struct Computed<'a, I: Isa, const MULTISPECIES: bool> {
    pub metric: <Mixed as Arithmetic<I>>::Metric,
    pub packed: *const MixedParticle,
    pub i_particles: &'a IParticles<f32>,
    pub batch: Batch<'a>,
    pub species: usize,
}

impl<I: Isa, const MULTISPECIES: bool> VectorsOfPairs<I, Mixed> for Computed<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn at(&self, k: usize) -> PairsAt<I::F32> {
        type W<I> = <<I as Isa>::F32 as Reals>::Words;
        let Computed { metric, packed, i_particles, batch, species } = self;
        // SAFETY: the search pads the lists of a batch by a vector of valid particles.
        unsafe {
            let i = W::<I>::load_bytes(batch.i_in_batch.as_ptr().add(k));
            let (geometry, tags) = <Mixed as Arithmetic<I>>::pair_geometry::<MULTISPECIES>(
                metric,
                *packed,
                *i_particles,
                i,
                batch.j_offsets.as_ptr().add(k),
                false,
            );
            let species_pair = if MULTISPECIES {
                SpeciesPair::new(W::<I>::pick(i_particles.species.as_ptr(), i), tags.species_j, *species)
            } else {
                SpeciesPair(i)
            };
            PairsAt { geometry, species_pair }
        }
    }
}
