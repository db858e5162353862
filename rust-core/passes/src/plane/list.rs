//! Lists the pairs of a plane within the range of the thermostat, for integrators that apply it apart from the forces.

use super::traversal::{BatchVisitor, each_batch};
use crate::cells::sorted::SortedCells;
use crate::ground::arithmetic::{Arithmetic, IParticles, Mixed, MixedParticle};
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
    /// Index of the second particle, counted from the first particle of the first particle's plane, through the next plane.
    pub j: u32,
}

/// A pair in double precision.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct ExactPair {
    pub g: [f64; 3],
    pub j: u64,
}

/// The pairs of a plane, sorted by first particle, in the order of cells.
#[derive(Debug, Clone, Default)]
pub struct PairList {
    /// Index of each particle's first pair; the last entry is one past the last pair.
    pub start: Vec<u32>,
    pub pairs: Vec<Pair>,
    /// The pairs in double precision, if these have been computed; otherwise empty.
    pub exact: Vec<ExactPair>,
    /// Ratio `r/|g|` of each pair; empty unless requested.
    pub stretch: Vec<f64>,
}

/// The particles of a plane, counted from its first, each with the range of its pairs in the list.
#[inline(always)]
pub fn pairs_of_each(
    start: &[u32],
) -> impl DoubleEndedIterator<Item = (usize, Range<usize>)> + ExactSizeIterator {
    start.windows(2).map(|ends| ends[0] as usize..ends[1] as usize).enumerate()
}

impl PairList {
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

/// Scratch arrays of the listing.
#[derive(Debug, Default)]
pub struct ListBuffers {
    search: SearchBuffers,
    i_particles: IParticles<f32>,
    /// The i-particle of each kept pair of a batch.
    i_in_batch: Vec<u32>,
    /// Ratio `|g|/r` of each pair, if requested.
    per_distance: Vec<f32>,
}

/// Particles in the order of cells, and the factors of their pairs.
#[derive(Clone, Copy)]
pub struct ListInputs<'a> {
    pub cells: SortedCells<'a>,
    pub packed: SharedSlice<'a, MixedParticle>,
    pub tables: &'a WeightTables,
    /// Whether `r/|g|` is requested.
    pub with_stretch: bool,
}

/// Lists the pairs of particles of a plane with each other and with the next plane, each pair once.
///
/// # Safety
/// Arrays have the sizes that [`SortedCells`] states, and are filled; no thread writes them.
pub unsafe fn list_pairs(
    set: InstructionSet,
    inputs: &ListInputs,
    plane: usize,
    buffers: &mut ListBuffers,
    list: &mut PairList,
) {
    list.start.clear();
    list.start.push(0);
    list.pairs.clear();
    list.exact.clear();
    list.stretch.clear();
    buffers.per_distance.clear();
    let task = ListPairs { inputs, plane, buffers, list };
    // SAFETY: `PairLists::find` sorts all particles of the box into the arrays before it lists any
    // plane, and writes none of them while it lists.
    unsafe {
        match inputs.tables.species {
            1 => run(set, WithSpecies::<false>(task)),
            _ => run(set, WithSpecies::<true>(task)),
        }
    }
    list.stretch.extend(buffers.per_distance.iter().map(|factor| f64::from(factor.recip())));
}

struct ListPairs<'a> {
    inputs: &'a ListInputs<'a>,
    plane: usize,
    buffers: &'a mut ListBuffers,
    list: &'a mut PairList,
}

struct WithSpecies<'a, const MULTISPECIES: bool>(ListPairs<'a>);

impl<const MULTISPECIES: bool> Kernel for WithSpecies<'_, MULTISPECIES> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let ListPairs { inputs, plane, buffers, list } = self.0;
        let ListBuffers { search, i_particles, i_in_batch, per_distance } = buffers;
        // SAFETY: the caller of `list_pairs` promises filled arrays; a plane has a first column.
        unsafe {
            let first = inputs.cells.column(plane, 0)[0];
            let columns = inputs.cells.grid.columns_per_plane;
            let end = inputs.cells.column(plane, columns - 1)[1];
            let metric = <Mixed as Arithmetic<I>>::metric(inputs.cells.geometry);
            let mut lister = Lister::<I, MULTISPECIES> {
                inputs,
                metric,
                first,
                i_particles,
                i_in_batch,
                per_distance,
                list,
            };
            each_batch::<I, _>(&inputs.cells, plane, 0..columns, I::F32::LANES, search, &mut lister);
            lister.begin_at(end);
        }
    }
}

struct Lister<'a, I: Isa, const MULTISPECIES: bool> {
    inputs: &'a ListInputs<'a>,
    metric: <Mixed as Arithmetic<I>>::Metric,
    /// The first particle of the plane.
    first: usize,
    i_particles: &'a mut IParticles<f32>,
    i_in_batch: &'a mut Vec<u32>,
    per_distance: &'a mut Vec<f32>,
    list: &'a mut PairList,
}

impl<I: Isa, const MULTISPECIES: bool> Lister<'_, I, MULTISPECIES> {
    /// Gives no pairs to the particles before `place` that were not visited: they are in columns of ghosts.
    #[inline(always)]
    fn begin_at(&mut self, place: usize) {
        let PairList { start, pairs, .. } = &mut *self.list;
        start.resize(place - self.first + 1, pairs.len() as u32);
    }
}

impl<I: Isa, const MULTISPECIES: bool> BatchVisitor<I> for Lister<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]) {
        type W<I> = <<I as Isa>::F32 as Reals>::Words;
        let members = slots[1] - slots[0];
        self.begin_at(search.first + slots[0]);
        let PairList { start, pairs, .. } = &mut *self.list;
        let per_distance = &mut *self.per_distance;
        make_room(start, members);
        // SAFETY: `SortedParticles::make_room` pads `packed` by a vector after the last particle, and
        // the search pads lists of the batch; room for all its pairs and a vector has been reserved,
        // and `found` written pairs are initialised. The caller promises the rest.
        unsafe {
            let Some(batch) = Batch::of_group(search, slots) else {
                start.resize(start.len() + members, pairs.len() as u32);
                return;
            };
            let tables = self.inputs.tables;
            let weight = ThermostatWeight::<I::F32>::new(&tables.inverse_range, &tables.exponent);
            let amplitude = TableLookup::<I::F32>::new(&tables.amplitude);
            let packed = self.inputs.packed.as_ptr();
            let i_particles = &mut *self.i_particles;
            <Mixed as Arithmetic<I>>::load_i_particles(packed.add(batch.first), i_particles);
            make_room(pairs, batch.count + 16);
            if self.inputs.with_stretch {
                make_room(per_distance, batch.count + 16);
            }
            self.i_in_batch.resize(self.i_in_batch.len().max(batch.count + 16), 0);
            let to_pairs = pairs.as_mut_ptr().add(pairs.len());
            let to_per_distance = per_distance.as_mut_ptr().add(per_distance.len());
            let to_i = self.i_in_batch.as_mut_ptr();
            let plane_first = W::<I>::splat((self.first as u32) << OFFSET_BITS);
            let mut found = 0;
            let mut k = 0;
            while k < batch.count {
                let i = W::<I>::load_bytes(batch.i_in_batch.as_ptr().add(k));
                let j = batch.j_offsets.as_ptr().add(k);
                let (geometry, tags) = <Mixed as Arithmetic<I>>::pair_geometry::<MULTISPECIES>(
                    &self.metric,
                    packed,
                    i_particles,
                    i,
                    j,
                    false,
                );
                let species_pair = if MULTISPECIES {
                    let species_i = W::<I>::pick(i_particles.species.as_ptr(), i);
                    SpeciesPair::new(species_i, tags.species_j, tables.species)
                } else {
                    SpeciesPair(i)
                };
                let w = weight.weight::<MULTISPECIES>(geometry.r, species_pair);
                let factor = amplitude.lookup::<MULTISPECIES>(species_pair) * w * geometry.inverse;
                let mut mask = I::F32::constant(0.0).mask_below(factor);
                if batch.count - k < I::F32::LANES {
                    mask &= (1 << (batch.count - k)) - 1;
                }
                let [dx, dy, dz] = geometry.d;
                let j = W::<I>::load(j).sub(plane_first).shift_right::<OFFSET_BITS>();
                let columns = [factor * dx, factor * dy, factor * dz, I::of_bits(j)];
                I::F32::store_rows(columns, mask, to_pairs.add(found).cast());
                I::of_bits(i).compress(mask).store(to_i.add(found).cast());
                if self.inputs.with_stretch {
                    factor.compress(mask).store(to_per_distance.add(found));
                }
                found += mask.count_ones() as usize;
                k += I::F32::LANES;
            }
            let mut counts = [0; 16];
            for i in self.i_in_batch.get_unchecked(..found) {
                counts[*i as usize % 16] += 1;
            }
            let mut end = pairs.len() as u32;
            for count in counts.get_unchecked(..members) {
                end += count;
                start.push(end);
            }
            pairs.set_len(pairs.len() + found);
            if self.inputs.with_stretch {
                per_distance.set_len(per_distance.len() + found);
            }
        }
    }
}
