//! All passes over a box without ghosts in one go, so that what a pass leaves for the next is used while it is still in
//! the cache, and no more of it is kept than of a few layers.
//!
//! Each thread does a slab of layers. ψ of a layer needs the first pass of that layer and of the one before; many-body
//! forces need ψ of the layer and of the one behind; forces are complete after both passes of the layer and of the one
//! before. The arrays in the order of cells are filled one layer ahead. Where slabs meet, layers wait for all threads.

use super::host::Out;
use super::{Arrays, Given, Machine, SLACK};
use crate::engine::error::EngineError;
use crate::engine::plan::Plan;
use crate::engine::sweep::Times;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::lap;
use crate::engine::sweep::layer::{Shared, Swept};
use crate::engine::sweep::many_body::NearPairs;
use crate::engine::sweep::pool::Pool;
use std::ops::Range;
use std::time::Instant;

/// Layers of a slab whose pairs are kept at once: its first, its last, and two between.
const KEPT: usize = 4;

/// What all threads work with.
struct Stream<'a, P: Compiled> {
    machine: &'a Machine<P>,
    swept: Swept<'a, P::Scalar, P::Record>,
    arrays: Arrays<P>,
    plan: &'a Plan,
    given: &'a Given<'a>,
    /// What particles add to their own densities, unless ψ is zero whatever they are.
    own: Option<Vec<f64>>,
    out: Out<'a>,
}

impl<P: Compiled> Machine<P> {
    /// Everything that comes after [`Machine::find_order`]: the first pass, ψ and the second pass over all layers, and
    /// their forces. `times` are those of the caller's thread.
    ///
    /// # Errors
    /// ψ that is not finite, or a force: of the lowest tag.
    pub fn stream(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        given: &Given,
        out: Out,
        times: &mut Times,
    ) -> Result<(), EngineError> {
        let threads = pool.threads();
        self.near.resize_with(KEPT * threads, NearPairs::default);
        let own = self.prepare_excess(plan);
        let slabs: Vec<Range<usize>> = (0..threads).map(|t| self.slab(t, threads)).collect();
        self.lay_out(&slabs);
        let shared_times = Shared(times as *mut Times);
        let timed = |t: usize, work: &dyn Fn(&mut Times)| {
            let mut unseen = Times::default();
            // SAFETY: of one thread alone.
            work(if t == 0 { unsafe { &mut *shared_times.at(0) } } else { &mut unseen });
        };
        let arrays = self.arrays();
        let this = &*self;
        pool.run(&|t| timed(t, &|times| this.fill_first(arrays, given, t, &slabs[t], times)));
        self.copy_first_layer();
        let arrays = self.arrays();
        let stream = Stream { machine: self, swept: self.swept(arrays), arrays, plan, given, own, out };
        pool.run(&|t| timed(t, &|times| stream.within(t, slabs[t].clone(), times)));
        pool.run(&|t| timed(t, &|times| stream.excess_of_first(t, slabs[t].clone(), times)));
        self.first_fault()?;
        self.copy_slopes();
        let arrays = self.arrays();
        let stream = Stream { machine: self, swept: self.swept(arrays), arrays, plan, given, own: None, out };
        pool.run(&|t| timed(t, &|times| stream.second_at_ends(t, slabs[t].clone(), times)));
        pool.run(&|t| timed(t, &|times| stream.forces_of_first(t, slabs[t].clone(), times)));
        self.lost()
    }

    /// The layers of a thread: all slabs have about the same number of pairs.
    fn slab(&self, t: usize, threads: usize) -> Range<usize> {
        let layers = self.grid.layers;
        let mean = self.particles as f64 / layers as f64;
        // A particle costs something even if it is alone.
        let cost = |l: usize| self.layer(l).1 as f64 * (self.layer(l).1 as f64 + 0.5 * mean);
        let all: f64 = (0..layers).map(cost).sum();
        let mut before = 0.0;
        let of_layer = (0..layers).map(|l| {
            let middle = before + 0.5 * cost(l);
            before += cost(l);
            if all > 0.0 { ((middle / all * threads as f64) as usize).min(threads - 1) } else { 0 }
        });
        let of_layer: Vec<usize> = of_layer.collect();
        let first = of_layer.iter().position(|of| *of >= t).unwrap_or(layers);
        let end = of_layer.iter().position(|of| *of > t).unwrap_or(layers);
        first..end
    }

    /// The last place before a layer, or behind all, from which on whole vectors are filled.
    fn vectors_before(&self, layer: usize) -> usize {
        self.start[layer * self.grid.rows * self.grid.bins] as usize / SLACK * SLACK
    }

    /// The places that the thread of a slab fills: all vectors that begin in it, and the one across its beginning.
    fn places(&self, slab: &Range<usize>) -> Range<usize> {
        self.vectors_before(slab.start)..self.vectors_before(slab.end)
    }

    /// Of these the places that the first `layers` of a slab need: neighbours are compared in sixteens, up to two of which
    /// begin behind the last. All, if they stay in the cache.
    fn needed(&self, slab: &Range<usize>, layers: usize) -> Range<usize> {
        let Range { start, end } = self.places(slab);
        if !self.is_far() {
            return start..end;
        }
        let behind = (slab.start + layers).min(slab.end);
        start..(self.vectors_before(behind) + 4 * SLACK).min(end)
    }

    /// Fills what the slab before needs of a slab, and the last particles that are no whole vector.
    fn fill_first(&self, arrays: Arrays<P>, given: &Given, t: usize, slab: &Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        // SAFETY: places of this thread; behind the last there is room for a vector, and nothing yet.
        unsafe {
            if t == 0 {
                self.fill_places(arrays, given, self.vectors_before(self.grid.layers)..self.particles);
            }
            self.fill_places(arrays, given, self.needed(slab, 1));
        }
        lap(&mut since, &mut times.sort);
    }
}

impl<P: Compiled> Stream<'_, P> {
    /// What the first pass of a layer leaves.
    #[allow(clippy::mut_from_ref)] // Each thread has its own.
    unsafe fn near(&self, t: usize, slab: &Range<usize>, layer: usize) -> &mut NearPairs<P::Scalar> {
        let at = match layer {
            _ if layer == slab.start => 0,
            _ if layer + 1 == slab.end => 1,
            _ => 2 + layer % 2,
        };
        // SAFETY: one of the thread's own.
        unsafe { &mut *self.arrays.near.at(KEPT * t + at) }
    }

    /// Arrays and first passes of a slab, ψ of all its layers but the first, the second pass of those between, and the
    /// forces of those of them that are not next to the first.
    fn within(&self, t: usize, slab: Range<usize>, times: &mut Times) {
        // SAFETY: each thread has its own scratch.
        let scratch = unsafe { &mut *self.arrays.scratch.at(t) };
        (scratch.fault, scratch.lost) = (None, None);
        let mut since = Instant::now();
        let mut filled = self.machine.needed(&slab, 1).end;
        for layer in slab.clone() {
            let end = self.machine.needed(&slab, layer - slab.start + 2).end;
            // SAFETY: places of this thread, of layers that no pass has come to.
            unsafe { self.machine.fill_places(self.arrays, self.given, filled..end) };
            filled = end;
            lap(&mut since, &mut times.sort);
            // SAFETY: of this thread's slab.
            unsafe {
                let near = self.near(t, &slab, layer);
                self.machine.first_of_layer(&self.swept, self.arrays, layer, &mut scratch.block, near);
            }
            lap(&mut since, &mut times.first);
            if layer > slab.start {
                self.excess(t, layer);
                lap(&mut since, &mut times.excess);
            }
            if layer > slab.start + 1 {
                self.second(t, &slab, layer - 1);
                lap(&mut since, &mut times.second);
            }
            if layer > slab.start + 2 {
                self.forces(t, layer - 1);
                lap(&mut since, &mut times.forces);
            }
        }
    }

    /// ψ of the first layer of a slab, which the last of another adds to.
    fn excess_of_first(&self, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.excess(t, slab.start);
        }
        lap(&mut since, &mut times.excess);
    }

    /// The second pass of the first layer of a slab, and of the last; the forces of the second, and of the last.
    fn second_at_ends(&self, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.second(t, &slab, slab.start);
            if slab.len() > 1 {
                self.second(t, &slab, slab.end - 1);
            }
        }
        lap(&mut since, &mut times.second);
        if slab.len() > 1 {
            self.forces(t, slab.start + 1);
        }
        if slab.len() > 2 {
            self.forces(t, slab.end - 1);
        }
        lap(&mut since, &mut times.forces);
    }

    /// The forces of the first layer of a slab, which the last of another adds to.
    fn forces_of_first(&self, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.forces(t, slab.start);
        }
        lap(&mut since, &mut times.forces);
    }

    fn excess(&self, t: usize, layer: usize) {
        let Some(own) = &self.own else { return };
        // SAFETY: each thread has its own scratch, each layer is done once.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            let done = self.machine.excess_of_layer(
                self.arrays,
                layer,
                self.plan,
                own,
                self.out.tag(),
                &mut scratch.excess,
            );
            if let Err(fault) = done {
                scratch.fault.get_or_insert(fault);
            }
        }
    }

    fn second(&self, t: usize, slab: &Range<usize>, layer: usize) {
        if self.machine.terms.passes.is_empty() {
            return;
        }
        // SAFETY: each layer is done once.
        unsafe {
            let near = self.near(t, slab, layer);
            self.machine.second_of_layer(&self.swept, self.arrays, layer, near);
        }
    }

    fn forces(&self, t: usize, layer: usize) {
        // SAFETY: each thread has its own scratch, each layer is done once, when all passes that add to it are.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            self.machine.forces_of_layer(self.arrays, layer, self.out, &mut scratch.lost);
        }
    }
}
