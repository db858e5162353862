//! What goes to the host and comes from it, in its own order.

use super::{Machine, Shared};
use crate::engine::error::EngineError;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::pool::Pool;
use crate::engine::tally::Tally;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

impl<P: Compiled> Machine<P> {
    /// Slopes from the order of cells to the host's, those of particles it owns.
    pub fn slopes_to_host(&self, out: &mut Vec<f64>) {
        let width = self.width();
        out.clear();
        out.resize(width * self.all, 0.0);
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                out[width * k..][..width].copy_from_slice(&self.slopes[width * s..][..width]);
            }
        }
    }

    /// Slopes of ghosts from the host.
    pub fn slopes_from_host(&mut self, slopes: &[f64]) {
        let width = self.width();
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k >= self.owned {
                self.slopes[width * s..][..width].copy_from_slice(&slopes[width * k..][..width]);
            }
        }
    }

    /// Writes the forces on owned particles, or adds them to what is there.
    pub fn forces(
        &mut self,
        pool: &Pool,
        force: &mut [[f64; 3]],
        add: bool,
        tag: &[i32],
    ) -> Result<(), EngineError> {
        let out = Shared(force.as_mut_ptr());
        let next = AtomicUsize::new(0);
        let lost: Mutex<Option<i32>> = Mutex::new(None);
        let this = &*self;
        pool.run(&|_| {
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= this.grid.layers {
                    return;
                }
                let (first, count) = this.layer(layer);
                let (here, before) = this.accumulators(layer);
                for s in first..first + count {
                    let k = this.order[s] as usize;
                    if k >= this.owned {
                        continue;
                    }
                    let [x, y, z, _] = this.sums[(s as isize + here) as usize].0;
                    let mut f = [x, y, z];
                    if let Some(before) = before {
                        let sum = this.sums[(s as isize + before) as usize].0;
                        for c in 0..3 {
                            f[c] += sum[c];
                        }
                    }
                    if !(f[0] + f[1] + f[2]).is_finite() {
                        let mut lost = lost.lock().unwrap_or_else(|e| e.into_inner());
                        *lost = Some(lost.map_or(tag[k], |t| t.min(tag[k])));
                    }
                    // SAFETY: `k` is an owned particle, and no other thread's.
                    unsafe {
                        let out = &mut *out.at(k);
                        if add {
                            for c in 0..3 {
                                f[c] += out[c];
                            }
                        }
                        *out = f;
                    }
                }
            }
        });
        match lost.into_inner().unwrap_or_else(|e| e.into_inner()) {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }

    /// Energies and virials of the last evaluation, summed in the order of layers.
    pub fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        for layer in &self.tallies {
            tally += *layer;
        }
        if self.totals {
            for (s, excess) in self.excess.iter().enumerate() {
                if self.ghost.get(s).is_none_or(|g| !*g) {
                    tally.excess += excess;
                }
            }
        }
        tally
    }

    /// ψ of owned particles and their densities, `variables` each, in the host's order.
    pub fn to_host(&self, variables: usize, excess: &mut Vec<f64>, densities: &mut Vec<f64>) {
        let width = self.width();
        excess.clear();
        excess.resize(self.owned, 0.0);
        densities.clear();
        densities.resize(variables * self.owned, 0.0);
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                excess[k] = self.excess[s];
                for (c, v) in self.columns.iter().enumerate() {
                    densities[variables * k + v] = self.rows[width * s + c];
                }
            }
        }
    }

    pub fn out_of_bounds(&self) -> [u64; 2] {
        let mut sum = [0; 2];
        for scratch in &self.scratch {
            for k in 0..2 {
                sum[k] += scratch.excess.out_of_bounds[k];
            }
        }
        sum
    }

    /// Bytes held in arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        fn bytes<T>(array: &Vec<T>) -> usize {
            array.capacity() * size_of::<T>()
        }
        let near: usize = self.near.iter().map(|n| n.bytes()).sum();
        near + bytes(&self.cell)
            + bytes(&self.unit)
            + bytes(&self.counts)
            + bytes(&self.start)
            + bytes(&self.order)
            + self.x.iter().map(bytes).sum::<usize>()
            + self.q.iter().map(bytes).sum::<usize>()
            + bytes(&self.records)
            + bytes(&self.species)
            + bytes(&self.ghost)
            + bytes(&self.owned_bits)
            + bytes(&self.sums)
            + bytes(&self.densities)
            + bytes(&self.rows)
            + bytes(&self.excess)
            + bytes(&self.slopes)
    }
}
