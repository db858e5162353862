//! The many-body forces of the rim: of the pairs of an owned particle and a ghost, whose slopes the host has to send.

use super::Workspace;
use super::forces::ForceSink;
use super::thread_slab::ThreadSlab;
use crate::engine::error::EngineError;
use psidpd_passes::compiled::{PairPrecision, Second};
use psidpd_passes::pair_batch::accumulators::{Accumulator, PlaneSums};
use psidpd_passes::pair_batch::in_range_pairs::InRangePairs;
use psidpd_threads::Pool;

impl<P: PairPrecision> Workspace<P> {
    /// Adds to the forces on owned particles the many-body forces of their pairs with ghosts, whose slopes are in the
    /// host's order. A particle's sum has the same order for any number of threads.
    ///
    /// # Errors
    /// Fails for a force that is not finite, and names the lowest tag.
    pub fn add_rim(&mut self, pool: &Pool, slopes: &[f64], out: ForceSink) -> Result<(), EngineError> {
        if self.order.grid.layers == 1 || self.fluid.terms.passes.is_empty() {
            return Ok(());
        }
        self.slopes.take_ghosts(pool, &self.order, slopes);
        let units = &self.order.thread_slabs(pool.threads())[..];
        self.on_slabs(units, |scheduler, slabs| {
            pool.each(slabs, |slab: &mut ThreadSlab<P::Scalar>| {
                let mut forces = Vec::new();
                for number in slab.units.clone() {
                    // SAFETY: the first pass has listed the rim, slopes are complete, and nothing else runs.
                    let lost =
                        unsafe { scheduler.rim(out, slab, &scheduler.order.unit(number), &mut forces) };
                    slab.state.lost = slab.state.lost.into_iter().chain(lost).min();
                }
            });
        });
        match self.threads.iter_mut().filter_map(|state| state.lost.take()).min() {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }
}

impl<P: PairPrecision> super::Scheduler<'_, P> {
    /// Adds the many-body forces of a unit's rim; returns the lowest tag whose force is not finite.
    ///
    /// # Safety
    /// The first pass over the unit is done, slopes are complete, and no thread writes them; no other thread has the unit.
    unsafe fn rim(
        &self,
        out: ForceSink,
        slab: &mut ThreadSlab<P::Scalar>,
        unit: &super::units::Unit,
        forces: &mut Vec<Accumulator>,
    ) -> Option<i32> {
        let (rim, tally) = slab.rim(self.order, unit);
        let batches = batches_of(rim);
        let particles = self.order.particles_of_unit(unit);
        if forces.len() < particles.len() {
            forces.resize(particles.len(), Accumulator::default());
        }
        for [first, members] in &batches {
            forces[first - particles.start..][..*members].iter_mut().for_each(|force| force.0 = [0.0; 4]);
        }
        let sums =
            PlaneSums::new(particles.start, forces.as_mut_ptr(), std::ptr::null_mut(), self.fluid.width());
        let virial = &mut tally.virial;
        // SAFETY: the first particles of the pairs are of the unit; the caller promises the rest.
        unsafe {
            P::second(&self.passes, Second { data: &self.data, sums, in_range: rim, is_rim: true, virial })
        };
        let mut lost = None;
        for [first, members] in batches {
            for place in first..first + members {
                let [x, y, z, _] = forces[place - particles.start].0;
                // SAFETY: the particle is of this unit, which only this thread has.
                let lost_here = unsafe { out.add(self.order.order[place] as usize, [x, y, z]) };
                lost = lost.into_iter().chain(lost_here).min();
            }
        }
        lost
    }
}

/// The first particle of each batch, and the number of its particles.
fn batches_of<T>(rim: &InRangePairs<T>) -> Vec<[usize; 2]> {
    let of_lists = rim.batches.iter().map(|batch| batch.map(|n| n as usize));
    let of_cache =
        rim.full_cache.batches.iter().map(|batch| [batch.first, batch.members].map(|n| n as usize));
    of_lists.chain(of_cache).collect()
}
