//! The virial of drag and noise.

use super::block::Block;
use super::distances::Distances;
use super::{PairThermostat, noise_of};
use crate::engine::sweep::{PlanePairs, Pool};
use psidpd_passes::plane::list::pairs_of_each;
use psidpd_passes::plane::pair_sums::{Noise, Wide};

/// Virial `Σ r_ij ⊗ F_ij` of the opposite, `g (a ξ − g·(p_i − p_j))`: xx, yy, zz, xy, xz, yz; half of it for pairs with
/// ghosts.
fn virial_of_plane(
    PlanePairs { own, lists, .. }: &PlanePairs,
    p: &[Wide],
    noise: Option<Noise>,
    distances: &Distances,
) -> [f64; 6] {
    let (mut virial, mut block) = ([0.0; 6], Block::default());
    let mut add = |block: &mut Block| {
        let of_block = block.lengthen(distances);
        (0..6).for_each(|c| virial[c] += of_block[c]);
        block.count = 0;
    };
    for (list, share) in [(&lists.own, 1.0), (&lists.with_ghosts, 0.5)] {
        let xi = noise.map_or_else(Vec::new, |noise| noise.of_pairs.of_list(list));
        let amplitude = noise.map_or(0.0, |noise| noise.amplitude);
        for (i, of_i) in pairs_of_each(&list.start) {
            for k in of_i {
                let [i, j] = [own.start + i, list.j_from + list.second(k)];
                let (g, a, b) = (list.g(k), p[i], p[j]);
                let along: f64 = (0..3).map(|c| (a[c] - b[c]) * g[c]).sum();
                let along = xi.get(k).map_or(0.0, |xi| amplitude * f64::from(*xi)) - along;
                if block.push(g, along * share, distances.kind(i, j)) {
                    add(&mut block);
                }
            }
        }
    }
    add(&mut block);
    virial
}

/// Adds `factor g ⊗ g` to a virial.
pub fn add_virial(virial: &mut [f64; 6], g: [f64; 3], factor: f64) {
    for (w, (a, b)) in virial.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
        *w += factor * g[a] * g[b];
    }
}

impl PairThermostat {
    /// The virial of drag at the velocities that were gathered, and perhaps of noise, as mean forces over Δt.
    pub(super) fn virial(&self, pool: &Pool, noise: bool) -> [f64; 6] {
        let noise = if noise { noise_of(self.noise, &self.labels, self.kt) } else { None };
        let distances = &self.distances();
        let mut parts: Vec<_> = self.planes.iter().map(|plane| (plane, [0.0; 6])).collect();
        pool.each(&mut parts, |(plane, virial)| {
            *virial = virial_of_plane(plane, &self.sums.p, noise, distances);
        });
        let mut sum = [0.0; 6];
        for (_, virial) in parts {
            (0..6).for_each(|c| sum[c] += 2.0 / self.dt * virial[c]);
        }
        sum
    }
}
