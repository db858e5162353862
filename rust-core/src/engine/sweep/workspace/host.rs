//! Exchange of data with the host, in the order of the host.

use super::Workspace;
use crate::engine::counts::PassCounts;
use psidpd_passes::compiled::PairPrecision;
use psidpd_passes::tally::Tally;
use psidpd_threads::{Pool, SharedSlice, part};

impl<P: PairPrecision> Workspace<P> {
    /// Copies the slopes of owned particles to the order of the host; entries of ghosts are unspecified.
    pub fn slopes_to_host(&self, pool: &Pool, out: &mut Vec<f64>) {
        let (width, slopes, order) = (self.fluid.width(), &self.slopes.rows[..], &self.order);
        out.resize(width * order.all, 0.0);
        if width == 0 {
            return;
        }
        let out = SharedSlice::new(out);
        pool.run(&|t| {
            for plane in part(order.grid.planes, t, pool.threads()) {
                // Ghosts follow the owned particles of their plane.
                let owned = order.plane_start(plane)..order.ghosts_of(plane).start;
                let rows = &slopes[width * owned.start..width * owned.end];
                for (row, k) in order.order[owned].iter().enumerate() {
                    let k = *k as usize;
                    // SAFETY: each particle occurs once in the order, and so in the part of one thread; owned particles
                    // have rows in `out`.
                    unsafe {
                        if width == 1 {
                            // One slope is by far the most common case, and needs no inner loop.
                            *out.at(k) = rows[row];
                        } else {
                            out.slice_mut(width * k..width * (k + 1))
                                .copy_from_slice(&rows[width * row..][..width]);
                        }
                    }
                }
            }
        });
    }

    /// Energies and virials of the last evaluation, summed in the order of planes.
    pub fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        for plane in &self.results.tallies {
            tally += *plane;
        }
        if self.totals {
            for (k, excess) in self.order.order.iter().zip(&self.results.excess) {
                if (*k as usize) < self.order.owned {
                    tally.excess += excess;
                }
            }
        }
        tally
    }

    /// Copies ψ of owned particles and their densities, `variables` each, in the host's order.
    pub fn to_host(&self, variables: usize, excess: &mut Vec<f64>, densities: &mut Vec<f64>) {
        let (width, owned) = (self.fluid.width(), self.order.owned);
        excess.clear();
        excess.resize(owned, 0.0);
        densities.clear();
        densities.resize(variables * owned, 0.0);
        for (s, k) in self.order.order.iter().enumerate() {
            let k = *k as usize;
            if k < owned {
                excess[k] = self.results.excess[s];
                for (c, v) in self.fluid.variables.iter().enumerate() {
                    densities[variables * k + v] = self.results.densities[width * s + c];
                }
            }
        }
    }

    /// Numbers of evaluations below and above the bounds of a density.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let mut sum = [0; 2];
        for state in &self.threads {
            for k in 0..2 {
                sum[k] += state.excess.out_of_bounds[k];
            }
        }
        sum
    }

    /// The sum of the counts of all threads.
    pub fn counts(&self) -> PassCounts {
        let mut sum = PassCounts::default();
        for state in &self.threads {
            let batches = &state.buffers.batch.counts;
            sum = sum
                + PassCounts {
                    search: batches.searched,
                    density: batches.weighted,
                    excess: state.excess.evaluations,
                    force: state.planes_written,
                    noise: batches.noise,
                    energy: batches.tallied,
                    virial: batches.tallied,
                };
        }
        sum
    }

    /// Size in bytes of the arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        self.order.bytes()
            + self.particles.bytes()
            + self.excluded.bytes()
            + self.accumulators.bytes()
            + self.results.bytes()
            + self.slopes.bytes()
    }
}
