//! Densities of the particles, and ψ at them.

use super::{SharedArrays, Workspace};
use crate::engine::error::EngineError;
use crate::engine::excess::ExcessPlan;
use crate::engine::excess_pass::{ExcessPass, LANES, Rows};
use crate::engine::plan::Plan;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::many_body::full_pair_cache::SLOPES_PER_PASS;
use crate::engine::sweep::simd::Scalar;
use crate::engine::vectors::{self, Loop};

/// Particles whose densities are gathered at a time: they stay in the first-level cache until ψ is evaluated, and
/// make several blocks of lanes where not all take part.
const DENSITY_BLOCK: usize = 2 * LANES;

impl<P: Compiled> Workspace<P> {
    /// Room for ψ and its slopes; what particles add to their own densities, unless ψ is zero whatever they are.
    pub(super) fn prepare_excess(&mut self, plan: &Plan) -> Option<Vec<f64>> {
        let (width, n) = (self.width(), self.particles);
        let copies = if self.is_plane_axis_periodic() { self.plane(0).1 } else { 0 };
        self.excess.resize(n, 0.0);
        self.densities_of_particles.resize(width * n, 0.0);
        self.slopes.resize(width * (n + copies), 0.0);
        if self.terms.full_cache {
            self.packed_slopes
                .resize(width.div_ceil(SLOPES_PER_PASS) * self.packed_slope_stride(), P::Scalar::of(0.0));
        }
        if plan.excess.iter().all(|e| matches!(e, ExcessPlan::Constant(0.0))) {
            self.excess.fill(0.0);
            return None;
        }
        Some(self.own_weights(plan))
    }

    /// Slopes of the copies of the first plane.
    pub(super) fn copy_slopes(&mut self) {
        if self.is_plane_axis_periodic() {
            let (width, n, copies) = (self.width(), self.particles, self.plane(0).1);
            self.slopes.copy_within(..width * copies, width * n);
            let room = self.packed_slope_stride();
            for first in (0..self.packed_slopes.len()).step_by(room) {
                self.packed_slopes
                    .copy_within(first..first + SLOPES_PER_PASS * copies, first + SLOPES_PER_PASS * n);
            }
        }
    }

    /// ψ and its slopes of one plane.
    ///
    /// # Safety
    /// No other thread does the same plane, and none writes the weights of its particles.
    pub(super) unsafe fn excess_of_plane(
        &self,
        arrays: SharedArrays<P>,
        plane: usize,
        plan: &Plan,
        own: &[f64],
        tag: &[i32],
        pass: &mut ExcessPass,
    ) -> Result<(), EngineError> {
        let width = self.width();
        let (first, count) = self.plane(plane);
        for from in (first..first + count).step_by(DENSITY_BLOCK) {
            let count = DENSITY_BLOCK.min(first + count - from);
            // SAFETY: the plane's own.
            let (excess, slopes, densities) = unsafe {
                (
                    std::slice::from_raw_parts_mut(arrays.excess.at(from), count),
                    std::slice::from_raw_parts_mut(arrays.slopes.at(width * from), width * count),
                    std::slice::from_raw_parts_mut(
                        arrays.densities_of_particles.at(width * from),
                        width * count,
                    ),
                )
            };
            // SAFETY: the caller's.
            unsafe { self.gather_densities(arrays, plane, from, own, densities) };
            let mut rows = Rows { first: from, columns: &self.variables, densities, excess, slopes };
            self.evaluate(plan, pass, tag, &mut rows)?;
            // SAFETY: the plane's own.
            unsafe { self.write_packed_slopes(arrays.packed_slopes, from, rows.slopes) };
        }
        Ok(())
    }

    /// What a particle itself adds to the densities of the passes: `w(0)` of its species, or nothing. A row for each
    /// species.
    fn own_weights(&self, plan: &Plan) -> Vec<f64> {
        let count = plan.species.len();
        let mut rows = Vec::with_capacity(count * self.width());
        for species in 0..count {
            for d in plan.passes.iter().map(|d| &plan.densities[*d]) {
                let own = if d.includes_self { d.kernel.value(0.0) } else { 0.0 };
                rows.extend((0..count).map(|s| if s == species { own } else { 0.0 }));
            }
        }
        rows
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

    /// Densities of particles of a plane from number `from`, as many as there is room for.
    ///
    /// # Safety
    /// No other thread writes their weights.
    unsafe fn gather_densities(
        &self,
        arrays: SharedArrays<P>,
        plane: usize,
        from: usize,
        own: &[f64],
        out: &mut [f64],
    ) {
        let width = self.width();
        let (here, before) = self.accumulators(plane);
        let place = |accumulators: isize| (from as isize + accumulators) as usize;
        if let (1, &[own]) = (width, own) {
            let count = out.len();
            // SAFETY: accumulators of particles of the plane.
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
        // SAFETY: accumulators of particles of the plane.
        let sums = |accumulators| unsafe {
            let sums = arrays.densities.at(quads * place(accumulators));
            std::slice::from_raw_parts(sums.cast::<f64>(), 4 * quads * (count / width))
        };
        let (here, before) = (sums(here), before.map(sums));
        let species = if self.species.is_empty() { &[][..] } else { &self.species[from..][..count / width] };
        let instructions = self.instructions;
        match width {
            2 => vectors::run(instructions, SumDensities::<2> { out, here, before, own, species }),
            3 => vectors::run(instructions, SumDensities::<3> { out, here, before, own, species }),
            4 => vectors::run(instructions, SumDensities::<4> { out, here, before, own, species }),
            _ => {
                for (k, row) in out.chunks_exact_mut(width).enumerate() {
                    // What fills rows of four is left out.
                    let from = 4 * quads * k;
                    let own = &own[width * species.get(k).map_or(0, |s| *s as usize)..][..width];
                    for (c, n) in row.iter_mut().enumerate() {
                        *n = here[from + c] + before.map_or(0.0, |before| before[from + c]) + own[c];
                    }
                }
            }
        }
    }
}

/// Densities from the sums of a plane, of the plane before, and what each species adds to its own; `W` of each
/// particle, in rows of four.
struct SumDensities<'a, const W: usize> {
    out: &'a mut [f64],
    here: &'a [f64],
    before: Option<&'a [f64]>,
    own: &'a [f64],
    /// Empty with one.
    species: &'a [u8],
}

impl<const W: usize> Loop for SumDensities<'_, W> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let own = self.own.as_chunks::<W>().0;
        let out = self.out.as_chunks_mut::<W>().0;
        let here = self.here.as_chunks::<4>().0;
        let before = self.before.map_or(&[][..], |before| before.as_chunks::<4>().0);
        for (k, (n, here)) in out.iter_mut().zip(here).enumerate() {
            let own = &own[self.species.get(k).map_or(0, |s| *s as usize)];
            let before = before.get(k).unwrap_or(&[0.0; 4]);
            for c in 0..W {
                n[c] = here[c] + before[c] + own[c];
            }
        }
    }
}
