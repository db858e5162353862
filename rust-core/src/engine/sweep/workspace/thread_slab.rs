//! The data of a single thread.

use super::cell_order::CellOrder;
use super::units::Unit;
use crate::engine::error::EngineError;
use crate::engine::excess_pass::ExcessPass;
use crate::engine::sweep::times::Times;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::in_range_pairs::InRangePairs;
use psidpd_passes::plane::buffers::PairBuffers;
use psidpd_passes::plane::list::Listed;
use psidpd_passes::simd::Scalar;
use psidpd_passes::tally::Tally;
use psidpd_threads::take;
use std::ops::Range;

/// Number of planes of a thread slab whose pairs are in memory at once: the first two and the last two, where a part
/// of a plane may be of another slab, and two between.
pub const KEPT_PLANES: usize = 6;

/// The state of a thread that lasts from one evaluation to the next.
pub struct ThreadState<T> {
    pub buffers: PairBuffers<T>,
    /// The listed pairs of each plane of the slab, or of the part that the slab has.
    pub lists: Vec<Listed>,
    pub excess: ExcessPass,
    /// Error of a ψ that was not finite.
    pub fault: Option<EngineError>,
    /// The lowest tag of the particles whose forces were not finite.
    pub lost: Option<i32>,
    /// Number of planes whose forces have been written to the host.
    pub planes_written: u64,
    pub times: Times,
}

impl<T: Scalar> ThreadState<T> {
    pub fn new(passes: usize, set: InstructionSet) -> ThreadState<T> {
        let buffers = PairBuffers::new(passes);
        ThreadState {
            buffers,
            lists: Vec::new(),
            excess: ExcessPass::new(set),
            fault: None,
            lost: None,
            planes_written: 0,
            times: Times::default(),
        }
    }

    /// Exchanges the lists of the present plane with those of plane `number` of the slab.
    pub fn exchange_list(&mut self, number: usize) {
        if number == self.lists.len() {
            self.lists.push(Listed::default());
        }
        std::mem::swap(&mut self.buffers.lists, &mut self.lists[number]);
    }
}

/// Results of the passes: for each unit and for each particle.
#[derive(Default)]
pub struct PlaneResults<T> {
    /// Pairs for the second pass, of a few planes of each thread slab.
    in_range: Vec<InRangePairs<T>>,
    /// The rim of each unit: its pairs of an owned particle and a ghost.
    pub rims: Vec<InRangePairs<T>>,
    pub tallies: Vec<Tally>,
    /// The densities of each particle, and ψ, in the order of cells.
    pub densities: Vec<f64>,
    pub excess: Vec<f64>,
}

/// The units of one thread, and the data that only this thread accesses. Each unit is in exactly one slab.
pub struct ThreadSlab<'a, T> {
    pub units: Range<usize>,
    /// First particle of the slab.
    pub first: usize,
    pub state: &'a mut ThreadState<T>,
    in_range: &'a mut [InRangePairs<T>],
    rims: &'a mut [InRangePairs<T>],
    tallies: &'a mut [Tally],
    /// Densities of the particles of the slab.
    pub densities: &'a mut [f64],
    pub excess: &'a mut [f64],
}

impl<T: Scalar> PlaneResults<T> {
    /// Makes room for all particles of an order, `width` densities each, and for the pairs of a few planes of each slab.
    pub fn make_room(&mut self, order: &CellOrder, slabs: usize, width: usize) {
        self.in_range.resize_with(KEPT_PLANES * order.units_per_plane() * slabs, InRangePairs::default);
        self.rims.resize_with(order.units(), InRangePairs::default);
        self.tallies.clear();
        self.tallies.resize(order.units(), Tally::default());
        self.excess.resize(order.particles(), 0.0);
        self.densities.resize(width * order.particles(), 0.0);
    }

    /// Splits units and their results by thread.
    pub fn split<'a>(
        &'a mut self,
        order: &CellOrder,
        slabs: &[Range<usize>],
        width: usize,
        states: &'a mut [ThreadState<T>],
    ) -> Vec<ThreadSlab<'a, T>> {
        let (mut in_range, mut tallies) = (&mut self.in_range[..], &mut self.tallies[..]);
        let (mut densities, mut excess) = (&mut self.densities[..], &mut self.excess[..]);
        let mut rims = &mut self.rims[..];
        let slab = |(units, state): (&Range<usize>, &'a mut ThreadState<T>)| {
            let particles = order.particles_of_units(units);
            ThreadSlab {
                units: units.clone(),
                first: particles.start,
                state,
                in_range: take(&mut in_range, KEPT_PLANES * order.units_per_plane()),
                rims: take(&mut rims, units.len()),
                tallies: take(&mut tallies, units.len()),
                densities: take(&mut densities, width * particles.len()),
                excess: take(&mut excess, particles.len()),
            }
        };
        slabs.iter().zip(states).map(slab).collect()
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        self.in_range.iter().map(|pairs| pairs.bytes()).sum::<usize>()
            + self.rims.iter().map(|pairs| pairs.bytes()).sum::<usize>()
            + (self.densities.capacity() + self.excess.capacity()) * size_of::<f64>()
    }
}

impl<T> ThreadSlab<'_, T> {
    /// The rim of a unit of the slab, and its energies and virials.
    pub fn rim(&mut self, order: &CellOrder, unit: &Unit) -> (&InRangePairs<T>, &mut Tally) {
        let number = unit.plane * order.units_per_plane() + unit.block - self.units.start;
        (&self.rims[number], &mut self.tallies[number])
    }

    /// The buffers of a pass over a unit of the slab, its pairs for the second pass, at place `kept` of its plane, its
    /// rim, and its energies and virials.
    pub fn unit(
        &mut self,
        kept: usize,
        order: &CellOrder,
        unit: &Unit,
    ) -> (&mut PairBuffers<T>, &mut InRangePairs<T>, &mut InRangePairs<T>, &mut Tally) {
        let blocks = order.units_per_plane();
        let number = unit.plane * blocks + unit.block - self.units.start;
        let in_range = &mut self.in_range[kept * blocks + unit.block];
        (&mut self.state.buffers, in_range, &mut self.rims[number], &mut self.tallies[number])
    }
}
