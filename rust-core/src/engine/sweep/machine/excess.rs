//! Densities of the particles, and ψ at them.

use super::{Machine, Shared};
use crate::engine::error::EngineError;
use crate::engine::excess::ExcessPlan;
use crate::engine::excess_pass::{ExcessPass, LANES, Rows};
use crate::engine::plan::Plan;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::pool::Pool;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Particles whose densities are gathered at a time: they stay in the first-level cache until ψ is evaluated, and
/// make several blocks of lanes where not all take part.
const BLOCK: usize = 2 * LANES;

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
                for from in (first..first + count).step_by(BLOCK) {
                    let count = BLOCK.min(first + count - from);
                    // SAFETY: as above.
                    let (excess, slopes, densities) = unsafe {
                        (
                            std::slice::from_raw_parts_mut(excess.at(from), count),
                            std::slice::from_raw_parts_mut(slopes.at(width * from), width * count),
                            std::slice::from_raw_parts_mut(rows.at(width * from), width * count),
                        )
                    };
                    this.gather_densities(layer, from, &own, densities);
                    let mut rows = Rows { first: from, columns: &this.columns, densities, excess, slopes };
                    if let Err(fault) = this.evaluate(plan, &mut scratch.excess, tag, &mut rows) {
                        scratch.fault = Some(fault);
                        return;
                    }
                }
            }
        });
        self.first_fault()?;
        self.slopes.copy_within(..width * copies, width * n);
        Ok(())
    }

    /// What a particle itself adds to the densities of the passes: `w(0)`, or nothing.
    fn own_weights(&self, plan: &Plan) -> Vec<f64> {
        let densities = plan.passes.iter().map(|d| &plan.densities[*d]);
        densities.map(|d| if d.includes_self { d.kernel.value(0.0) } else { 0.0 }).collect()
    }

    /// ψ of the particles of `rows`, by what tells them apart.
    fn evaluate(
        &self,
        plan: &Plan,
        pass: &mut ExcessPass,
        tag: &[i32],
        rows: &mut Rows,
    ) -> Result<(), EngineError> {
        let tag = |s: usize| tag[self.order[s] as usize];
        let (species, ghost) = (&self.species[..], &self.ghost[..]);
        match (species.is_empty(), ghost.is_empty()) {
            (true, true) => pass.run(plan, None::<fn(usize) -> i32>, tag, rows),
            (true, false) => pass.run(plan, Some(|s: usize| -(ghost[s] as i32)), tag, rows),
            (false, true) => pass.run(plan, Some(|s: usize| species[s] as i32), tag, rows),
            (false, false) => {
                let species = |s: usize| if ghost[s] { -1 } else { species[s] as i32 };
                pass.run(plan, Some(species), tag, rows)
            }
        }
    }

    /// Densities of particles of a layer from number `from`, as many as there is room for.
    fn gather_densities(&self, layer: usize, from: usize, own: &[f64], out: &mut [f64]) {
        let width = self.width();
        let (here, before) = self.accumulators(layer);
        let place = |accumulators: isize| (from as isize + accumulators) as usize;
        if let (1, &[own]) = (width, own) {
            let sums = |accumulators| self.sums[place(accumulators)..].iter();
            let pairs = out.iter_mut().zip(sums(here));
            match before {
                None => pairs.for_each(|(n, here)| *n = here.0[3] + own),
                Some(before) => {
                    pairs.zip(sums(before)).for_each(|((n, here), before)| *n = here.0[3] + before.0[3] + own)
                }
            }
            return;
        }
        if width == 0 {
            return;
        }
        let sums = |accumulators| &self.densities[width * place(accumulators)..][..out.len()];
        match before.map(sums) {
            None => out.copy_from_slice(sums(here)),
            Some(before) => {
                let pairs = sums(here).iter().zip(before);
                out.iter_mut().zip(pairs).for_each(|(n, (here, before))| *n = here + before);
            }
        }
        let count = width / own.len();
        for (k, row) in out.chunks_exact_mut(width).enumerate() {
            let species = self.species.get(from + k).map_or(0, |s| *s as usize);
            for (pass, own) in own.iter().enumerate() {
                row[pass * count + species] += own;
            }
        }
    }
}
