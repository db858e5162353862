//! Counts the pairs of a plane in shells of equal thickness.

use super::list::{Computed, PairsAt, VectorsOfPairs};
use super::traversal::{BatchVisitor, each_batch};
use crate::cells::sorted::SortedCells;
use crate::ground::arithmetic::{Arithmetic, IParticles, Mixed, MixedParticle};
use crate::instruction_set::InstructionSet;
use crate::pair_batch::batch::Batch;
use crate::pair_search::buffers::SearchBuffers;
use crate::simd::{Isa, Kernel, Reals, Words, run};
use psidpd_model::kernel::Real;
use psidpd_threads::SharedSlice;

/// Shells of equal thickness from zero on.
#[derive(Debug, Clone, Copy)]
pub struct Shells {
    /// The number of shells in a unit of length.
    pub per_length: f64,
    pub count: usize,
    /// In shells, how far off a distance in single precision may be; less than half a shell.
    pub error: f64,
}

/// Particles in the order of cells, of so many species, and the shells.
#[derive(Clone, Copy)]
pub struct DistanceInputs<'a> {
    pub cells: SortedCells<'a>,
    pub packed: SharedSlice<'a, MixedParticle>,
    pub species: usize,
    pub shells: Shells,
}

/// Counts of pairs, and scratch arrays.
#[derive(Debug, Default)]
pub struct ShellCounts {
    /// Of each species of the first particle, and of the second, the pairs in each shell, and those beyond all shells or unsure.
    pub numbers: Vec<u64>,
    /// The sorted indices of pairs which are so near to the edge of a shell that single precision does not tell theirs.
    pub unsure: Vec<[usize; 2]>,
    search: SearchBuffers,
    i_particles: IParticles<f32>,
}

impl ShellCounts {
    pub fn new(species: usize, shells: &Shells) -> ShellCounts {
        ShellCounts { numbers: vec![0; species * species * (shells.count + 1)], ..ShellCounts::default() }
    }
}

/// Counts the pairs of a plane with each other and with the next plane, each pair once. There are no ghosts.
///
/// # Safety
/// Arrays have the sizes that [`SortedCells`] states, and are filled; no thread writes them. The counts are those of the shells.
pub unsafe fn count_pairs(
    set: InstructionSet,
    inputs: &DistanceInputs,
    plane: usize,
    counts: &mut ShellCounts,
) {
    let task = CountPairs { inputs, plane, counts };
    // SAFETY: the caller's promise is that of the loop.
    unsafe {
        match inputs.species {
            1 => run(set, WithSpecies::<false>(task)),
            _ => run(set, WithSpecies::<true>(task)),
        }
    }
}

struct CountPairs<'a> {
    inputs: &'a DistanceInputs<'a>,
    plane: usize,
    counts: &'a mut ShellCounts,
}

struct WithSpecies<'a, const MULTISPECIES: bool>(CountPairs<'a>);

impl<const MULTISPECIES: bool> Kernel for WithSpecies<'_, MULTISPECIES> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let CountPairs { inputs, plane, counts } = self.0;
        let ShellCounts { numbers, unsure, search, i_particles } = counts;
        // SAFETY: the caller of `count_pairs` promises filled arrays; a plane has a first column.
        unsafe {
            let columns = inputs.cells.grid.columns_per_plane;
            let metric = <Mixed as Arithmetic<I>>::metric(inputs.cells.geometry);
            let mut counter = Counter::<I, MULTISPECIES> { inputs, metric, i_particles, numbers, unsure };
            each_batch::<I, _>(&inputs.cells, plane, 0..columns, I::F32::LANES, search, &mut counter);
        }
    }
}

struct Counter<'a, I: Isa, const MULTISPECIES: bool> {
    inputs: &'a DistanceInputs<'a>,
    metric: <Mixed as Arithmetic<I>>::Metric,
    i_particles: &'a mut IParticles<f32>,
    numbers: &'a mut [u64],
    unsure: &'a mut Vec<[usize; 2]>,
}

impl<I: Isa, const MULTISPECIES: bool> BatchVisitor<I> for Counter<'_, I, MULTISPECIES> {
    #[inline(always)]
    unsafe fn visit(&mut self, search: &SearchBuffers, slots: [usize; 2]) {
        let DistanceInputs { packed, species, shells, .. } = self.inputs;
        let (mut shell, mut kinds) = ([0; 16], [0; 16]);
        // SAFETY: `SortedParticles::make_room` pads `packed` by a vector after the last particle; places are between zero and the
        // last counter. The caller promises the rest.
        unsafe {
            let Some(batch) = Batch::of_group(search, slots) else { return };
            let packed = packed.as_ptr();
            <Mixed as Arithmetic<I>>::load_i_particles(packed.add(batch.first), self.i_particles);
            let (metric, i_particles, species) = (self.metric, &*self.i_particles, *species);
            let computed = Computed::<I, MULTISPECIES> { metric, packed, i_particles, batch, species };
            let per_length = I::F32::constant(shells.per_length);
            let half = I::F32::constant(0.5);
            let beyond = I::F32::constant(shells.count as f64);
            // Squares, as there is no absolute value.
            let sure = I::F32::constant((0.5 - shells.error).powi(2));
            let mut k = 0;
            while k < batch.count {
                let PairsAt { geometry, species_pair } = computed.at(k);
                let place = (geometry.r * per_length - half).larger(I::F32::constant(0.0)).smaller(beyond);
                // Whichever is chosen between two shells, such a pair is unsure.
                let nearest = place.round();
                let off = place - nearest;
                let lanes = I::F32::LANES.min(batch.count - k);
                let mut open = sure.mask_below(off * off) & ((1 << lanes) - 1);
                nearest.store_whole(shell.as_mut_ptr());
                species_pair.0.store(kinds.as_mut_ptr());
                while open > 0 {
                    let lane = open.trailing_zeros() as usize;
                    self.unsure.push(batch.pair(k + lane));
                    shell[lane] = shells.count as i32;
                    open &= open - 1;
                }
                let mut lane = 0;
                while lane < lanes {
                    let kind = if MULTISPECIES { kinds[lane] as usize * (shells.count + 1) } else { 0 };
                    *self.numbers.get_unchecked_mut(kind + shell[lane] as usize) += 1;
                    lane += 1;
                }
                k += I::F32::LANES;
            }
        }
    }
}
