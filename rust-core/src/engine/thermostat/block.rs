//! Pairs in blocks, whose vectors are made separations, with the virial of their forces.

use super::distances::Distances;
use crate::engine::vectors::{Loop, run_best};

/// Number of pairs in a block, and in a vector.
const BLOCK: usize = 128;
const LANES: usize = 8;

/// Vectors `g` and factors of them, which become separations and the factors of these.
#[derive(Debug)]
pub struct Block {
    pub count: usize,
    pub d: [[f64; BLOCK]; 3],
    pub strengths: [f64; BLOCK],
    /// The pairs of species.
    kinds: [u16; BLOCK],
    /// Ratios `r/|g|`.
    per_length: [f64; BLOCK],
}

impl Default for Block {
    fn default() -> Block {
        let none = [0.0; BLOCK];
        Block { count: 0, d: [none; 3], strengths: none, kinds: [0; BLOCK], per_length: none }
    }
}

impl Block {
    /// Adds a pair of this pair of species to a block that is not full; returns whether it is now.
    #[inline(always)]
    pub fn push(&mut self, g: [f64; 3], strength: f64, kind: u16) -> bool {
        let at = self.count;
        (0..3).for_each(|c| self.d[c][at] = g[c]);
        (self.strengths[at], self.kinds[at]) = (strength, kind);
        self.count += 1;
        self.count == BLOCK
    }

    /// Makes separations of the vectors; returns their virial.
    pub fn lengthen(&mut self, distances: &Distances) -> [f64; 6] {
        run_best(Lengthen { block: self, distances })
    }
}

struct Lengthen<'a, 'd> {
    block: &'a mut Block,
    distances: &'a Distances<'d>,
}

impl Loop for Lengthen<'_, '_> {
    type Out = [f64; 6];

    #[inline(always)]
    fn run(self) -> [f64; 6] {
        let Lengthen { block: Block { count, d, strengths, kinds, per_length }, distances } = self;
        let count = *count;
        distances.per_lengths(d, &kinds[..count], per_length);
        let [x, y, z] = d;
        for (k, ratio) in per_length[..count].iter().enumerate() {
            (x[k], y[k], z[k]) = (ratio * x[k], ratio * y[k], ratio * z[k]);
            strengths[k] /= ratio;
        }
        let mut sums = [[0.0; LANES]; 6];
        for k in count..count.next_multiple_of(LANES) {
            strengths[k] = 0.0;
        }
        for k in (0..count).step_by(LANES) {
            for lane in 0..LANES {
                let (s, x, y, z) = (strengths[k + lane], x[k + lane], y[k + lane], z[k + lane]);
                let dyad = [x * x, y * y, z * z, x * y, x * z, y * z];
                (0..6).for_each(|c| sums[c][lane] += s * dyad[c]);
            }
        }
        sums.map(|lanes| lanes.iter().sum())
    }
}
