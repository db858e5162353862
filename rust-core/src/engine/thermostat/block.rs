//! Pairs in blocks, whose vectors are made separations, with the virial of their forces.

use super::distances::Distances;
use crate::engine::vectors::{Loop, run_best};

/// Number of pairs in a block, and in a vector.
const BLOCK: usize = 128;
const LANES: usize = 8;

/// Vectors `g` and factors of them in `N` forces, which become separations and the factors of these.
#[derive(Debug)]
pub struct Block<const N: usize> {
    pub count: usize,
    pub d: [[f64; BLOCK]; 3],
    pub strengths: [[f64; BLOCK]; N],
    /// The pairs of species.
    kinds: [u16; BLOCK],
    /// Ratios `r/|g|`.
    per_length: [f64; BLOCK],
}

impl<const N: usize> Default for Block<N> {
    fn default() -> Block<N> {
        let none = [0.0; BLOCK];
        Block { count: 0, d: [none; 3], strengths: [none; N], kinds: [0; BLOCK], per_length: none }
    }
}

impl<const N: usize> Block<N> {
    /// Adds a pair of this pair of species to a block that is not full; returns whether it is now.
    #[inline(always)]
    pub fn push(&mut self, g: [f64; 3], strengths: [f64; N], kind: u16) -> bool {
        let at = self.count;
        (0..3).for_each(|c| self.d[c][at] = g[c]);
        (0..N).for_each(|n| self.strengths[n][at] = strengths[n]);
        self.kinds[at] = kind;
        self.count += 1;
        self.count == BLOCK
    }

    /// The virials of the forces, and the ratios `r/|g|` for [`Block::lengthen`].
    pub fn virials(&mut self, distances: &Distances) -> [[f64; 6]; N] {
        run_best(Virials { block: self, distances })
    }

    /// Makes separations of the vectors, after [`Block::virials`].
    pub fn lengthen(&mut self) {
        let Block { count, d, strengths, per_length, .. } = self;
        for (k, ratio) in per_length[..*count].iter().enumerate() {
            d.iter_mut().for_each(|d| d[k] *= ratio);
            strengths.iter_mut().for_each(|strengths| strengths[k] /= ratio);
        }
    }
}

struct Virials<'a, 'd, const N: usize> {
    block: &'a mut Block<N>,
    distances: &'a Distances<'d>,
}

impl<const N: usize> Loop for Virials<'_, '_, N> {
    type Out = [[f64; 6]; N];

    #[inline(always)]
    fn run(self) -> [[f64; 6]; N] {
        let Virials { block: Block { count, d, strengths, kinds, per_length }, distances } = self;
        distances.per_lengths(d, &kinds[..*count], per_length);
        let all = count.next_multiple_of(LANES);
        strengths.iter_mut().for_each(|strengths| strengths[*count..all].fill(0.0));
        per_length[*count..all].fill(0.0);
        // Separations are the ratios times the vectors, and the factors of the separations those of the vectors divided by the ratios.
        let [x, y, z] = d.each_ref().map(|d| d[..all].as_chunks::<LANES>().0);
        let ratios = per_length[..all].as_chunks::<LANES>().0;
        strengths.each_ref().map(|strengths| {
            let mut sums = [[0.0; LANES]; 6];
            let strengths = strengths[..all].as_chunks::<LANES>().0.iter();
            for ((((x, y), z), ratio), s) in x.iter().zip(y).zip(z).zip(ratios).zip(strengths) {
                let [fx, fy, fz] = [x, y, z].map(|g| times(&times(s, ratio), g));
                let pairs = [(&fx, x), (&fy, y), (&fz, z), (&fx, y), (&fx, z), (&fy, z)];
                for (sum, (f, g)) in sums.iter_mut().zip(pairs) {
                    (0..LANES).for_each(|lane| sum[lane] += f[lane] * g[lane]);
                }
            }
            sums.map(|lanes| lanes.iter().sum())
        })
    }
}

#[inline(always)]
fn times(a: &[f64; LANES], b: &[f64; LANES]) -> [f64; LANES] {
    std::array::from_fn(|lane| a[lane] * b[lane])
}
