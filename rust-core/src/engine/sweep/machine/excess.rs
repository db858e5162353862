//! Densities of the particles, and ψ at them.

use super::{Machine, Shared};
use crate::engine::error::EngineError;
use crate::engine::excess::ExcessPlan;
use crate::engine::excess_pass::Rows;
use crate::engine::plan::Plan;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::pool::Pool;
use std::sync::atomic::{AtomicUsize, Ordering};

impl<P: Compiled> Machine<P> {
    /// ψ and its slopes at the densities of the first pass.
    pub fn excess(&mut self, pool: &Pool, plan: &Plan, tag: &[i32]) -> Result<(), EngineError> {
        let (width, n) = (self.width(), self.particles);
        let copies = if self.is_ring() { self.layer(0).1 } else { 0 };
        self.excess.resize(n, 0.0);
        self.rows.resize(width * n, 0.0);
        self.slopes.resize(width * (n + copies), 0.0);
        if plan.excess.iter().all(|e| matches!(e, ExcessPlan::Constant(0.0))) {
            self.excess.fill(0.0);
            return Ok(());
        }
        let own: Vec<f64> = self.own_weights(plan);
        let (excess, slopes, rows, scratch) = (
            Shared(self.excess.as_mut_ptr()),
            Shared(self.slopes.as_mut_ptr()),
            Shared(self.rows.as_mut_ptr()),
            Shared(self.scratch.as_mut_ptr()),
        );
        let next = AtomicUsize::new(0);
        let this = &*self;
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, each layer is done once, and writes its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            scratch.fault = None;
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= this.grid.layers {
                    return;
                }
                let (first, count) = this.layer(layer);
                // SAFETY: as above.
                let (excess, slopes, densities) = unsafe {
                    (
                        std::slice::from_raw_parts_mut(excess.at(first), count),
                        std::slice::from_raw_parts_mut(slopes.at(width * first), width * count),
                        std::slice::from_raw_parts_mut(rows.at(width * first), width * count),
                    )
                };
                this.gather_densities(layer, &own, densities);
                let mut rows = Rows { first, columns: &this.columns, densities, excess, slopes };
                let species = |s: usize| match (this.ghost.get(s), this.species.get(s)) {
                    (Some(true), _) => -1,
                    (_, Some(species)) => *species as i32,
                    _ => 0,
                };
                let tag = |s: usize| tag[this.order[s] as usize];
                if let Err(fault) = scratch.excess.run(plan, first..first + count, species, tag, &mut rows) {
                    scratch.fault = Some(fault);
                    return;
                }
            }
        });
        self.first_fault()?;
        self.slopes.copy_within(..width * copies, width * n);
        Ok(())
    }

    /// `w(0)` by species and column, where a density counts the particle itself.
    fn own_weights(&self, plan: &Plan) -> Vec<f64> {
        let (count, width) = (plan.species.len(), self.width());
        let mut own = vec![0.0; count * width];
        for (k, d) in plan.passes.iter().enumerate() {
            if plan.densities[*d].includes_self {
                for s in 0..count {
                    own[s * width + k * count + s] = plan.densities[*d].kernel.value(0.0);
                }
            }
        }
        own
    }

    /// Densities of the particles of a layer.
    fn gather_densities(&self, layer: usize, own: &[f64], out: &mut [f64]) {
        let (first, count) = self.layer(layer);
        let width = self.width();
        let (here, before) = self.accumulators(layer);
        for k in 0..count {
            let s = (first + k) as isize;
            let species = self.species.get(first + k).map_or(0, |s| *s as usize);
            for c in 0..width {
                let of = |at: isize| match width {
                    1 => self.sums[at as usize].0[3],
                    _ => self.densities[width * at as usize + c],
                };
                let mut n = of(s + here);
                if let Some(before) = before {
                    n += of(s + before);
                }
                out[width * k + c] = n + own[species * width + c];
            }
        }
    }
}
