//! The scheduler runs the passes plane by plane, so that the results of one pass are still in the cache when the
//! next pass reads them: all passes run together, and only a few planes are in memory at once. With ghosts the
//! second pass takes their slopes as zero; `rim` adds the rest when the host has sent them.
//!
//! Each thread has a slab of planes. Dependencies between planes:
//!
//! - ψ of a plane needs the first pass over that plane and over the previous one;
//! - the second pass over a plane needs ψ of that plane and of the next one;
//! - forces of a plane need both passes over that plane and over the previous one.
//!
//! Arrays in the order of cells are filled one plane ahead. The planes at the ends of slabs are
//! finished after all threads have done their interiors.
//!
//! Access of threads: a [`ThreadSlab`] and its [`SlabSums`] belong to one thread. Two arrays are
//! shared. Packed particles are written by the thread of their slab, one plane ahead of its first pass.
//! The thread of the previous slab reads those of the slab's first plane and one vector more: they are
//! filled before any pass begins. Slopes are written by the thread of their slab. The thread of the
//! previous slab reads those of the first plane, in a separate round after all slopes are written.

use super::accumulators::{SlabSums, Sums};
use super::cell_order::CellOrder;
use super::excess::{DENSITY_BLOCK, DensityBlock, ExcessInput};
use super::fluid::FluidConstants;
use super::forces::ForceSink;
use super::input::{Input, VECTOR_PADDING};
use super::slopes::SharedSlopes;
use super::sorted_particles::SharedParticles;
use super::thread_slab::ThreadSlab;
use crate::engine::sweep::times::lap;
use psidpd_passes::compiled::{First, PairPrecision, Passes, Second};
use psidpd_passes::pair_batch::accumulators::{Accumulator, PlaneSums};
use psidpd_passes::plane::data::PassData;
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
}

/// Input of the passes up to ψ.
pub struct PassInput<'a> {
    pub input: &'a Input<'a>,
    /// The input of ψ; `None` if ψ is zero.
    pub excess: Option<ExcessInput<'a>>,
    /// The place for forces.
    pub out: ForceSink<'a>,
}

/// The planes of each of `threads` threads, divided so that all slabs have about the same number of pairs.
pub fn thread_slabs(order: &CellOrder, threads: usize) -> Vec<Range<usize>> {
    let planes = order.grid.planes;
    let mean = order.particles() as f64 / planes as f64;
    // A particle has a cost even without neighbours.
    let cost = |l: usize| order.plane(l).1 as f64 * (order.plane(l).1 as f64 + 0.5 * mean);
    let all: f64 = (0..planes).map(cost).sum();
    let mut before = 0.0;
    let of_plane = (0..planes).map(|l| {
        let middle = before + 0.5 * cost(l);
        before += cost(l);
        if all > 0.0 { ((middle / all * threads as f64) as usize).min(threads - 1) } else { 0 }
    });
    let of_plane: Vec<usize> = of_plane.collect();
    let slab = |t: usize| {
        let first = of_plane.iter().position(|of| *of >= t).unwrap_or(planes);
        first..of_plane.iter().position(|of| *of > t).unwrap_or(planes)
    };
    (0..threads).map(slab).collect()
}

/// The start of a plane, or the end of all, rounded down to a whole vector.
fn vectors_before(order: &CellOrder, plane: usize) -> usize {
    order.plane_start(plane) / VECTOR_PADDING * VECTOR_PADDING
}

/// The particles that the thread of a slab must have filled before it does its first `planes` planes:
/// all vectors that begin in these planes, the vector across the start of the slab, and four more,
/// because the distance filter reads sixteen candidates at once and up to two such groups begin after
/// the last particle. If everything fits into the cache, these are all particles of the slab.
fn needed(order: &CellOrder, slab: &Range<usize>, planes: usize) -> Range<usize> {
    let (start, end) = (vectors_before(order, slab.start), vectors_before(order, slab.end));
    if !order.exceeds_cache() {
        return start..end;
    }
    let behind = (slab.start + planes).min(slab.end);
    start..(vectors_before(order, behind) + 4 * VECTOR_PADDING).min(end)
}

impl<P: PairPrecision> Scheduler<'_, P> {
    /// Fills the particles of a thread slab that the previous slab reads; the first slab also fills the
    /// last particles, which are no whole vector.
    pub fn fill_start(
        particles: &SharedParticles<P::PackedParticle>,
        fluid: &FluidConstants<P::Scalar>,
        order: &CellOrder,
        input: &Input,
        slab: &mut ThreadSlab<P::Scalar>,
        is_first: bool,
    ) {
        let mut since = Instant::now();
        // SAFETY: different slabs have disjoint particles, and each slab has one thread. The particles after
        // the last whole vector are in no slab; one thread fills them. No pass reads any before this is done.
        unsafe {
            if is_first {
                let rest = vectors_before(order, order.grid.planes)..order.particles();
                particles.fill(fluid.set, order, input, rest);
            }
            particles.fill(fluid.set, order, input, needed(order, &slab.planes, 1));
        }
        lap(&mut since, &mut slab.state.times.sort);
    }

    /// Fills the arrays of a thread slab, and does the first pass over all its planes, ψ of all but
    /// the first, the second pass over the planes between the first and the last, and the forces of
    /// those that are complete.
    ///
    /// # Safety
    /// The starts of all slabs are filled, and the copies of the first plane exist. Other threads run
    /// the same function for other slabs, and nothing else.
    pub unsafe fn interior(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>, sums: &mut SlabSums) {
        (slab.state.fault, slab.state.lost) = (None, None);
        let mut since = Instant::now();
        let planes = slab.planes.clone();
        let mut filled = needed(self.order, &planes, 1).end;
        for plane in planes.clone() {
            let end = needed(self.order, &planes, plane - planes.start + 2).end;
            // SAFETY: the range contains particles of this slab after those filled at the
            // start: no other thread accesses them.
            unsafe { self.particles.fill(self.fluid.set, self.order, input.input, filled..end) };
            filled = end;
            lap(&mut since, &mut slab.state.times.sort);
            // SAFETY: this plane, the next and the vectors after them are filled; if the next plane is
            // of another slab, or a copy, it was filled by `fill_start`.
            unsafe { self.first(slab, sums, plane) };
            lap(&mut since, &mut slab.state.times.first);
            if plane > planes.start {
                // SAFETY: only this thread's second pass reads slopes of a plane that is not the first of its slab.
                unsafe { self.excess(input, slab, sums.sums(), plane) };
                lap(&mut since, &mut slab.state.times.excess);
            }
            if plane > planes.start + 1 {
                // SAFETY: `excess` has evaluated ψ of `plane - 1` and `plane`, both of this slab.
                unsafe { self.second(slab, sums, plane - 1) };
                lap(&mut since, &mut slab.state.times.second);
            }
            if plane > planes.start + 2 {
                self.forces(input.out, slab, sums.sums(), plane - 1);
                lap(&mut since, &mut slab.state.times.forces);
            }
        }
    }

    /// Evaluates ψ of the first plane of a thread slab, to which the last plane of another slab contributes.
    ///
    /// # Safety
    /// The interior of all slabs is done. Other threads run the same function for other slabs, and nothing else.
    pub unsafe fn excess_of_first(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>, sums: Sums) {
        let mut since = Instant::now();
        if !slab.planes.is_empty() {
            // SAFETY: the caller promises that no second pass runs.
            unsafe { self.excess(input, slab, sums, slab.planes.start) };
        }
        lap(&mut since, &mut slab.state.times.excess);
    }

    /// Does the second pass of the first and of the last plane of a thread slab, and the forces
    /// of the second and of the last.
    ///
    /// # Safety
    /// All slopes are complete, including those of the copies, and no thread writes any.
    pub unsafe fn second_at_ends(
        &self,
        out: ForceSink,
        slab: &mut ThreadSlab<P::Scalar>,
        sums: &mut SlabSums,
    ) {
        let mut since = Instant::now();
        let planes = slab.planes.clone();
        if !planes.is_empty() {
            // SAFETY: the caller promises that all slopes are complete.
            unsafe { self.second(slab, sums, planes.start) };
            if planes.len() > 1 {
                // SAFETY: the caller promises that all slopes are complete.
                unsafe { self.second(slab, sums, planes.end - 1) };
            }
        }
        lap(&mut since, &mut slab.state.times.second);
        if planes.len() > 1 {
            self.forces(out, slab, sums.sums(), planes.start + 1);
        }
        if planes.len() > 2 {
            self.forces(out, slab, sums.sums(), planes.end - 1);
        }
        lap(&mut since, &mut slab.state.times.forces);
    }

    /// Writes the forces of the first plane of a thread slab, to which the last plane of another slab contributes.
    pub fn forces_of_first(&self, out: ForceSink, slab: &mut ThreadSlab<P::Scalar>, sums: Sums) {
        let mut since = Instant::now();
        if !slab.planes.is_empty() {
            self.forces(out, slab, sums, slab.planes.start);
        }
        lap(&mut since, &mut slab.state.times.forces);
    }

    /// Does the first pass of a plane.
    ///
    /// # Safety
    /// The plane, the next one and the vectors after them are filled; no thread writes there meanwhile.
    unsafe fn first(&self, slab: &mut ThreadSlab<P::Scalar>, sums: &mut SlabSums, plane: usize) {
        let (buffers, in_range, _, tally) = slab.plane(plane);
        let [forces, densities] = sums.of_plane(self.order, plane);
        forces.fill(Accumulator::default());
        densities.fill(Accumulator::default());
        let sums = PlaneSums::new(self.order.plane_start(plane), forces, densities, self.fluid.width());
        // SAFETY: `make_room` has sized all arrays for this order; the caller promises that they are
        // filled where the pass reads them, and the accumulators are those of this plane and the next.
        *tally =
            unsafe { P::first(&self.passes, First { data: &self.data, plane, sums, buffers, in_range }) };
    }

    /// Evaluates ψ and its slopes of a plane.
    ///
    /// # Safety
    /// The plane is filled; no other thread reads its slopes meanwhile.
    unsafe fn excess(&self, input: &PassInput, slab: &mut ThreadSlab<P::Scalar>, sums: Sums, plane: usize) {
        let Some(excess) = &input.excess else { return };
        let width = self.fluid.width();
        let of_plane = self.order.particles_of(&(plane..plane + 1));
        for first in of_plane.clone().step_by(DENSITY_BLOCK) {
            let particles = first..of_plane.end.min(first + DENSITY_BLOCK);
            let (own, count) = (first - slab.first, particles.len());
            let has_species = !self.particles.species.is_empty();
            // SAFETY: the particles are of a plane of this thread's slab, which is filled: no thread
            // writes their species, and the caller promises that no other thread accesses their slopes.
            let (species, slopes) = unsafe {
                let species = if has_species { particles.clone() } else { 0..0 };
                (self.particles.species.slice(species), self.slopes.rows_mut(particles.clone()))
            };
            if !self.particles.ghosts.is_empty() {
                // ψ of ghosts is not evaluated: their slopes stay zero.
                slopes.fill(0.0);
            }
            let block = DensityBlock {
                first,
                added: sums.of_particles(self.order, plane, particles.clone()),
                species,
                ghost: self.particles.ghosts.flags.get(particles.clone()).unwrap_or_default(),
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
    }

    /// Does the second pass of a plane, and lists its rim.
    ///
    /// # Safety
    /// Slopes of the plane and of the next are complete, and no thread writes them.
    unsafe fn second(&self, slab: &mut ThreadSlab<P::Scalar>, sums: &mut SlabSums, plane: usize) {
        if self.fluid.terms.passes.is_empty() {
            return;
        }
        let (_, in_range, rim, tally) = slab.plane(plane);
        rim.clear(self.order.plane_start(plane + 1));
        let columns = self.order.grid.columns_per_plane;
        let mut of_both =
            self.particles.ghosts.owned_of_column.iter().skip(plane * columns).take(2 * columns);
        let near_rim = of_both.any(|column| column.with_ghosts);
        let [forces, densities] = sums.of_plane(self.order, plane);
        let sums = PlaneSums::new(self.order.plane_start(plane), forces, densities, self.fluid.width());
        // SAFETY: the first pass of this plane has stored the pairs; the caller promises that slopes
        // are complete; the accumulators are those of this plane and the next.
        unsafe {
            let virial = &mut tally.virial;
            P::second(&self.passes, Second { data: &self.data, sums, in_range, rim, near_rim, virial })
        };
    }

    /// Writes the forces of a plane to the host; all passes that add to them are done.
    fn forces(&self, out: ForceSink, slab: &mut ThreadSlab<P::Scalar>, sums: Sums, plane: usize) {
        assert!(slab.planes.contains(&plane), "a plane of the slab");
        let particles = self.order.particles_of(&(plane..plane + 1));
        let added = sums.of_particles(self.order, plane, particles.clone());
        // SAFETY: an order contains each particle once; only this thread has the plane.
        let lost = unsafe { out.write(self.fluid.set, self.order, particles, added) };
        slab.state.planes_written += 1;
        slab.state.lost = slab.state.lost.into_iter().chain(lost).min();
    }
}
