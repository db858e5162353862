//! Where the accumulators of each layer are.

use super::{Machine, Sum};
use crate::engine::sweep::compiled::Compiled;
use std::ops::Range;

/// Blocks of accumulators of a slab of layers: those of its first two layers wait for all threads, three take turns.
const BLOCKS: usize = 2 + TURNS;

/// Layers whose accumulators are needed at once: when one is begun, the one before has no many-body forces yet, and
/// what the one before that has added to this one is not with its force.
const TURNS: usize = 3;

impl<P: Compiled> Machine<P> {
    /// Accumulators for every layer.
    pub(super) fn lay_out_all(&mut self) {
        let every = (0..self.grid.layers).map(|layer| layer..layer + 1);
        self.lay_out(&every.collect::<Vec<_>>());
    }

    /// Accumulators for slabs, each of which is done layer by layer: but for those of its first two layers they are used
    /// again three layers on.
    pub(super) fn lay_out(&mut self, slabs: &[Range<usize>]) {
        self.offset.clear();
        let mut begin = 0;
        for slab in slabs {
            let block = |layer: usize| match layer - slab.start {
                k if k < BLOCKS => k,
                k => BLOCKS - TURNS + (k - BLOCKS) % TURNS,
            };
            let mut sizes = [0; BLOCKS];
            for layer in slab.clone() {
                // A layer has accumulators of its own particles, then of those of the next.
                let size = self.layer(layer).1 + self.next_layer(layer);
                sizes[block(layer)] = size.max(sizes[block(layer)]);
            }
            let mut begins = [begin; BLOCKS];
            for k in 1..BLOCKS {
                begins[k] = begins[k - 1] + sizes[k - 1];
            }
            for layer in slab.clone() {
                self.offset.push(begins[block(layer)] as isize - self.layer(layer).0 as isize);
            }
            begin = begins[BLOCKS - 1] + sizes[BLOCKS - 1];
        }
        self.sums.resize(begin.max(1), Sum::default());
        let variables = self.width();
        let quads = if variables > 1 { variables.div_ceil(4) } else { 0 };
        self.densities.resize(quads * begin, Sum::default());
    }
}
