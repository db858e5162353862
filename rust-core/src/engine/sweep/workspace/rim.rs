//! The forces of the rim, which lack the slopes of ghosts until the host has sent these.

use super::Workspace;
use super::forces::ForceSink;
use crate::engine::error::EngineError;
use psidpd_passes::compiled::PairPrecision;
use psidpd_threads::{Pool, part, take};
use std::ops::Range;

/// Half of the virial of a pair with a ghost counts here; the rank of the ghost counts the other half.
const PAIR_WEIGHT: f64 = 0.5;

impl<P: PairPrecision> Workspace<P> {
    /// Adds to the forces on owned particles what the slopes of ghosts, in the host's order, contribute.
    /// A particle's sum has the same order for any number of threads.
    ///
    /// # Errors
    /// Fails for a force that is not finite, and names the lowest tag.
    pub fn add_rim(&mut self, pool: &Pool, slopes: &[f64], out: ForceSink) -> Result<(), EngineError> {
        let (order, width, totals) = (&self.order, self.fluid.width(), self.totals);
        let (rims, mut tallies) = (&self.results.rims[..], &mut self.results.tallies[..]);
        let (blocks, threads) = (order.units_per_plane(), pool.threads());
        let slab = |planes: Range<usize>| (take(&mut tallies, blocks * planes.len()), planes, None::<i32>);
        let mut slabs: Vec<_> = (0..threads).map(|t| part(order.grid.planes, t, threads)).map(slab).collect();
        let host = |k: u32| {
            // Copies follow the last particle.
            let k = k as usize;
            let copied = if k < order.particles() { k } else { k - order.particles() };
            order.order[copied] as usize
        };
        pool.each(&mut slabs, |(tallies, planes, lost)| {
            for (plane, tally) in planes.clone().zip(tallies.iter_mut().step_by(blocks)) {
                let before = if plane > 0 { plane - 1 } else { order.grid.planes - 1 };
                let of_plane =
                    |plane: usize, list| rims[blocks * plane..][..blocks].iter().map(move |rim| (rim, list));
                for (rim, list) in of_plane(before, 1).chain(of_plane(plane, 0)) {
                    for (k, pair) in rim.pairs[list].iter().enumerate() {
                        let slope = slopes[width * host(pair.ghost) + pair.slope as usize];
                        // SAFETY: the owned particle is of this plane, which only this thread has.
                        let lost_here = unsafe { out.add(host(pair.owned), pair.force(slope)) };
                        if lost_here.is_some() {
                            *lost = (*lost).into_iter().chain(lost_here).min();
                        }
                        if totals {
                            let virial = pair.virial(slope, &rim.separations[list][k]);
                            for (sum, w) in tally.virial.iter_mut().zip(virial) {
                                *sum += PAIR_WEIGHT * w;
                            }
                        }
                    }
                }
            }
        });
        match slabs.into_iter().filter_map(|(_, _, lost)| lost).min() {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }
}
