//! The passes, plane by plane, so that what a pass leaves for the next is used while it is still in the cache: all of
//! them in one go where there are no ghosts, and then no more is kept than of a few planes; else up to ψ, and from the
//! slopes of ghosts on.
//!
//! Each thread does a slab of planes. ψ of a plane needs the first pass of that plane and of the one before; many-body
//! forces need ψ of the plane and of the one behind; forces are complete after both passes of the plane and of the one
//! before. The arrays in the order of cells are filled one plane ahead. Where slabs meet, planes wait for all threads.

use super::host::ForceSink;
use super::{Input, SharedArrays, VECTOR_PADDING, Workspace};
use crate::engine::error::EngineError;
use crate::engine::plan::Plan;
use crate::engine::sweep::Times;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::ground::pass_data::PassData;
use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::lap;
use crate::engine::sweep::many_body::in_range_pairs::InRangePairs;
use crate::engine::sweep::pool::Pool;
use std::ops::Range;
use std::time::Instant;

/// Planes of a thread slab whose pairs are kept at once: its first, its last, and two between.
const KEPT_PLANES: usize = 4;

/// What all threads work with.
struct Scheduler<'a, P: Compiled> {
    workspace: &'a Workspace<P>,
    data: PassData<'a, P::Scalar, P::PackedParticle>,
    arrays: SharedArrays<P>,
    /// Whether pairs of all planes are kept, not of some only.
    keeps_all: bool,
}

/// What the passes before the slopes are given.
struct PassInput<'a> {
    plan: &'a Plan,
    input: &'a Input<'a>,
    /// What particles add to their own densities, unless ψ is zero whatever they are.
    own: Option<Vec<f64>>,
    /// Where forces go, if the second pass follows at once.
    out: Option<ForceSink<'a>>,
}

/// Work of one thread on its slab, with the times it has taken.
type Work<'a> = dyn Fn(usize, Range<usize>, &mut Times) + Sync + 'a;

impl<P: Compiled> Workspace<P> {
    /// Everything that comes after [`Workspace::sort_into_cells`]: the first pass, ψ and the second pass over all planes, and
    /// their forces. `times` are those of the caller's thread.
    ///
    /// # Errors
    /// ψ that is not finite, or a force: of the lowest tag.
    pub fn run_all(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        input: &Input,
        out: ForceSink,
        times: &mut Times,
    ) -> Result<(), EngineError> {
        let slabs = self.slabs(pool);
        self.in_range.resize_with(KEPT_PLANES * slabs.len(), InRangePairs::default);
        self.lay_out(&slabs);
        self.up_to_slopes(pool, plan, input, Some(out), &slabs, times)?;
        let arrays = self.arrays();
        let scheduler = &Scheduler { workspace: self, data: self.data(arrays), arrays, keeps_all: false };
        on_slabs(pool, &slabs, times, &|t, slab, times| scheduler.second_at_ends(out, t, slab, times));
        on_slabs(pool, &slabs, times, &|t, slab, times| scheduler.forces_of_first(out, t, slab, times));
        self.lost()
    }

    /// What comes after [`Workspace::sort_into_cells`], up to ψ and its slopes.
    ///
    /// # Errors
    /// ψ that is not finite.
    pub fn first(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        input: &Input,
        times: &mut Times,
    ) -> Result<(), EngineError> {
        self.in_range.resize_with(self.grid.planes, InRangePairs::default);
        self.lay_out_all();
        self.up_to_slopes(pool, plan, input, None, &self.slabs(pool), times)
    }

    /// What comes after [`Workspace::first`] and [`Workspace::slopes_from_host`]: the second pass, and the forces.
    ///
    /// # Errors
    /// A force that is not finite: of the lowest tag.
    pub fn second(&mut self, pool: &Pool, out: ForceSink, times: &mut Times) -> Result<(), EngineError> {
        let slabs = self.slabs(pool);
        self.copy_slopes();
        let arrays = self.arrays();
        let scheduler = &Scheduler { workspace: self, data: self.data(arrays), arrays, keeps_all: true };
        on_slabs(pool, &slabs, times, &|t, slab, times| scheduler.second_of_all(out, t, slab, times));
        on_slabs(pool, &slabs, times, &|t, slab, times| scheduler.forces_of_first(out, t, slab, times));
        self.lost()
    }

    /// Arrays, first passes and ψ of all planes; the second pass and the forces of those between the ends of slabs if
    /// there is where to write them.
    fn up_to_slopes(
        &mut self,
        pool: &Pool,
        plan: &Plan,
        input: &Input,
        out: Option<ForceSink>,
        slabs: &[Range<usize>],
        times: &mut Times,
    ) -> Result<(), EngineError> {
        let own = self.prepare_excess(plan);
        let arrays = self.arrays();
        let this = &*self;
        on_slabs(pool, slabs, times, &|t, slab, times| this.fill_first(arrays, input, t, &slab, times));
        self.copy_first_plane();
        let arrays = self.arrays();
        let pass_input = &PassInput { plan, input, own, out };
        let scheduler =
            &Scheduler { workspace: self, data: self.data(arrays), arrays, keeps_all: out.is_none() };
        on_slabs(pool, slabs, times, &|t, slab, times| scheduler.interior(pass_input, t, slab, times));
        on_slabs(pool, slabs, times, &|t, slab, times| scheduler.excess_of_first(pass_input, t, slab, times));
        self.first_fault()?;
        self.copy_slopes();
        Ok(())
    }

    fn slabs(&self, pool: &Pool) -> Vec<Range<usize>> {
        (0..pool.threads()).map(|t| self.slab(t, pool.threads())).collect()
    }

    /// The planes of a thread: all slabs have about the same number of pairs.
    fn slab(&self, t: usize, threads: usize) -> Range<usize> {
        let planes = self.grid.planes;
        let mean = self.particles as f64 / planes as f64;
        // A particle costs something even if it is alone.
        let cost = |l: usize| self.plane(l).1 as f64 * (self.plane(l).1 as f64 + 0.5 * mean);
        let all: f64 = (0..planes).map(cost).sum();
        let mut before = 0.0;
        let of_plane = (0..planes).map(|l| {
            let middle = before + 0.5 * cost(l);
            before += cost(l);
            if all > 0.0 { ((middle / all * threads as f64) as usize).min(threads - 1) } else { 0 }
        });
        let of_plane: Vec<usize> = of_plane.collect();
        let first = of_plane.iter().position(|of| *of >= t).unwrap_or(planes);
        let end = of_plane.iter().position(|of| *of > t).unwrap_or(planes);
        first..end
    }

    /// The last place before a plane, or behind all, from which on whole vectors are filled.
    fn vectors_before(&self, plane: usize) -> usize {
        self.start[plane * self.grid.columns_per_plane * self.grid.cells_per_column] as usize / VECTOR_PADDING
            * VECTOR_PADDING
    }

    /// The places that the thread of a slab fills: all vectors that begin in it, and the one across its beginning.
    fn sorted_range(&self, slab: &Range<usize>) -> Range<usize> {
        self.vectors_before(slab.start)..self.vectors_before(slab.end)
    }

    /// Of these the places that the first `planes` of a thread slab need: neighbours are compared in sixteens, up to two of which
    /// begin behind the last. All, if they stay in the cache.
    fn needed(&self, slab: &Range<usize>, planes: usize) -> Range<usize> {
        let Range { start, end } = self.sorted_range(slab);
        if !self.exceeds_cache() {
            return start..end;
        }
        let behind = (slab.start + planes).min(slab.end);
        start..(self.vectors_before(behind) + 4 * VECTOR_PADDING).min(end)
    }

    /// Fills what the thread slab before needs of a thread slab, and the last particles that are no whole vector.
    fn fill_first(
        &self,
        arrays: SharedArrays<P>,
        input: &Input,
        t: usize,
        slab: &Range<usize>,
        times: &mut Times,
    ) {
        let mut since = Instant::now();
        // SAFETY: places of this thread; behind the last there is room for a vector, and nothing yet.
        unsafe {
            if t == 0 {
                self.fill_sorted_range(arrays, input, self.vectors_before(self.grid.planes)..self.particles);
            }
            self.fill_sorted_range(arrays, input, self.needed(slab, 1));
        }
        lap(&mut since, &mut times.sort);
    }
}

/// Runs work on each thread slab, by the thread whose it is.
fn on_slabs(pool: &Pool, slabs: &[Range<usize>], times: &mut Times, work: &Work) {
    let times = SharedPtr(times as *mut Times);
    pool.run(&|t| {
        let mut unseen = Times::default();
        // SAFETY: of one thread alone.
        let times = if t == 0 { unsafe { &mut *times.at(0) } } else { &mut unseen };
        work(t, slabs[t].clone(), times);
    });
}

impl<P: Compiled> Scheduler<'_, P> {
    /// What the first pass of a plane leaves.
    #[allow(clippy::mut_from_ref)] // Each thread has its own.
    unsafe fn in_range(&self, t: usize, slab: &Range<usize>, plane: usize) -> &mut InRangePairs<P::Scalar> {
        let at = match plane {
            _ if self.keeps_all => plane,
            _ if plane == slab.start => KEPT_PLANES * t,
            _ if plane + 1 == slab.end => KEPT_PLANES * t + 1,
            _ => KEPT_PLANES * t + 2 + plane % 2,
        };
        // SAFETY: one of the thread's own.
        unsafe { &mut *self.arrays.in_range.at(at) }
    }

    /// Arrays and first passes of a thread slab, and ψ of all its planes but the first; if forces have a place to go, the second
    /// pass of those between, and the forces of those of them that are not next to the first.
    fn interior(&self, pass_input: &PassInput, t: usize, slab: Range<usize>, times: &mut Times) {
        // SAFETY: each thread has its own scratch.
        let scratch = unsafe { &mut *self.arrays.scratch.at(t) };
        (scratch.fault, scratch.lost) = (None, None);
        let mut since = Instant::now();
        let mut filled = self.workspace.needed(&slab, 1).end;
        for plane in slab.clone() {
            let end = self.workspace.needed(&slab, plane - slab.start + 2).end;
            // SAFETY: places of this thread, of planes that no pass has come to.
            unsafe { self.workspace.fill_sorted_range(self.arrays, pass_input.input, filled..end) };
            filled = end;
            lap(&mut since, &mut times.sort);
            // SAFETY: of this thread's slab.
            unsafe {
                let in_range = self.in_range(t, &slab, plane);
                self.workspace.first_of_plane(&self.data, self.arrays, plane, &mut scratch.buffers, in_range);
            }
            lap(&mut since, &mut times.first);
            if plane > slab.start {
                self.excess(pass_input, t, plane);
                lap(&mut since, &mut times.excess);
            }
            let Some(out) = pass_input.out else { continue };
            if plane > slab.start + 1 {
                self.second(t, &slab, plane - 1);
                lap(&mut since, &mut times.second);
            }
            if plane > slab.start + 2 {
                self.forces(out, t, plane - 1);
                lap(&mut since, &mut times.forces);
            }
        }
    }

    /// ψ of the first plane of a thread slab, which the last of another adds to.
    fn excess_of_first(&self, pass_input: &PassInput, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.excess(pass_input, t, slab.start);
        }
        lap(&mut since, &mut times.excess);
    }

    /// The second pass of the first plane of a thread slab, and of the last; the forces of the second, and of the last.
    fn second_at_ends(&self, out: ForceSink, t: usize, slab: Range<usize>, times: &mut Times) {
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

    /// The second pass of a thread slab, and the forces of all its planes but the first.
    fn second_of_all(&self, out: ForceSink, t: usize, slab: Range<usize>, times: &mut Times) {
        // SAFETY: each thread has its own scratch.
        unsafe { (*self.arrays.scratch.at(t)).lost = None };
        let mut since = Instant::now();
        for plane in slab.clone() {
            self.second(t, &slab, plane);
            lap(&mut since, &mut times.second);
            if plane > slab.start {
                self.forces(out, t, plane);
                lap(&mut since, &mut times.forces);
            }
        }
    }

    /// The forces of the first plane of a thread slab, which the last of another adds to.
    fn forces_of_first(&self, out: ForceSink, t: usize, slab: Range<usize>, times: &mut Times) {
        let mut since = Instant::now();
        if !slab.is_empty() {
            self.forces(out, t, slab.start);
        }
        lap(&mut since, &mut times.forces);
    }

    fn excess(&self, pass_input: &PassInput, t: usize, plane: usize) {
        let Some(own) = &pass_input.own else { return };
        // SAFETY: each thread has its own scratch, each plane is done once.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            let done = self.workspace.excess_of_plane(
                self.arrays,
                plane,
                pass_input.plan,
                own,
                pass_input.input.particles.tag,
                &mut scratch.excess,
            );
            if let Err(fault) = done {
                scratch.fault.get_or_insert(fault);
            }
        }
    }

    fn second(&self, t: usize, slab: &Range<usize>, plane: usize) {
        if self.workspace.terms.passes.is_empty() {
            return;
        }
        // SAFETY: each plane is done once.
        unsafe {
            let in_range = self.in_range(t, slab, plane);
            self.workspace.second_of_plane(&self.data, self.arrays, plane, in_range);
        }
    }

    fn forces(&self, out: ForceSink, t: usize, plane: usize) {
        // SAFETY: each thread has its own scratch, each plane is done once, when all passes that add to it are.
        unsafe {
            let scratch = &mut *self.arrays.scratch.at(t);
            self.workspace.forces_of_plane(self.arrays, plane, out, &mut scratch.lost);
        }
    }
}
