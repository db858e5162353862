//! Where the accumulators of each plane are.

use super::{Accumulator, Workspace};
use crate::engine::sweep::compiled::Compiled;
use std::ops::Range;

/// Blocks of accumulators of a thread slab of planes: those of its first two planes wait for all threads, three take turns.
const ACCUMULATOR_SLOTS: usize = 2 + TURNS;

/// Planes whose accumulators are needed at once: when one is begun, the one before has no many-body forces yet, and
/// what the one before that has added to this one is not with its force.
const TURNS: usize = 3;

impl<P: Compiled> Workspace<P> {
    /// Accumulators for every plane.
    pub(super) fn lay_out_all(&mut self) {
        let every = (0..self.grid.planes).map(|plane| plane..plane + 1);
        self.lay_out(&every.collect::<Vec<_>>());
    }

    /// Accumulators for slabs, each of which is done plane by plane: but for those of its first two planes they are used
    /// again three planes on.
    pub(super) fn lay_out(&mut self, slabs: &[Range<usize>]) {
        self.accumulator_offset.clear();
        let mut begin = 0;
        for slab in slabs {
            let buffers = |plane: usize| match plane - slab.start {
                k if k < ACCUMULATOR_SLOTS => k,
                k => ACCUMULATOR_SLOTS - TURNS + (k - ACCUMULATOR_SLOTS) % TURNS,
            };
            let mut sizes = [0; ACCUMULATOR_SLOTS];
            for plane in slab.clone() {
                // A plane has accumulators of its own particles, then of those of the next.
                let size = self.plane(plane).1 + self.next_plane(plane);
                sizes[buffers(plane)] = size.max(sizes[buffers(plane)]);
            }
            let mut begins = [begin; ACCUMULATOR_SLOTS];
            for k in 1..ACCUMULATOR_SLOTS {
                begins[k] = begins[k - 1] + sizes[k - 1];
            }
            for plane in slab.clone() {
                self.accumulator_offset.push(begins[buffers(plane)] as isize - self.plane(plane).0 as isize);
            }
            begin = begins[ACCUMULATOR_SLOTS - 1] + sizes[ACCUMULATOR_SLOTS - 1];
        }
        self.sums.resize(begin.max(1), Accumulator::default());
        let variables = self.width();
        let quads = if variables > 1 { variables.div_ceil(4) } else { 0 };
        self.densities.resize(quads * begin, Accumulator::default());
    }
}
