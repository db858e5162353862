//! Lists the pairs of a plane within the range of the thermostat, for integrators that apply it apart from the forces.

use super::traversal::{BatchVisitor, each_batch};
use crate::cells::sorted::SortedCells;
use crate::ground::arithmetic::{Arithmetic, IParticles, Mixed, MixedParticle, PairGeometry};
use crate::ground::species_pairs::{SpeciesPair, SpeciesPairTable, TableLookup};
use crate::ground::terms::Exponent;
use crate::instruction_set::InstructionSet;
use crate::pair_batch::batch::Batch;
use crate::pair_batch::room::make_room;
use crate::pair_batch::thermostat::ThermostatWeight;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Kernel, OFFSET_BITS, Reals, Words, run};
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
    pub j: u64,
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
    pub pairs: Vec<Pair>,
    /// Tags of both particles of each pair.
    pub tags: [Vec<u32>; 2],
    /// The pairs in double precision, if these have been computed; otherwise empty.
    pub exact: Vec<ExactPair>,
    /// Ratio `r/|g|` of each pair; empty unless requested.
    pub stretch: Vec<f64>,
    /// Noise of each pair; of another list until it is drawn.
    pub xi: Vec<f32>,
    scratch: Scratch,
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

/// Scratch arrays of a batch that is listed.
#[derive(Debug, Clone, Default)]
struct Scratch {
    /// For each vector of pairs the mask of those that are kept, and the number of those kept before.
    kept: Vec<[u32; 2]>,
    /// Ratio `|g|/r` of each kept pair, if requested.
    per_distance: Vec<f32>,
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
        self.tags.iter_mut().for_each(Vec::clear);
        self.exact.clear();
        self.stretch.clear();
    }

    /// Appends a list whose particles follow.
    fn append(&mut self, next: &PairList) {
        self.begin_at(next.first);
        let count = self.pairs.len() as u32;
        self.start.extend(next.start.iter().skip(1).map(|start| count + start));
        self.pairs.extend_from_slice(&next.pairs);
        self.tags.iter_mut().zip(&next.tags).for_each(|(tags, next)| tags.extend_from_slice(next));
        self.stretch.extend_from_slice(&next.stretch);
    }

    /// Gives no pairs to the particles before `place` that are not listed yet.
    #[inline(always)]
    pub fn begin_at(&mut self, place: usize) {
        let PairList { start, pairs, first, .. } = self;
        start.resize(place - *first + 1, pairs.len() as u32);
    }

    /// The vector `g` of a pair, in the highest precision available.
    #[inline(always)]
    pub fn g(&self, k: usize) -> [f64; 3] {
        self.exact.get(k).map_or_else(|| self.pairs[k].g.map(f64::from), |pair| pair.g)
    }
}

/// Factors of the pairs, by pairs of species.
#[derive(Debug, Clone)]
pub struct WeightTables {
    pub species: usize,
    /// Amplitude `√(½ Δt γ)`; zero without drag.
    pub amplitude: SpeciesPairTable<f32>,
    pub inverse_range: SpeciesPairTable<f32>,
    pub exponent: Exponent<f32>,
}

/// The pairs that are listed, and whether `r/|g|` is requested.
#[derive(Debug, Clone)]
pub struct ListTerms {
    pub tables: WeightTables,
    pub with_stretch: bool,
}

/// What the list needs of a vector of pairs.
pub struct PairsAt<I: Isa> {
    pub geometry: PairGeometry<I::F32>,
    /// Read only with several species.
    pub species_pair: SpeciesPair<I::F32>,
    pub tags: [<I::F32 as Reals>::Words; 2],
}

/// The pairs of a batch, a vector at a time.
pub trait VectorsOfPairs<I: Isa> {
    /// The pairs from number `k` on; lanes beyond the last pair are unspecified.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; `k` is a multiple of the lanes, and a number of a pair.
    unsafe fn at(&self, k: usize) -> PairsAt<I>;
}

/// Appends the pairs of a batch within their range to a list.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The list has no particle of the batch or after it yet.
#[inline(always)]
pub unsafe fn append_batch<I: Isa, const MULTISPECIES: bool>(
    list: &mut PairList,
    terms: &ListTerms,
    batch: Batch,
    vectors: &impl VectorsOfPairs<I>,
) {
    type W<I> = <<I as Isa>::F32 as Reals>::Words;
    list.begin_at(batch.first);
    let j_from = (list.j_from as u32) << OFFSET_BITS;
    let PairList { start, pairs, tags: [a, b], stretch, scratch: Scratch { kept, per_distance }, .. } = list;
    let (lanes, tables) = (I::F32::LANES, &terms.tables);
    let room = batch.count + 16;
    make_room(start, batch.members);
    make_room(pairs, room);
    make_room(a, room);
    make_room(b, room);
    kept.resize(kept.len().max(room), [0; 2]);
    if terms.with_stretch {
        per_distance.resize(per_distance.len().max(room), 0.0);
    }
    // SAFETY: the search pads lists of the batch; room for all its pairs and a vector has been reserved, and `found`
    // written pairs are initialised. The caller promises the rest.
    unsafe {
        let weight = ThermostatWeight::<I::F32>::new(&tables.inverse_range, &tables.exponent);
        let amplitude = TableLookup::<I::F32>::new(&tables.amplitude);
        let before = pairs.len();
        let to_pairs = pairs.as_mut_ptr().add(before);
        let to_tags = [a.as_mut_ptr().add(before), b.as_mut_ptr().add(before)];
        let j_from = W::<I>::splat(j_from);
        let mut found = 0;
        let mut k = 0;
        while k < batch.count {
            let PairsAt { geometry, species_pair, tags } = vectors.at(k);
            let w = weight.weight::<MULTISPECIES>(geometry.r, species_pair);
            let factor = amplitude.lookup::<MULTISPECIES>(species_pair) * w * geometry.inverse;
            let mut mask = I::F32::constant(0.0).mask_below(factor);
            if batch.count - k < lanes {
                mask &= (1 << (batch.count - k)) - 1;
            }
            *kept.get_unchecked_mut(k / lanes) = [mask, found as u32];
            let [dx, dy, dz] = geometry.d;
            let j = W::<I>::load(batch.j_offsets.as_ptr().add(k)).sub(j_from).shift_right::<OFFSET_BITS>();
            let columns = [factor * dx, factor * dy, factor * dz, I::of_bits(j)];
            I::F32::store_rows(columns, mask, to_pairs.add(found).cast());
            I::of_bits(tags[0]).compress(mask).store(to_tags[0].add(found).cast());
            I::of_bits(tags[1]).compress(mask).store(to_tags[1].add(found).cast());
            if terms.with_stretch {
                factor.compress(mask).store(per_distance.as_mut_ptr().add(found));
            }
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
        pairs.set_len(before + found);
        a.set_len(before + found);
        b.set_len(before + found);
        if terms.with_stretch {
            stretch
                .extend(per_distance.get_unchecked(..found).iter().map(|factor| f64::from(factor.recip())));
        }
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
        match inputs.terms.tables.species {
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
            let (metric, i_particles, species) = (self.metric, &*self.i_particles, terms.tables.species);
            let computed = Computed::<I, MULTISPECIES> { metric, packed, i_particles, batch, species };
            append_batch::<I, MULTISPECIES>(self.lists.of(batch), terms, batch, &computed);
        }
    }
}

/// Computes the pairs of a batch.
struct Computed<'a, I: Isa, const MULTISPECIES: bool> {
    metric: <Mixed as Arithmetic<I>>::Metric,
    packed: *const MixedParticle,
    i_particles: &'a IParticles<f32>,
    batch: Batch<'a>,
    species: usize,
}

impl<I: Isa, const MULTISPECIES: bool> VectorsOfPairs<I> for Computed<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn at(&self, k: usize) -> PairsAt<I> {
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
            PairsAt { geometry, species_pair, tags: tags.tags }
        }
    }
}
