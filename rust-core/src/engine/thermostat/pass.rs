//! A pass over the pairs, which computes `Σ_j g (g·(p_i − p_j) − a ξ)` for every particle `i`.
//!
//! Each plane adds to its own particles and to those of the next in a buffer of its own, so that the
//! order of each sum is fixed, whichever thread computes it.

use crate::engine::sweep::{PlanePairs, Pool};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::list::{PairList, pairs_of_each};
pub use psidpd_passes::plane::pair_sums::Wide;
use psidpd_passes::plane::pair_sums::add_pairs;

/// The vectors of the particles, and the sums over their pairs.
#[derive(Debug, Clone, Default)]
pub struct Sums {
    /// Vector of each sorted particle, followed by those of the first plane's copies, for the pairs of the last plane.
    pub p: Vec<Wide>,
    /// Sums by plane: of its own particles, then of those of the next.
    pub of_plane: Vec<Vec<Wide>>,
}

impl Sums {
    /// Sorts the vectors `v` of the host.
    pub fn gather(&mut self, pool: &Pool, order: &[u32], v: &[[f64; 3]]) {
        fill(pool, &mut self.p, order, |k| {
            let [x, y, z] = v[k];
            Wide([x, y, z, 0.0])
        });
    }

    /// Copies the vectors of the first plane to the end, for the pairs of the last plane.
    pub fn close(&mut self, planes: &[PlanePairs]) {
        let Some(last) = planes.last() else { return };
        self.p.truncate(last.own.end);
        self.p.extend_from_within(last.next.clone());
    }

    pub fn compute(&mut self, pool: &Pool, set: InstructionSet, planes: &[PlanePairs], noise: f64) {
        let particles = planes.last().map_or(0, |last| last.own.end);
        assert!(self.p.len() >= particles, "a vector for each particle of the pairs");
        self.close(planes);
        let Sums { p, of_plane } = self;
        of_plane.resize_with(planes.len(), Vec::new);
        let mut work: Vec<_> = planes.iter().zip(of_plane).collect();
        let p = &p[..];
        pool.each(&mut work, |(plane, sums)| {
            let PlanePairs { own, next, lists } = plane;
            sums.resize(own.len() + next.len(), Wide::ZERO);
            // SAFETY: the pairs of a plane are those of its own particles with each other, with the next and with ghosts,
            // as a search that has not failed has listed them; `p` has a vector for each, as asserted.
            unsafe { add_pairs(set, lists, noise, p, own.start, sums) };
        });
    }

    /// The sums of the particles of each plane over the pairs of that plane, and over those of the plane
    /// below; the latter are empty if that has no pairs with them.
    pub fn halves<'a>(
        of_plane: &'a mut [Vec<Wide>],
        planes: &[PlanePairs],
    ) -> impl Iterator<Item = (&'a mut [Wide], &'a [Wide])> {
        let (own, next): (Vec<_>, Vec<_>) = of_plane
            .iter_mut()
            .zip(planes)
            .map(|(sums, plane)| {
                let (own, next) = sums.split_at_mut(plane.own.len());
                (own, &*next)
            })
            .unzip();
        let below = move |number: usize| {
            let below = number.checked_sub(1).unwrap_or(planes.len() - 1);
            if planes[below].next == planes[number].own { next[below] } else { &[] }
        };
        own.into_iter().zip((0..planes.len()).map(below))
    }
}

/// Virial `Σ r_ij ⊗ F_ij` of the opposite, `g (a ξ − g·(p_i − p_j))`: xx, yy, zz, xy, xz, yz; half of it for pairs with
/// ghosts.
fn virial_of_plane(PlanePairs { own, lists, .. }: &PlanePairs, p: &[Wide], noise: f64) -> [f64; 6] {
    let mut virial = [0.0; 6];
    for (list, share) in [(&lists.own, 1.0), (&lists.with_ghosts, 0.5)] {
        let PairList { start, stretch, xi, j_from, .. } = list;
        if stretch.is_empty() {
            continue;
        }
        for (i, of_i) in pairs_of_each(start) {
            for k in of_i {
                let (g, a, b) = (list.g(k), p[own.start + i], p[j_from + list.second(k)]);
                let along: f64 = (0..3).map(|c| (a[c] - b[c]) * g[c]).sum();
                let xi = xi.get(k).map_or(0.0, |xi| f64::from(*xi));
                add_virial(&mut virial, g, (noise * xi - along) * share * stretch[k]);
            }
        }
    }
    virial
}

/// Adds `factor g ⊗ g` to a virial.
pub fn add_virial(virial: &mut [f64; 6], g: [f64; 3], factor: f64) {
    for (w, (a, b)) in virial.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
        *w += factor * g[a] * g[b];
    }
}

/// The virial of all planes, in their order, times `factor`.
pub fn virial(pool: &Pool, planes: &[PlanePairs], sums: &Sums, noise: f64, factor: f64) -> [f64; 6] {
    let mut parts: Vec<_> = planes.iter().map(|plane| (plane, [0.0; 6])).collect();
    pool.each(&mut parts, |(plane, virial)| *virial = virial_of_plane(plane, &sums.p, noise));
    let mut sum = [0.0; 6];
    for (_, virial) in parts {
        (0..6).for_each(|c| sum[c] += factor * virial[c]);
    }
    sum
}

/// Fills an array in the order of cells with the values of the host's particles.
pub fn fill<T: Copy + Default + Send>(
    pool: &Pool,
    to: &mut Vec<T>,
    order: &[u32],
    value: impl Fn(usize) -> T + Sync,
) {
    to.resize(order.len(), T::default());
    each_with(pool, to, order, |to, k| *to = value(k));
}

/// Adds `factor` times sorted vectors to vectors in the order of the host, for particles that are not left out.
pub fn add_to_host(pool: &Pool, place: &[u32], from: &[Wide], factor: f64, to: &mut [[f64; 3]]) {
    each_of_host(pool, place, from, to, |to, from| (0..3).for_each(|c| to[c] += factor * from[c]));
}

/// Changes vectors in the order of the host by the sorted ones, for particles that are not left out.
pub fn each_of_host(
    pool: &Pool,
    place: &[u32],
    from: &[Wide],
    to: &mut [[f64; 3]],
    change: impl Fn(&mut [f64; 3], &Wide) + Sync,
) {
    each_with(pool, to, place, |to, place| {
        if let Some(from) = from.get(place) {
            change(to, from);
        }
    });
}

/// Does `work` with each element of an array and its number, divided among the threads.
fn each_with<T: Send>(pool: &Pool, to: &mut [T], numbers: &[u32], work: impl Fn(&mut T, usize) + Sync) {
    pool.parts(to, |first, to| {
        for (to, number) in to.iter_mut().zip(&numbers[first..]) {
            work(to, *number as usize);
        }
    });
}
