//! The forces of drag on each pair, for profiles of stress.
//!
//! The random force is left out: it is independent of the positions that it acts at, so that it
//! contributes only scatter to a mean.

use super::PairThermostat;
use super::block::Block;
use super::distances::Distances;
use crate::engine::sweep::{PlanePairs, Pool};

/// Pairs of a plane of cells and the mean forces of drag on them, as parallel arrays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pulls {
    /// Indices of the first particles.
    pub i: Vec<u32>,
    /// The components of the separations `r_i − r_j`.
    pub d: [Vec<f64>; 3],
    /// The forces on the first particles, divided by `d`.
    pub strengths: Vec<f64>,
}

impl Pulls {
    /// Empties the arrays, and makes room for so many pairs.
    fn begin(&mut self, count: usize) {
        self.i.clear();
        self.i.reserve(count);
        for array in self.d.iter_mut().chain([&mut self.strengths]) {
            array.clear();
            array.reserve(count);
        }
    }
}

impl PairThermostat {
    /// The virial `Σ r_ij ⊗ F_ij` of the drag at the velocities `v`: xx, yy, zz, xy, xz, yz. It is that of the pairs that were found
    /// last. `pulls` get the pairs, plane by plane. Results do not depend on the number of threads.
    pub fn drags(&self, pool: &Pool, v: &[[f64; 3]], pulls: Option<&mut Vec<Pulls>>) -> [f64; 6] {
        let v: Vec<[f64; 3]> = self.lists.order().iter().map(|k| v[*k as usize]).collect();
        let factor = |[i, j, _]: [usize; 3], _: usize, g: [f64; 3]| {
            let (a, b) = (v[i], v[j]);
            -2.0 / self.dt * (g[0] * (a[0] - b[0]) + g[1] * (a[1] - b[1]) + g[2] * (a[2] - b[2]))
        };
        self.pulls_by(pool, factor, pulls)
    }

    /// The virial of the impulses of the last sequential update, without the noise of each pair itself, as forces over its time; zero if its
    /// virial was not requested. Otherwise as [`PairThermostat::drags`].
    pub fn pulls(&self, pool: &Pool, pulls: Option<&mut Vec<Pulls>>) -> [f64; 6] {
        let impulse = |plane: usize, k: usize| self.impulses.get(plane)?.get(k).copied();
        self.pulls_by(pool, |[_, _, k], plane, _| impulse(plane, k).unwrap_or(0.0) / self.dt, pulls)
    }

    /// Computes pulls from the `factor` of `g`, which takes the two sorted particles and the pair, the plane, and `g`.
    fn pulls_by(
        &self,
        pool: &Pool,
        factor: impl Fn([usize; 3], usize, [f64; 3]) -> f64 + Sync,
        pulls: Option<&mut Vec<Pulls>>,
    ) -> [f64; 6] {
        self.assert_pairs();
        let (mut none, distances) = (Vec::new(), &self.distances());
        let is_asked = pulls.is_some();
        let pulls = pulls.unwrap_or(&mut none);
        pulls.resize_with(self.planes.len(), Pulls::default);
        let mut work: Vec<_> =
            self.planes.iter().zip(pulls).enumerate().map(|plane| (plane, [0.0; 6])).collect();
        pool.each(&mut work, |((number, (plane, pulls)), virial)| {
            let pulls = is_asked.then_some(&mut **pulls);
            let factor = |pair: [usize; 3], g| factor(pair, *number, g);
            *virial = of_plane(plane, self.lists.order(), distances, factor, pulls);
        });
        let mut sum = [0.0; 6];
        work.iter().for_each(|(_, virial)| (0..6).for_each(|c| sum[c] += virial[c]));
        sum
    }
}

/// The virial of the pairs of a plane, whose `pulls` are written if asked for.
fn of_plane(
    plane: &PlanePairs,
    order: &[u32],
    distances: &Distances,
    factor: impl Fn([usize; 3], [f64; 3]) -> f64,
    mut pulls: Option<&mut Pulls>,
) -> [f64; 6] {
    let list = &plane.lists.own;
    let count = list.count();
    if let Some(pulls) = &mut pulls {
        pulls.begin(count);
    }
    let (mut virial, mut block) = ([0.0; 6], Block::default());
    plane.for_each_pair(|[i, j, k]| {
        let g = list.g(k);
        let is_full = block.push(g, [factor([i, j, k], g)], distances.kind(i, j));
        if let Some(pulls) = &mut pulls {
            pulls.i.push(order[i]);
        }
        if is_full || k + 1 == count {
            let [of_block] = block.virials(distances);
            (0..6).for_each(|c| virial[c] += of_block[c]);
            if let Some(pulls) = &mut pulls {
                block.lengthen();
                (0..3).for_each(|c| pulls.d[c].extend_from_slice(&block.d[c][..block.count]));
                pulls.strengths.extend_from_slice(&block.strengths[0][..block.count]);
            }
            block.count = 0;
        }
    });
    virial
}
