//! The scheduler runs the passes plane by plane, so that the results of one pass are still in the cache when the
//! next pass reads them: all passes run together, and only a few planes are in memory at once. The
//! many-body forces of pairs with ghosts follow when the host has sent the slopes of these: `rim` adds them.
//!
//! Each thread has a slab of consecutive units: planes, and at both ends perhaps a part of a plane. Dependencies
//! between planes:
//!
//! - ψ of a plane needs the first pass over that plane and over the previous one;
//! - the second pass over a plane needs ψ of that plane and of the next one;
//! - forces of a plane need both passes over that plane and over the previous one.
//!
//! Arrays in the order of cells are filled one plane ahead. What depends on planes that are not wholly in the slab is
//! done after all threads have done their interiors.
//!
//! Access of threads: a [`ThreadSlab`] belongs to one thread. Three arrays are shared. Packed particles are written
//! by the thread of their slab, one plane ahead of its first pass. Threads of previous slabs read those of the
//! slab's first two planes and four vectors more, threads of later slabs those of its last plane and ghosts of its last two: these are filled
//! before any pass begins. Accumulators are written by the thread of the unit whose pairs add to them, except that
//! the thread of the particles joins their sums. Slopes are written by the thread of their slab. Threads of previous
//! slabs read those of the first planes, in a separate round after all slopes are written.

use super::accumulators::Sums;
use super::cell_order::CellOrder;
use super::excess::{DENSITY_BLOCK, DensityBlock, ExcessInput};
use super::fluid::FluidConstants;
use super::forces::ForceSink;
use super::input::{Input, VECTOR_PADDING};
use super::slopes::SharedSlopes;
use super::sorted_particles::SharedParticles;
use super::thread_slab::ThreadSlab;
use super::units::Unit;
use crate::engine::sweep::times::lap;
use psidpd_passes::compiled::{First, PairPrecision, Passes, Second};
use psidpd_passes::plane::data::PassData;
use psidpd_threads::Pool;
use std::ops::Range;
use std::time::Instant;

/// The data that all threads share.
pub struct Scheduler<'a, P: PairPrecision> {
    pub fluid: &'a FluidConstants<P::Scalar>,
    pub passes: Passes<P>,
    pub order: &'a CellOrder,
    pub data: PassData<'a, P::Scalar, P::PackedParticle>,
    pub particles: &'a SharedParticles<'a, P::PackedParticle>,
    pub slopes: SharedSlopes<'a, P::Scalar>,
    pub sums: Sums<'a>,
}

/// Input of the passes up to ψ.
pub struct PassInput<'a> {
    pub input: &'a Input<'a>,
    /// The input of ψ; `None` if ψ is zero.
    pub excess: Option<ExcessInput<'a>>,
    /// The place for forces.
    pub out: ForceSink<'a>,
}

/// A place, or the end of all, rounded down to a whole vector.
fn vectors_before(place: usize) -> usize {
    place / VECTOR_PADDING * VECTOR_PADDING
}

/// The particles that the thread of a slab must have filled before it does its first `planes` planes: all vectors
/// that begin in these planes, the vector across the start of the slab, and four more, because the distance filter
/// reads sixteen candidates at once and up to two such groups begin after the last particle.
fn needed(order: &CellOrder, units: &Range<usize>, planes: usize) -> Range<usize> {
    let Range { start, end } = order.particles_of_units(units);
    let (start, end) = (vectors_before(start), vectors_before(end));
    let of_slab = order.planes_of(units);
    let behind = (of_slab.start + planes).min(of_slab.end);
    let behind = vectors_before(order.plane_start(behind)) + 4 * VECTOR_PADDING;
    start..behind.clamp(start, end)
}

/// The particles of a slab that its thread fills before any pass begins: those of its first two planes, and of its
/// last one, or two if there are ghosts; all if everything fits into the cache.
fn filled_first(order: &CellOrder, units: &Range<usize>) -> [Range<usize>; 2] {
    let first = needed(order, units, if order.exceeds_cache() { 2 } else { order.grid.planes });
    let end = vectors_before(order.particles_of_units(units).end);
    let last = order.planes_of(units).end.saturating_sub(order.grid.layers);
    let last = vectors_before(order.plane_start(last)).clamp(first.end, end);
    [first, last..end]
}

impl<P: PairPrecision> Scheduler<'_, P> {
    /// Fills the particles of all thread slabs that threads of other slabs read, and the particles after the last whole
    /// vector, which are in no slab.
    pub fn fill_start(&self, pool: &Pool, input: &Input, slabs: &mut [ThreadSlab<P::Scalar>]) {
        let (set, order) = (self.fluid.set, self.order);
        let rest = vectors_before(order.particles())..order.particles();
        // SAFETY: no other thread fills particles yet, and no pass reads any before this is done.
        unsafe { self.particles.fill(set, order, input, rest) };
        pool.each(slabs, |slab| {
            let mut since = Instant::now();
            for places in filled_first(order, &slab.units) {
                // SAFETY: different slabs have disjoint particles, each slab has one thread, and no pass reads yet.
                unsafe { self.particles.fill(set, order, input, places) };
            }
            lap(&mut since, &mut slab.state.times.sort);
        });
    }

    /// The units of a slab in a plane.
    fn units(&self, slab: &ThreadSlab<P::Scalar>, plane: usize) -> impl Iterator<Item = Unit> + use<'_, P> {
        self.order.units_of(plane, &slab.units).map(|number| self.order.unit(number))
    }

    /// Fills the arrays of a thread slab, and does the first pass over all its units, and ψ, the second pass and the
    /// forces of the planes for which the slab has all that they need.
    ///
    /// # Safety
    /// [`Scheduler::fill_start`] has run for all slabs, and the copies of the first plane exist. Other threads run
    /// the same function for other slabs, and nothing else.
    pub unsafe fn interior(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>) {
        (slab.state.fault, slab.state.lost) = (None, None);
        let mut since = Instant::now();
        let planes = self.order.planes_of(&slab.units);
        let [Range { end: mut filled, .. }, Range { start: limit, .. }] =
            filled_first(self.order, &slab.units);
        for plane in planes.clone() {
            let end = needed(self.order, &slab.units, plane - planes.start + 2).end.clamp(filled, limit);
            // SAFETY: the range contains particles of this slab between those filled at the
            // start: no other thread accesses them.
            unsafe { self.particles.fill(self.fluid.set, self.order, input.input, filled..end) };
            filled = end;
            lap(&mut since, &mut slab.state.times.sort);
            slab.state.exchange_list(plane - planes.start);
            let first = self.order.plane_start(plane);
            slab.state.buffers.lists.clear(first.max(slab.first), first);
            for unit in self.units(slab, plane) {
                // SAFETY: this plane, the next and the vectors after them are filled; if the next plane is
                // not of this slab, or a copy, it was filled by `fill_start`.
                unsafe { self.first(slab, &unit) };
            }
            slab.state.exchange_list(plane - planes.start);
            lap(&mut since, &mut slab.state.times.first);
            if self.order.has_densities(&slab.units, plane) {
                for unit in self.units(slab, plane) {
                    // SAFETY: this thread alone adds to the unit's particles, and reads their slopes.
                    unsafe { self.excess(input, slab, &unit) };
                }
                lap(&mut since, &mut slab.state.times.excess);
            }
            let Some(plane) = plane.checked_sub(1).filter(|plane| self.order.has_slopes(&slab.units, *plane))
            else {
                continue;
            };
            for unit in self.units(slab, plane) {
                // SAFETY: `excess` has evaluated ψ of this plane and of the next, both wholly of this slab.
                unsafe { self.second(slab, &unit) };
            }
            lap(&mut since, &mut slab.state.times.second);
            if self.order.has_forces(&slab.units, plane) {
                for unit in self.units(slab, plane) {
                    // SAFETY: this thread alone adds to the unit's particles.
                    unsafe { self.forces(input.out, slab, &unit) };
                }
                lap(&mut since, &mut slab.state.times.forces);
            }
        }
    }

    /// Evaluates ψ of the units of a thread slab to which other slabs contribute.
    ///
    /// # Safety
    /// The interior of all slabs is done. Other threads run the same function for other slabs, and nothing else.
    pub unsafe fn excess_at_ends(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>) {
        let mut since = Instant::now();
        let units = slab.units.clone();
        for plane in self.order.planes_of(&units).filter(|plane| !self.order.has_densities(&units, *plane)) {
            for unit in self.units(slab, plane) {
                // SAFETY: the caller promises that no pass runs, and each unit is in one slab.
                unsafe { self.excess(input, slab, &unit) };
            }
        }
        lap(&mut since, &mut slab.state.times.excess);
    }

    /// Does the second pass of the units of a thread slab that need slopes of other slabs.
    ///
    /// # Safety
    /// All slopes are complete, including those of the copies, and no thread writes any. Other threads run the same
    /// function for other slabs, and nothing else.
    pub unsafe fn second_at_ends(&self, slab: &mut ThreadSlab<P::Scalar>) {
        let mut since = Instant::now();
        let units = slab.units.clone();
        for plane in self.order.planes_of(&units).filter(|plane| !self.order.has_slopes(&units, *plane)) {
            for unit in self.units(slab, plane) {
                // SAFETY: the caller promises that all slopes are complete.
                unsafe { self.second(slab, &unit) };
            }
        }
        lap(&mut since, &mut slab.state.times.second);
    }

    /// Writes the forces of the units of a thread slab to which other slabs contribute.
    ///
    /// # Safety
    /// The passes of all slabs are done. Other threads run the same function for other slabs, and nothing else.
    pub unsafe fn forces_at_ends(&self, out: ForceSink, slab: &mut ThreadSlab<P::Scalar>) {
        let mut since = Instant::now();
        let units = slab.units.clone();
        for plane in self.order.planes_of(&units).filter(|plane| !self.order.has_forces(&units, *plane)) {
            for unit in self.units(slab, plane) {
                // SAFETY: the caller promises that no pass runs, and each unit is in one slab.
                unsafe { self.forces(out, slab, &unit) };
            }
        }
        lap(&mut since, &mut slab.state.times.forces);
    }

    /// The place of a plane of a slab among those whose pairs are in memory at once.
    fn kept(&self, slab: &ThreadSlab<P::Scalar>, plane: usize) -> usize {
        let planes = self.order.planes_of(&slab.units);
        match (self.order.has_slopes(&slab.units, plane), plane - planes.start, planes.end - plane) {
            (true, ..) => 4 + plane % 2,
            (false, first @ 0..2, _) => first,
            (false, _, last) => 1 + last,
        }
    }

    /// Does the first pass of a unit.
    ///
    /// # Safety
    /// The plane, the next one and the vectors after them are filled; no thread writes there meanwhile.
    unsafe fn first(&self, slab: &mut ThreadSlab<P::Scalar>, unit: &Unit) {
        let (kept, Unit { plane, columns, .. }) = (self.kept(slab, unit.plane), unit.clone());
        let (buffers, in_range, rim, tally) = slab.unit(kept, self.order, unit);
        // SAFETY: no other unit of the set reaches these particles, and each unit is in one slab.
        unsafe { self.sums.clear(self.fluid.set, self.order, unit) };
        let sums = self.sums.of_unit(self.order, unit, self.fluid.width());
        // SAFETY: `make_room` has sized all arrays for this order; the caller promises that they are
        // filled where the pass reads them, and the accumulators are those of this plane and the next.
        *tally = unsafe {
            P::first(&self.passes, First { data: &self.data, plane, columns, sums, buffers, in_range, rim })
        };
    }

    /// Evaluates ψ and its slopes of a unit; those of the first plane also for its copy after the last.
    ///
    /// # Safety
    /// The unit is filled, and the first pass is done over all units that reach it; no other thread accesses the
    /// sums and slopes of its particles meanwhile.
    unsafe fn excess(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>, unit: &Unit) {
        let Some(excess) = &input.excess else { return };
        // SAFETY: the caller promises that no other thread accesses the sums of the unit's particles.
        unsafe { self.sums.join_densities(self.fluid.set, self.order, unit) };
        let width = self.fluid.width();
        let of_unit = self.order.particles_of_unit(unit);
        for first in of_unit.clone().step_by(DENSITY_BLOCK) {
            let particles = first..of_unit.end.min(first + DENSITY_BLOCK);
            let (own, count) = (first - slab.first, particles.len());
            let has_species = !self.particles.species.is_empty();
            // SAFETY: the particles are of this thread's slab, and filled: no thread writes their
            // species, and the caller promises that no other thread accesses their sums and slopes.
            let (species, slopes, added) = unsafe {
                let species = if has_species { particles.clone() } else { 0..0 };
                let added = self.sums.of_particles(self.order, unit, particles.clone());
                (self.particles.species.slice(species), self.slopes.rows_mut(particles.clone()), added)
            };
            let block = DensityBlock {
                first,
                added,
                species,
                densities: &mut slab.densities[width * own..][..width * count],
                excess: &mut slab.excess[own..][..count],
                slopes: &mut *slopes,
            };
            if let Err(fault) = block.evaluate(self.fluid, excess, self.order, &mut slab.state.excess) {
                slab.state.fault.get_or_insert(fault);
                return;
            }
            // SAFETY: the caller promises that no other thread accesses the slopes of these particles.
            unsafe { self.slopes.pack(particles, slopes) };
        }
        if unit.plane == 0 && self.order.is_periodic() {
            // SAFETY: the caller promises the same of the copies of these particles, which no other unit has.
            unsafe { self.slopes.copy(of_unit, self.order.particles()) };
        }
    }

    /// Does the second pass of a unit.
    ///
    /// # Safety
    /// Slopes of the plane and of the next are complete, and no thread writes them.
    unsafe fn second(&self, slab: &mut ThreadSlab<P::Scalar>, unit: &Unit) {
        if self.fluid.terms.passes.is_empty() {
            return;
        }
        let (_, in_range, _, tally) = slab.unit(self.kept(slab, unit.plane), self.order, unit);
        let sums = self.sums.of_unit(self.order, unit, self.fluid.width());
        // SAFETY: the first pass of this unit has stored the pairs; the caller promises that slopes
        // are complete; the accumulators are those of this plane and the next.
        unsafe {
            let virial = &mut tally.virial;
            P::second(&self.passes, Second { data: &self.data, sums, in_range, is_rim: false, virial })
        };
    }

    /// Writes the forces of a unit to the host.
    ///
    /// # Safety
    /// All passes over units that reach this one are done; no other thread accesses the sums of its particles meanwhile.
    unsafe fn forces(&self, out: ForceSink, slab: &mut ThreadSlab<P::Scalar>, unit: &Unit) {
        let particles = self.order.particles_of_unit(unit);
        // SAFETY: the caller promises that no other thread accesses these sums. An order contains each
        // particle once; only this thread has the unit.
        let lost = unsafe {
            self.sums.join_forces(self.fluid.set, self.order, unit);
            let added = self.sums.of_particles(self.order, unit, particles.clone());
            out.write(self.fluid.set, self.order, particles, added)
        };
        slab.state.planes_written += (unit.block == 0) as u64;
        slab.state.lost = slab.state.lost.into_iter().chain(lost).min();
    }
}
