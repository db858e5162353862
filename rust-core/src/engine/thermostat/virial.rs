//! The virial of drag and noise.

use super::block::Block;
use super::distances::Distances;
use super::{PairThermostat, noise_of};
use crate::engine::sweep::{PlanePairs, Pool};
use psidpd_passes::plane::list::pairs_of_each;
use psidpd_passes::plane::pair_sums::{Noise, Wide};

/// Virials `Σ r_ij ⊗ F_ij` of drag, of the opposite of `g (g·(p_i − p_j))`, and of noise, `g a ξ`: xx, yy, zz, xy, xz, yz; half of them for
/// pairs with ghosts.
fn virials_of_plane(
    PlanePairs { own, lists, .. }: &PlanePairs,
    p: &[Wide],
    noise: Option<Noise>,
    distances: &Distances,
) -> [[f64; 6]; 2] {
    let (mut virials, mut block) = ([[0.0; 6]; 2], Block::default());
    let mut add = |block: &mut Block<2>| {
        let of_block = block.virials(distances);
        virials.as_flattened_mut().iter_mut().zip(of_block.as_flattened()).for_each(|(sum, add)| *sum += add);
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
                let random = xi.get(k).map_or(0.0, |xi| amplitude * f64::from(*xi));
                if block.push(g, [-along * share, random * share], distances.kind(i, j)) {
                    add(&mut block);
                }
            }
        }
    }
    add(&mut block);
    virials
}

/// Adds `factor g ⊗ g` to a virial.
pub fn add_virial(virial: &mut [f64; 6], g: [f64; 3], factor: f64) {
    for (w, (a, b)) in virial.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
        *w += factor * g[a] * g[b];
    }
}

impl PairThermostat {
    /// The virials of drag at the velocities that were gathered, and of noise, if there is any, as mean forces over Δt.
    pub(super) fn virials(&self, pool: &Pool, noise: bool) -> [[f64; 6]; 2] {
        let noise = if noise { noise_of(self.noise, &self.labels, self.kt) } else { None };
        let distances = &self.distances();
        let mut parts: Vec<_> = self.planes.iter().map(|plane| (plane, [[0.0; 6]; 2])).collect();
        pool.each(&mut parts, |(plane, virials)| {
            *virials = virials_of_plane(plane, &self.sums.p, noise, distances);
        });
        let mut sums = [[0.0; 6]; 2];
        for (_, virials) in parts {
            let of_plane = sums.as_flattened_mut().iter_mut().zip(virials.as_flattened());
            of_plane.for_each(|(sum, virial)| *sum += 2.0 / self.dt * virial);
        }
        sums
    }
}
