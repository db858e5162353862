//! The arrays of one precision, and the steps of an evaluation.

mod accumulators;
mod cell_order;
mod excess;
mod excluded_pairs;
mod fluid;
mod forces;
mod host;
mod input;
mod loan;
mod prefetch;
mod rim;
mod scheduler;
mod slopes;
mod sorted_particles;
mod thread_slab;
mod units;

pub use cell_order::{CellOrder, extremes};
pub use forces::ForceSink;
pub use input::Input;
pub use sorted_particles::{SharedParticles, SortedParticles};

use crate::engine::error::EngineError;
use crate::engine::fault::Fault;
use crate::engine::plan::Plan;
use crate::engine::sweep::terms::terms;
use crate::engine::sweep::times::Times;
use accumulators::AccumulatorArrays;
use excess::ExcessInput;
use excluded_pairs::ExcludedPairs;
use fluid::FluidConstants;
use psidpd_passes::cells::sorted::SortedCells;
use psidpd_passes::compiled::{PairPrecision, Passes};
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::pair_batch::inputs::PairInputs;
use psidpd_passes::plane::data::PassData;
use psidpd_passes::plane::list::{ListTerms, Listed};
use psidpd_threads::{Pool, part};
use scheduler::{PassInput, Scheduler};
use slopes::SlopeArrays;
use std::ops::Range;
use thread_slab::{PlaneResults, ThreadSlab, ThreadState};

/// All particles in the order of cells. Whole vectors can be read behind the last.
#[derive(Debug, Clone, Copy)]
pub struct Sorted<'a> {
    pub order: &'a CellOrder,
    /// Positions relative to the origin of the box geometry.
    pub x: [&'a [f32]; 3],
    /// Species of the particles; empty with one species.
    pub species: &'a [u8],
}

/// Arrays in the order of cells, and scratch arrays of the passes.
pub struct Workspace<P: PairPrecision> {
    fluid: FluidConstants<P::Scalar>,
    /// The order of the particles.
    pub order: CellOrder,
    particles: SortedParticles<P::PackedParticle>,
    excluded: ExcludedPairs,
    accumulators: AccumulatorArrays,
    slopes: SlopeArrays<P::Scalar>,
    results: PlaneResults<P::Scalar>,
    threads: Vec<ThreadState<P::Scalar>>,
    /// Noise and `dt^{−1/2}` of the present evaluation.
    thermostat: Option<(PairNoise, f64)>,
    /// The pairs that the present evaluation lists.
    pub listed: Option<ListTerms>,
    totals: bool,
}

impl<P: PairPrecision> Workspace<P> {
    pub fn new(plan: &Plan, set: InstructionSet, threads: usize) -> Workspace<P> {
        let mut terms = terms(plan);
        Fault::present().into_iter().for_each(|fault| fault.spoil(&mut terms));
        let count = plan.species.len();
        let variables = plan.passes.iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect();
        let threads = (0..threads).map(|_| ThreadState::new(terms.passes.len(), set)).collect();
        Workspace {
            fluid: FluidConstants { set, terms, variables },
            order: CellOrder::default(),
            particles: SortedParticles::default(),
            excluded: ExcludedPairs::default(),
            accumulators: AccumulatorArrays::default(),
            slopes: SlopeArrays::default(),
            results: PlaneResults::default(),
            threads,
            thermostat: None,
            listed: None,
            totals: false,
        }
    }

    /// Finds the order of the particles in the cells of `grid`, and makes room for them in the arrays.
    pub fn sort_into_cells(
        &mut self,
        pool: &Pool,
        geometry: BoxGeometry,
        grid: CellGrid,
        input: &Input,
    ) -> Result<(), EngineError> {
        (self.thermostat, self.totals) = (input.thermostat, input.totals);
        self.order.sort(pool, self.fluid.set, geometry, grid, input)?;
        self.particles.make_room(&self.order, self.fluid.terms.species > 1);
        self.excluded.fill(&self.order, input.exclusions);
        let packs = self.fluid.terms.full_cache;
        self.slopes.make_room(&self.order, self.fluid.width(), packs);
        Ok(())
    }

    /// The particles of the last evaluation.
    pub fn sorted(&self) -> Sorted<'_> {
        let SortedParticles { x, species, .. } = &self.particles;
        Sorted { order: &self.order, x: x.each_ref().map(|x| &x[..]), species }
    }

    /// Does everything after [`Workspace::sort_into_cells`]: the first pass, ψ and the second pass over
    /// all planes, and their forces without the many-body forces of pairs with ghosts, which [`Workspace::add_rim`] adds. `times` are those of the caller's thread.
    ///
    /// # Errors
    /// Fails for ψ or a force that is not finite, and names the lowest tag.
    pub fn run_all(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        input: &Input,
        out: ForceSink,
        times: &mut Times,
    ) -> Result<(), EngineError> {
        let units = &self.order.thread_slabs(pool.threads())[..];
        let excess = ExcessInput::new(plan, input);
        self.fill_start(pool, input, units, excess.is_some());
        let (has_excess, has_passes) = (excess.is_some(), !self.fluid.terms.passes.is_empty());
        let input = &PassInput { input, excess, out };
        self.on_slabs(units, |scheduler, slabs| {
            type Stage<'a, T> = &'a (dyn Fn(&mut ThreadSlab<T>) + Sync);
            // SAFETY: `fill_start` has filled the ends of all slabs, and the copies exist; no other work runs.
            let interior: Stage<P::Scalar> = &|slab| unsafe { scheduler.interior(input, slab) };
            // SAFETY: the interior of all slabs is done; no other work runs.
            let excess: Stage<P::Scalar> = &|slab| unsafe { scheduler.excess_at_ends(input, slab) };
            // SAFETY: the slopes of all particles and copies are complete; no other work runs.
            let second: Stage<P::Scalar> = &|slab| unsafe { scheduler.second_at_ends(slab) };
            // SAFETY: all passes are done; no other work runs.
            let forces: Stage<P::Scalar> = &|slab| unsafe { scheduler.forces_at_ends(out, slab) };
            // A stage without work would be one more meeting of the threads.
            let stages = [(true, interior), (has_excess, excess), (has_passes, second), (true, forces)];
            let stages: Vec<_> =
                stages.into_iter().filter_map(|(has_work, stage)| has_work.then_some(stage)).collect();
            pool.in_stages(slabs, &stages);
        });
        self.finish(times)
    }

    /// Makes room, and fills the particles that threads of other slabs read, and the copies of the first plane.
    fn fill_start(&mut self, pool: &Pool, input: &Input, units: &[Range<usize>], has_excess: bool) {
        let width = self.fluid.width();
        self.accumulators.lay_out(&self.order, units, width);
        self.results.make_room(&self.order, units.len(), width);
        if !has_excess {
            self.results.excess.fill(0.0);
        }
        self.on_slabs(units, |scheduler, slabs| scheduler.fill_start(pool, input, slabs));
        self.particles.copy_first_plane(&self.order);
    }

    /// Lends all arrays to the threads, to each its slab of units.
    fn on_slabs(
        &mut self,
        units: &[Range<usize>],
        work: impl FnOnce(&Scheduler<P>, &mut [ThreadSlab<P::Scalar>]),
    ) {
        let Workspace {
            fluid,
            order,
            particles,
            excluded,
            accumulators,
            slopes,
            results,
            threads,
            listed,
            ..
        } = self;
        let (particles, excluded) = (&particles.share(), excluded.share());
        let (slopes, sums) = (slopes.share(), accumulators.share());
        let SharedParticles { x, fixed16_scale, fixed16, packed, species } = *particles;
        let (geometry, grid, start) = (&order.geometry, &order.grid, &order.start[..]);
        let (terms, thermostat) = (&fluid.terms, self.thermostat);
        let data = PassData {
            cells: SortedCells { set: fluid.set, geometry, grid, start, x, fixed16, fixed16_scale, excluded },
            inputs: PairInputs { geometry, terms, thermostat, packed, species },
            slopes: slopes.slopes,
            listed: listed.as_ref(),
        };
        let passes = Passes::new(fluid.set, &fluid.terms, self.totals);
        let mut slabs = results.split(order, units, fluid.width(), threads);
        let scheduler = &Scheduler { fluid, passes, order, data, particles, slopes, sums };
        work(scheduler, &mut slabs);
    }

    /// Gives lists, in the order of planes, to the threads that will need their memory.
    pub fn lend_lists(&mut self, mut lists: impl ExactSizeIterator<Item = Listed>) {
        let (count, threads) = (lists.len(), self.threads.len());
        for (number, state) in self.threads.iter_mut().enumerate() {
            state.lists = lists.by_ref().take(part(count, number, threads).len()).collect();
        }
    }

    /// Moves the pairs that the last evaluation has listed to the lists of the planes, whose memory it keeps for the next.
    pub fn move_lists<'a>(&mut self, lists: impl Iterator<Item = &'a mut Listed>) {
        let Workspace { order, threads, .. } = self;
        let mut lists: Vec<_> = lists.collect();
        for (units, state) in order.thread_slabs(threads.len()).iter().zip(threads) {
            for (plane, found) in order.planes_of(units).zip(&mut state.lists) {
                // A plane may be in several slabs.
                match found.own.first == order.plane_start(plane) {
                    true => std::mem::swap(lists[plane], found),
                    false => lists[plane].append(found),
                }
            }
        }
    }

    /// Adds the times of the caller's thread; fails for ψ or a force that is not finite, and names the lowest tag.
    fn finish(&mut self, times: &mut Times) -> Result<(), EngineError> {
        if let Some(state) = self.threads.first_mut() {
            *times += std::mem::take(&mut state.times);
        }
        if let Some(fault) = self.threads.iter_mut().find_map(|state| state.fault.take()) {
            return Err(fault);
        }
        match self.threads.iter_mut().filter_map(|state| state.lost.take()).min() {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }
}

#[cfg(test)]
mod tests;
