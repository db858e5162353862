//! Computes densities of the particles, and ψ.

use super::accumulators::Added;
use super::cell_order::CellOrder;
use super::fluid::FluidConstants;
use super::input::Input;
use crate::engine::error::EngineError;
use crate::engine::excess::ExcessPlan;
use crate::engine::excess_pass::{ExcessPass, LANES, Rows};
use crate::engine::plan::Plan;
use crate::engine::vectors::{self, Loop};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::accumulators::Accumulator;

/// Number of particles whose densities are gathered at once: few enough to stay in the first-level cache
/// until ψ is evaluated, and enough to fill several blocks of lanes where some particles are left out.
pub const DENSITY_BLOCK: usize = 2 * LANES;

/// The input of the evaluation of ψ.
pub struct ExcessInput<'a> {
    pub plan: &'a Plan,
    pub tag: &'a [i32],
    /// The self term of each density: `w(0)` for the particle's own species, else zero. One row for each species.
    self_weights: Vec<f64>,
    /// Additions to the densities, a row for each owned particle in the host's order; empty if there are none.
    added: &'a [f64],
}

impl<'a> ExcessInput<'a> {
    /// Returns `None` if ψ is zero at all densities.
    pub fn new(plan: &'a Plan, input: &Input<'a>) -> Option<ExcessInput<'a>> {
        if plan.excess.iter().all(|e| matches!(e, ExcessPlan::Constant(0.0))) {
            return None;
        }
        let count = plan.species.len();
        let mut self_weights = Vec::with_capacity(count * plan.slope_width());
        for species in 0..count {
            for d in plan.passes.iter().map(|d| &plan.densities[*d]) {
                let own = if d.includes_self { d.kernel.value(0.0) } else { 0.0 };
                self_weights.extend((0..count).map(|s| if s == species { own } else { 0.0 }));
            }
        }
        Some(ExcessInput { plan, tag: input.particles.tag, self_weights, added: input.added_densities })
    }

    /// Adds the rows of `added` to the densities of particles with these numbers.
    fn add(&self, numbers: &[u32], width: usize, densities: &mut [f64]) {
        if width == 1 {
            for (k, n) in numbers.iter().zip(densities) {
                *n += self.added[*k as usize];
            }
            return;
        }
        for (k, row) in numbers.iter().zip(densities.chunks_exact_mut(width)) {
            let added = &self.added[width * *k as usize..][..width];
            row.iter_mut().zip(added).for_each(|(n, added)| *n += added);
        }
    }
}

/// Up to [`DENSITY_BLOCK`] consecutive particles.
pub struct DensityBlock<'a> {
    /// First particle of the block.
    pub first: usize,
    /// Sums over pairs of these particles.
    pub added: (Added<'a>, Option<Added<'a>>),
    /// Species of the particles; empty with one species.
    pub species: &'a [u8],
    pub densities: &'a mut [f64],
    pub excess: &'a mut [f64],
    pub slopes: &'a mut [f64],
}

impl DensityBlock<'_> {
    /// Computes their densities, ψ and its slopes.
    pub fn evaluate<T>(
        self,
        fluid: &FluidConstants<T>,
        input: &ExcessInput,
        order: &CellOrder,
        pass: &mut ExcessPass,
    ) -> Result<(), EngineError> {
        let DensityBlock { first, added, species, densities, excess, slopes } = self;
        sum_densities(fluid.set, fluid.width(), added, &input.self_weights, species, densities);
        if !input.added.is_empty() {
            input.add(&order.order[first..][..excess.len()], fluid.width(), densities);
        }
        let rows = &mut Rows { first: 0, columns: &fluid.variables, densities, excess, slopes };
        let tag = |s: usize| input.tag[order.order[first + s] as usize];
        match species.is_empty() {
            true => pass.run(input.plan, None::<fn(usize) -> i32>, tag, rows),
            false => pass.run(input.plan, Some(|s: usize| species[s] as i32), tag, rows),
        }
    }
}

/// Densities of particles, `width` each: sums over pairs plus self terms.
fn sum_densities(
    set: InstructionSet,
    width: usize,
    (here, before): (Added, Option<Added>),
    own: &[f64],
    species: &[u8],
    out: &mut [f64],
) {
    if let (1, &[own]) = (width, own) {
        let pairs = out.iter_mut().zip(here.forces);
        match before {
            None => pairs.for_each(|(n, here)| *n = here.0[3] + own),
            Some(before) => {
                let pairs = pairs.zip(before.forces);
                pairs.for_each(|((n, here), before)| *n = here.0[3] + before.0[3] + own);
            }
        }
        return;
    }
    if width == 0 {
        return;
    }
    let (here, before) = (here.densities, before.map(|before| before.densities));
    match width {
        2 => vectors::run(set, SumDensities::<2> { out, here, before, own, species }),
        3 => vectors::run(set, SumDensities::<3> { out, here, before, own, species }),
        4 => vectors::run(set, SumDensities::<4> { out, here, before, own, species }),
        _ => {
            let quads = width.div_ceil(4);
            for (k, row) in out.chunks_exact_mut(width).enumerate() {
                let own = &own[width * species.get(k).map_or(0, |s| *s as usize)..][..width];
                for (c, n) in row.iter_mut().enumerate() {
                    let of = |added: &[Accumulator]| added[quads * k + c / 4].0[c % 4];
                    *n = of(here) + before.map_or(0.0, of) + own[c];
                }
            }
        }
    }
}

/// Computes densities from the sums of a plane, those of the previous plane, and the self terms of each
/// species; `W` densities of each particle, in rows of four.
struct SumDensities<'a, const W: usize> {
    out: &'a mut [f64],
    here: &'a [Accumulator],
    before: Option<&'a [Accumulator]>,
    own: &'a [f64],
    /// Species of the particles; empty with one species.
    species: &'a [u8],
}

impl<const W: usize> Loop for SumDensities<'_, W> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let own = self.own.as_chunks::<W>().0;
        let out = self.out.as_chunks_mut::<W>().0;
        let before = self.before.unwrap_or_default();
        for (k, (n, here)) in out.iter_mut().zip(self.here).enumerate() {
            let own = &own[self.species.get(k).map_or(0, |s| *s as usize)];
            let before = before.get(k).map_or(&[0.0; 4], |before| &before.0);
            for c in 0..W {
                n[c] = here.0[c] + before[c] + own[c];
            }
        }
    }
}
