//! Clusters of particles that are closer than a distance, and the choice of that distance.

use super::rdf::shell_volume;
use super::{Deserialize, FileError, Need, Options, PeriodicBox, Serialize, ValueKind};
use crate::frame::Frame;
use crate::keys::{Key, key};
use psidpd_core::engine::pair_sums::{Pair, for_each_pair};

/// Sets that are joined pair by pair (union-find). Each member has the vector to its parent.
struct Union {
    parent: Vec<usize>,
    /// The vector from the parent to the member, across periodic images.
    way: Vec<[f64; 3]>,
    /// For roots: true if the set meets its own image.
    percolates: Vec<bool>,
}

impl Union {
    fn root(&mut self, k: usize) -> usize {
        let (mut root, mut way) = (k, [0.0; 3]);
        while self.parent[root] != root {
            way = sum(way, self.way[root]);
            root = self.parent[root];
        }
        // All members on this path get the root as their parent.
        let mut k = k;
        while self.parent[k] != root && k != root {
            let (next, own) = (self.parent[k], self.way[k]);
            (self.parent[k], self.way[k]) = (root, way);
            way = sum(way, own.map(|c| -c));
            k = next;
        }
        root
    }

    /// Joins the sets of `a` and `b`; `d` is the vector from `b` to `a`.
    fn join(&mut self, a: usize, b: usize, d: [f64; 3]) {
        let (ra, rb) = (self.root(a), self.root(b));
        let from_root = |u: &Union, k: usize, root: usize| if k == root { [0.0; 3] } else { u.way[k] };
        let (wa, wb) = (from_root(self, a, ra), from_root(self, b, rb));
        // The vector from the root of b to the root of a.
        let between: [f64; 3] = std::array::from_fn(|c| wb[c] + d[c] - wa[c]);
        if ra == rb {
            // Two vectors to the same particle differ by edges of the box or by rounding.
            let apart = between.iter().map(|c| c * c).sum::<f64>().sqrt();
            let length = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            self.percolates[ra] |= apart > 1e-3 * length + 1e-9;
            return;
        }
        // The smaller index becomes the root, so that roots do not depend on the order of pairs.
        let (first, second, way) = if ra < rb { (ra, rb, between.map(|c| -c)) } else { (rb, ra, between) };
        self.parent[second] = first;
        self.way[second] = way;
        self.percolates[first] |= self.percolates[second];
    }
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}

pub(super) struct Linked {
    /// For each particle, the first member of its cluster; `None` for particles that do not take part.
    pub labels: Vec<Option<usize>>,
    /// For each cluster, the number of its members.
    pub sizes: Vec<usize>,
    /// For each cluster: true if it crosses the periodic box and meets its own image.
    pub percolates: Vec<bool>,
}

impl Linked {
    /// Links particles of a frame that are closer than `distance`.
    pub fn of(frame: &Frame, distance: f64, takes_part: impl Fn(usize) -> bool) -> Linked {
        Linked::new(frame.view.x.len(), takes_part, |join| frame.for_each_pair(distance, join))
    }

    /// Links the particles of each pair with which `pairs` calls its argument, of `n` particles.
    pub fn new(
        n: usize,
        takes_part: impl Fn(usize) -> bool,
        pairs: impl FnOnce(&mut dyn FnMut(Pair)),
    ) -> Linked {
        let mut union =
            Union { parent: (0..n).collect(), way: vec![[0.0; 3]; n], percolates: vec![false; n] };
        pairs(&mut |p| {
            if takes_part(p.i) && takes_part(p.j) {
                union.join(p.i, p.j, p.d);
            }
        });
        let labels: Vec<_> = (0..n).map(|k| takes_part(k).then(|| union.root(k))).collect();
        let mut sizes = vec![0; n];
        labels.iter().flatten().for_each(|k| sizes[*k] += 1);
        Linked { labels, sizes, percolates: union.percolates }
    }

    /// The largest cluster; of several equal ones the first.
    pub fn largest(&self) -> Option<usize> {
        (0..self.sizes.len()).max_by_key(|k| (self.sizes[*k], usize::MAX - k))
    }

    pub fn is_in(&self, particle: usize, cluster: usize) -> bool {
        self.labels[particle] == Some(cluster)
    }
}

pub(super) const DISTANCE: Key = key(
    "distance",
    ValueKind::HalfBox,
    Need::Default(
        "chosen at the first sample: (2/ρ)^(1/3), in two dimensions (2.5/ρ)^(1/2), with the density ρ in the densest tenth; at most the longest range of a conservative interaction",
    ),
    "Particles closer than this are of one cluster.",
    "0.8",
);

/// The value ρ δ^d of linked particles of density ρ. It is above the percolation threshold 0.65 (1.44 in two dimensions) of
/// random particles, so that a liquid is one cluster. It is small enough that a vapour of a third (half) of the density
/// of the liquid falls apart.
const LINKED: [f64; 2] = [2.5, 2.0];

/// The distance that defines clusters, given or chosen at the first sample.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Distance {
    given: Option<f64>,
    chosen: Option<f64>,
    /// The longest distance that may be chosen.
    longest: f64,
}

impl Distance {
    pub fn read(options: &Options) -> Result<Distance, FileError> {
        let fluid = options.place.fluid;
        let range = fluid.conservative_range();
        let preset = if range > 0.0 { range } else { fluid.cutoff() };
        let longest = if preset > 0.0 { preset } else { 1.0 }.min(options.half_box());
        Ok(Distance { given: options.within_half_box("distance")?, chosen: None, longest })
    }

    #[cfg(test)]
    pub fn given(value: f64) -> Distance {
        Distance { given: Some(value), chosen: None, longest: value }
    }

    pub fn value(&self) -> Option<f64> {
        self.given.or(self.chosen)
    }

    pub fn forget(&mut self) {
        self.chosen = None;
    }

    /// The distance. Unless it was given, the first call chooses it for all later calls.
    pub fn at(
        &mut self,
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        dimensions: usize,
        takes_part: impl Fn(usize) -> bool,
    ) -> f64 {
        if let Some(value) = self.value() {
            return value;
        }
        let mut neighbours = vec![0usize; x.len()];
        for_each_pair(x, domain, dimensions, self.longest, |p| {
            if takes_part(p.i) && takes_part(p.j) {
                neighbours[p.i] += 1;
                neighbours[p.j] += 1;
            }
        });
        let counts = (0..x.len()).filter(|k| takes_part(*k)).map(|k| neighbours[k]).collect();
        let density = density_of_densest_tenth(counts, dimensions, self.longest);
        let linked = (LINKED[dimensions - 2] / density).powf(1.0 / dimensions as f64);
        *self.chosen.insert(linked.min(self.longest))
    }
}

/// The number density around the particles of the densest tenth, of which `counts` has the numbers of others within `range`.
pub(crate) fn density_of_densest_tenth(mut counts: Vec<usize>, dimensions: usize, range: f64) -> f64 {
    counts.sort_unstable();
    let dense = counts.get(counts.len() * 9 / 10).copied().unwrap_or(0) as f64;
    dense / shell_volume(dimensions, 0.0, range)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng, seq::SliceRandom};

    fn link(
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        distance: f64,
        takes_part: impl Fn(usize) -> bool,
    ) -> Linked {
        Linked::new(x.len(), takes_part, |join| for_each_pair(x, domain, 3, distance, join))
    }

    /// A chain through the boundary, a ring and single particles, in any order.
    #[test]
    fn constructed_clusters() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [10.0; 3], [true; 3]).unwrap();
        let chain = (0..12).map(|k| [(6.0 + 0.5 * f64::from(k)).rem_euclid(10.0), 1.0, 1.0]);
        let ring = (0..8).map(|k| {
            let a = f64::from(k) * std::f64::consts::TAU / 8.0;
            [5.0 + 0.7 * a.cos(), 5.0 + 0.7 * a.sin(), 5.0]
        });
        let single = (0..3).map(|k| [2.0, 8.0, 2.0 + 2.0 * f64::from(k)]);
        let mut all: Vec<([f64; 3], usize)> = chain.map(|x| (x, 0)).collect();
        all.extend(ring.map(|x| (x, 1)));
        all.extend(single.enumerate().map(|(k, x)| (x, 2 + k)));
        let mut rng = StdRng::seed_from_u64(2);
        for _ in 0..20 {
            all.shuffle(&mut rng);
            let x: Vec<[f64; 3]> = all.iter().map(|a| a.0).collect();
            let linked = link(&x, &domain, 0.6, |_| true);
            for (i, a) in all.iter().enumerate() {
                for (j, b) in all.iter().enumerate() {
                    assert_eq!(linked.labels[i] == linked.labels[j], a.1 == b.1);
                }
            }
            let mut found: Vec<usize> = linked.sizes.iter().copied().filter(|n| *n > 0).collect();
            found.sort_unstable();
            assert_eq!(found, [1, 1, 1, 8, 12]);
            // The chain crosses a face of the box and the ring is closed, but neither meets its image.
            assert!(linked.percolates.iter().all(|p| !p));
            // Without its seventh particle the chain is two clusters, and that particle is in no cluster.
            let cut = all.iter().position(|a| (a.0[0] - 8.0).abs() < 1e-9 && a.1 == 0).unwrap();
            let linked = link(&x, &domain, 0.6, |k| k != cut);
            assert_eq!(linked.labels[cut], None);
            assert_eq!(linked.sizes.iter().filter(|n| **n > 3).count(), 3);
        }
    }

    /// A line of particles across the whole box meets itself; without one of them it does not.
    #[test]
    fn a_cluster_that_meets_its_image_percolates() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [10.0; 3], [true; 3]).unwrap();
        let mut rng = StdRng::seed_from_u64(3);
        for _ in 0..20 {
            let mut x: Vec<[f64; 3]> = (0..20).map(|k| [5.0, 0.5 * f64::from(k), 5.0]).collect();
            x.shuffle(&mut rng);
            let linked = link(&x, &domain, 0.6, |_| true);
            assert!(linked.largest().is_some_and(|k| linked.percolates[k]));
            let cut = link(&x[1..], &domain, 0.6, |_| true);
            assert!(cut.largest().is_some_and(|k| !cut.percolates[k] && cut.sizes[k] == 19));
        }
    }

    /// Every particle of a lattice has the same number of neighbours: 56 within 2.4 spacings in space, 20 in the plane. The
    /// chosen distance is (2/ρ)^(1/3), in two dimensions (2.5/ρ)^(1/2).
    #[test]
    fn the_chosen_distance_of_a_lattice() {
        use std::f64::consts::PI;
        let volume = [PI * 1.2f64.powi(2), 4.0 / 3.0 * PI * 1.2f64.powi(3)];
        for (dimensions, expected) in
            [(2, (2.5 * volume[0] / 20.0).sqrt()), (3, (2.0 * volume[1] / 56.0).cbrt())]
        {
            let edge = if dimensions == 2 { 1.0 } else { 4.0 };
            let domain =
                PeriodicBox::orthogonal([0.0; 3], [4.0, 4.0, edge], [true, true, dimensions == 3]).unwrap();
            let layers = if dimensions == 2 { 1 } else { 8 };
            let x: Vec<[f64; 3]> =
                (0..64 * layers).map(|k| [k % 8, k / 8 % 8, k / 64].map(|c| 0.5 * f64::from(c))).collect();
            let mut distance = Distance { given: None, chosen: None, longest: 1.2 };
            let chosen = distance.at(&x, &domain, dimensions, |_| true);
            assert!((chosen - expected).abs() < 1e-12, "{dimensions}: {chosen} {expected}");
        }
    }

    /// For a dense ball in a thin gas, the chosen distance links the ball and not the gas.
    #[test]
    fn the_chosen_distance_tells_liquid_from_vapour() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [12.0; 3], [true; 3]).unwrap();
        let mut rng = StdRng::seed_from_u64(4);
        let mut x = Vec::new();
        let mut random = || std::array::from_fn(|_| 12.0 * rng.random::<f64>());
        while x.len() < 600 {
            let p: [f64; 3] = random();
            if p.iter().map(|c| (c - 6.0).powi(2)).sum::<f64>() < 9.0 {
                x.push(p);
            }
        }
        let inside = x.len();
        x.extend((0..400).map(|_| random()));
        let fluid_range = 1.8;
        let mut distance = Distance { given: None, chosen: None, longest: fluid_range };
        let chosen = distance.at(&x, &domain, 3, |_| true);
        // The ball has ρ = 5.3, and more in its densest tenth.
        assert!(chosen > 0.55 && chosen < 0.8, "{chosen}");
        assert_eq!(distance.at(&x[..10], &domain, 3, |_| true), chosen);
        let linked = link(&x, &domain, chosen, |_| true);
        let drop = linked.largest().unwrap();
        let members = (0..inside).filter(|k| linked.is_in(*k, drop)).count();
        assert!(members > 590 && linked.sizes[drop] < 680, "{members} {}", linked.sizes[drop]);
        assert!(!linked.percolates[drop]);
        // The range of the interaction, the obvious distance, links everything.
        let wide = link(&x, &domain, fluid_range, |_| true);
        assert!(wide.largest().is_some_and(|k| wide.sizes[k] > 950 && wide.percolates[k]));
    }
}
