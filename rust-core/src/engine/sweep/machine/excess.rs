//! Densities of the particles, and ψ at them.

use super::{Arrays, Machine};
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
        let Some(own) = self.prepare_excess(plan) else { return Ok(()) };
        let arrays = self.arrays();
        let next = AtomicUsize::new(0);
        let this = &*self;
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch.
            let scratch = unsafe { &mut *arrays.scratch.at(t) };
            scratch.fault = None;
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= this.grid.layers {
                    return;
                }
                // SAFETY: each layer is done once, and writes its own.
                let done =
                    unsafe { this.excess_of_layer(arrays, layer, plan, &own, tag, &mut scratch.excess) };
                if let Err(fault) = done {
                    scratch.fault = Some(fault);
                    return;
                }
            }
        });
        self.first_fault()?;
        self.copy_slopes();
        Ok(())
    }

    /// Room for ψ and its slopes; what particles add to their own densities, unless ψ is zero whatever they are.
    pub(super) fn prepare_excess(&mut self, plan: &Plan) -> Option<Vec<f64>> {
        let (width, n) = (self.width(), self.particles);
        let copies = if self.is_ring() { self.layer(0).1 } else { 0 };
        self.excess.resize(n, 0.0);
        self.rows.resize(width * n, 0.0);
        self.slopes.resize(width * (n + copies), 0.0);
        if plan.excess.iter().all(|e| matches!(e, ExcessPlan::Constant(0.0))) {
            self.excess.fill(0.0);
            return None;
        }
        Some(self.own_weights(plan))
    }

    /// Slopes of the copies of the first layer.
    pub(super) fn copy_slopes(&mut self) {
        if self.is_ring() {
            let (width, n, copies) = (self.width(), self.particles, self.layer(0).1);
            self.slopes.copy_within(..width * copies, width * n);
        }
    }

    /// ψ and its slopes of one layer.
    ///
    /// # Safety
    /// No other thread does the same layer, and none writes the weights of its particles.
    pub(super) unsafe fn excess_of_layer(
        &self,
        arrays: Arrays<P>,
        layer: usize,
        plan: &Plan,
        own: &[f64],
        tag: &[i32],
        pass: &mut ExcessPass,
    ) -> Result<(), EngineError> {
        let width = self.width();
        let (first, count) = self.layer(layer);
        for from in (first..first + count).step_by(BLOCK) {
            let count = BLOCK.min(first + count - from);
            // SAFETY: the layer's own.
            let (excess, slopes, densities) = unsafe {
                (
                    std::slice::from_raw_parts_mut(arrays.excess.at(from), count),
                    std::slice::from_raw_parts_mut(arrays.slopes.at(width * from), width * count),
                    std::slice::from_raw_parts_mut(arrays.rows.at(width * from), width * count),
                )
            };
            // SAFETY: the caller's.
            unsafe { self.gather_densities(arrays, layer, from, own, densities) };
            let mut rows = Rows { first: from, columns: &self.columns, densities, excess, slopes };
            self.evaluate(plan, pass, tag, &mut rows)?;
        }
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
    ///
    /// # Safety
    /// No other thread writes their weights.
    unsafe fn gather_densities(
        &self,
        arrays: Arrays<P>,
        layer: usize,
        from: usize,
        own: &[f64],
        out: &mut [f64],
    ) {
        let width = self.width();
        let (here, before) = self.accumulators(layer);
        let place = |accumulators: isize| (from as isize + accumulators) as usize;
        if let (1, &[own]) = (width, own) {
            let count = out.len();
            // SAFETY: accumulators of particles of the layer.
            let sums = |accumulators| unsafe {
                std::slice::from_raw_parts(arrays.sums.at(place(accumulators)), count)
            };
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
        let count = out.len();
        let quads = width.div_ceil(4);
        // SAFETY: accumulators of particles of the layer.
        let sums = |accumulators| unsafe {
            let sums = arrays.densities.at(quads * place(accumulators));
            std::slice::from_raw_parts(sums.cast::<f64>(), 4 * quads * (count / width))
        };
        if width == 4 * quads {
            take(out, sums(here), before.map(sums));
        } else {
            // What fills rows of four is left out.
            for (k, row) in out.chunks_exact_mut(width).enumerate() {
                let from = 4 * quads * k;
                let columns = |accumulators| &sums(accumulators)[from..from + width];
                take(row, columns(here), before.map(columns));
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

/// Densities from the sums of a layer, and of the layer before.
#[inline(always)]
fn take(out: &mut [f64], here: &[f64], before: Option<&[f64]>) {
    match before {
        None => out.copy_from_slice(here),
        Some(before) => {
            out.iter_mut().zip(here.iter().zip(before)).for_each(|(n, (here, before))| *n = here + before)
        }
    }
}
