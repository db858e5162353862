//! The passes, layer by layer, so that what a pass leaves for the next is used while it is still in the cache: all of
//! them in one go where there are no ghosts, and then no more is kept than of a few layers; else up to ψ, and from the
//! slopes of ghosts on.
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
    /// Whether pairs of all layers are kept, not of some only.
    keeps_all: bool,
}

/// What the passes before the slopes are given.
struct Outset<'a> {
    plan: &'a Plan,
    given: &'a Given<'a>,
    /// What particles add to their own densities, unless ψ is zero whatever they are.
    own: Option<Vec<f64>>,
    /// Where forces go, if the second pass follows at once.
    out: Option<Out<'a>>,
}

/// Work of one thread on a slab, with the times it has taken.
type Work<'a> = dyn Fn(usize, Range<usize>, &mut Times) + Sync + 'a;

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
        let slabs = self.slabs(pool);
        self.near.resize_with(KEPT * slabs.len(), NearPairs::default);
        self.lay_out(&slabs);
        self.up_to_slopes(pool, plan, given, Some(out), &slabs, times)?;
        let arrays = self.arrays();
        let stream = &Stream { machine: self, swept: self.swept(arrays), arrays, keeps_all: false };
        on_slabs(pool, &slabs, times, &|t, slab, times| stream.second_at_ends(out, t, slab, times));
        on_slabs(pool, &slabs, times, &|t, slab, times| stream.forces_of_first(out, t, slab, times));
        self.lost()
    }

    /// What comes after [`Machine::find_order`], up to ψ and its slopes.
    ///
    /// # Errors
    /// ψ that is not finite.
    pub fn first(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        given: &Given,
        times: &mut Times,
    ) -> Result<(), EngineError> {
        self.near.resize_with(self.grid.layers, NearPairs::default);
        self.lay_out_all();
        self.up_to_slopes(pool, plan, given, None, &self.slabs(pool), times)
    }

    /// What comes after [`Machine::first`] and [`Machine::slopes_from_host`]: the second pass, and the forces.
    ///
    /// # Errors
    /// A force that is not finite: of the lowest tag.
    pub fn second(&mut self, pool: &Pool, out: Out, times: &mut Times) -> Result<(), EngineError> {
        let slabs = self.slabs(pool);
        self.copy_slopes();
        let arrays = self.arrays();
        let stream = &Stream { machine: self, swept: self.swept(arrays), arrays, keeps_all: true };
        on_slabs(pool, &slabs, times, &|t, slab, times| stream.second_of_all(out, t, slab, times));
        on_slabs(pool, &slabs, times, &|t, slab, times| stream.forces_of_first(out, t, slab, times));
        self.lost()
    }

    /// Arrays, first passes and ψ of all layers; the second pass and the forces of those between the ends of slabs if
    /// there is where to write them.
    fn up_to_slopes(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        given: &Given,
        out: Option<Out>,
        slabs: &[Range<usize>],
        times: &mut Times,
    ) -> Result<(), EngineError> {
        let own = self.prepare_excess(plan);
        let arrays = self.arrays();
        let this = &*self;
        on_slabs(pool, slabs, times, &|t, slab, times| this.fill_first(arrays, given, t, &slab, times));
        self.copy_first_layer();
        let arrays = self.arrays();
        let outset = &Outset { plan, given, own, out };
        let stream = &Stream { machine: self, swept: self.swept(arrays), arrays, keeps_all: out.is_none() };
        on_slabs(pool, slabs, times, &|t, slab, times| stream.within(outset, t, slab, times));
        on_slabs(pool, slabs, times, &|t, slab, times| stream.excess_of_first(outset, t, slab, times));
        self.first_fault()?;
        self.copy_slopes();
        Ok(())
    }

    fn slabs(&self, pool: &Pool) -> Vec<Range<usize>> {
        (0..pool.threads()).map(|t| self.slab(t, pool.threads())).collect()
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

/// Runs work on each slab, by the thread whose it is.
fn on_slabs(pool: &Pool, slabs: &[Range<usize>], times: &mut Times, work: &Work) {
    let times = Shared(times as *mut Times);
    pool.run(&|t| {
        let mut unseen = Times::default();
        // SAFETY: of one thread alone.
        let times = if t == 0 { unsafe { &mut *times.at(0) } } else { &mut unseen };
        work(t, slabs[t].clone(), times);
    });
}

impl<P: Compiled> Stream<'_, P> {
    /// What the first pass of a layer leaves.
    #[allow(clippy::mut_from_ref)] // Each thread has its own.
    unsafe fn near(&self, t: usize, slab: &Range<usize>, layer: usize) -> &mut NearPairs<P::Scalar> {
        let at = match layer {
            _ if self.keeps_all => layer,
            _ if layer == slab.start => KEPT * t,
            _ if layer + 1 == slab.end => KEPT * t + 1,
            _ => KEPT * t + 2 + layer % 2,
        };
        // SAFETY: one of the thread's own.
        unsafe { &mut *self.arrays.near.at(at) }
    }

    /// Arrays and first passes of a slab, and ψ of all its layers but the first; if forces have a place to go, the second
    /// pass of those between, and the forces of those of them that are not next to the first.
    fn within(&self, outset: &Outset, t: usize, slab: Range<usize>, times: &mut Times) {
        // SAFETY: each thread has its own scratch.
        let scratch = unsafe { &mut *self.arrays.scratch.at(t) };
        (scratch.fault, scratch.lost) = (None, None);
        let mut since = Instant::now();
        let mut filled = self.machine.needed(&slab, 1).end;
        for layer in slab.clone() {
            let end = self.machine.needed(&slab, layer - slab.start + 2).end;
            // SAFETY: places of this thread, of layers that no pass has come to.
            unsafe { self.machine.fill_places(self.arrays, outset.given, filled..end) };
            filled = end;
            lap(&mut since, &mut times.sort);
            // SAFETY: of this thread's slab.
            unsafe {
                let near = self.near(t, &slab, layer);
                self.machine.first_of_layer(&self.swept, self.arrays, layer, &mut scratch.block, near);
            }
            lap(&mut since, &mut times.first);
            if layer > slab.start {
                self.excess(outset, t, layer);
                lap(&mut since, &mut times.excess);
            }
            let Some(out) = outset.out else { continue };
            if layer > slab.start + 1 {
                self.second(t, &slab, layer - 1);
                lap(&mut since, &mut times.second);
            }
            if layer > slab.start + 2 {
                self.forces(out, t, layer - 1);
                lap(&mut since, &mut times.forces);
            }
        }
    }

    /// ψ of the first layer of a slab, which the last of another adds to.
    fn excess_of_first(&self, outset: &Outset, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.excess(outset, t, slab.start);
        }
        lap(&mut since, &mut times.excess);
    }

    /// The second pass of the first layer of a slab, and of the last; the forces of the second, and of the last.
    fn second_at_ends(&self, out: Out, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.second(t, &slab, slab.start);
            if slab.len() > 1 {
                self.second(t, &slab, slab.end - 1);
            }
        }
        lap(&mut since, &mut times.second);
        if slab.len() > 1 {
            self.forces(out, t, slab.start + 1);
        }
        if slab.len() > 2 {
            self.forces(out, t, slab.end - 1);
        }
        lap(&mut since, &mut times.forces);
    }

    /// The second pass of a slab, and the forces of all its layers but the first.
    fn second_of_all(&self, out: Out, t: usize, slab: Range<usize>, times: &mut Times) {
        // SAFETY: each thread has its own scratch.
        unsafe { (*self.arrays.scratch.at(t)).lost = None };
        let mut since = Instant::now();
        for layer in slab.clone() {
            self.second(t, &slab, layer);
            lap(&mut since, &mut times.second);
            if layer > slab.start {
                self.forces(out, t, layer);
                lap(&mut since, &mut times.forces);
            }
        }
    }

    /// The forces of the first layer of a slab, which the last of another adds to.
    fn forces_of_first(&self, out: Out, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.forces(out, t, slab.start);
        }
        lap(&mut since, &mut times.forces);
    }

    fn excess(&self, outset: &Outset, t: usize, layer: usize) {
        let Some(own) = &outset.own else { return };
        // SAFETY: each thread has its own scratch, each layer is done once.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            let done = self.machine.excess_of_layer(
                self.arrays,
                layer,
                outset.plan,
                own,
                outset.given.particles.tag,
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

    fn forces(&self, out: Out, t: usize, layer: usize) {
        // SAFETY: each thread has its own scratch, each layer is done once, when all passes that add to it are.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            self.machine.forces_of_layer(self.arrays, layer, out, &mut scratch.lost);
        }
    }
}
