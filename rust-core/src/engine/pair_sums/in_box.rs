//! Finds every pair of particles in a box, images included.

use super::search::CellSearch;
use crate::engine::images::Images;
use psidpd_passes::domain::PeriodicBox;

/// Two particles, the second perhaps an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index of the first particle.
    pub i: usize,
    /// Index of the second particle; of the owner, if it is an image.
    pub j: usize,
    /// Separation `r_i − r_j`.
    pub d: [f64; 3],
    /// Distance, the length of `d`.
    pub r: f64,
}

/// Finds the pairs in a box of any width: images are points of the cell search.
#[derive(Debug, Clone, Default)]
pub struct BoxSearch {
    cells: CellSearch,
    images: Images,
    /// Particles, wrapped into the box, and their images.
    x: Vec<[f64; 3]>,
}

impl BoxSearch {
    /// Calls `visit` with `i`, `j` and `r_i − r_j` of every pair closer than `cutoff`, each once, in an order
    /// that depends on the positions alone. `i ≤ j`; a pair of a particle with its own image has `i = j`.
    ///
    /// In boxes narrower than twice the cut-off a particle may be near several images of another, and
    /// its own: each is a pair. Particles after the first `owned` are ghosts: two ghosts form no pair.
    /// Interacting particles must have finite positions.
    #[expect(clippy::too_many_arguments)] // A search is of all that it goes over.
    pub fn find(
        &mut self,
        x: &[[f64; 3]],
        owned: usize,
        takes_part: impl Fn(usize) -> bool,
        domain: &PeriodicBox,
        dimensions: usize,
        cutoff: f64,
        mut visit: impl FnMut(usize, usize, [f64; 3]),
    ) {
        // Without a positive, finite cut-off there are no pairs.
        if !(cutoff > 0.0 && cutoff.is_finite()) {
            return;
        }
        let BoxSearch { cells, images, x: all } = self;
        all.clear();
        all.extend_from_slice(x);
        all.iter_mut().enumerate().filter(|(k, _)| takes_part(*k)).for_each(|(_, x)| {
            domain.wrap(x, &mut [0; 3]);
        });
        let count = x.len();
        images.build(domain, dimensions, cutoff, count, all);
        cells.find(
            all,
            count,
            |k| takes_part(images.owner_of(k)),
            dimensions,
            cutoff,
            |a, b, d| {
                let (i, j, d) = if a < count { (a, b, d) } else { (b, a, d.map(|c| -c)) };
                let owner = images.owner_of(j);
                // Each of two particles is near an image of the other: one of these two pairs counts,
                // and so does one of a particle's own images at +d and −d.
                let (i, j, d) = match (j < count, i.cmp(&owner)) {
                    (true, std::cmp::Ordering::Greater) => (j, i, d.map(|c| -c)),
                    (true, _) => (i, j, d),
                    (false, std::cmp::Ordering::Less) => (i, owner, d),
                    (false, std::cmp::Ordering::Equal) if is_first(d) => (i, i, d),
                    (false, _) => return,
                };
                if i < owned {
                    visit(i, j, d);
                }
            },
        );
    }
}

/// Whether `d` comes first: this holds for exactly one of `d` and `−d`.
fn is_first(d: [f64; 3]) -> bool {
    d.iter().find(|c| **c != 0.0).is_some_and(|c| *c > 0.0)
}

/// Calls `visit` with every pair of particles with finite positions closer than a cutoff, each once,
/// and its distance; in boxes narrower than twice the cutoff every image within reach forms a pair.
pub fn for_each_pair(
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    dimensions: usize,
    cutoff: f64,
    mut visit: impl FnMut(Pair),
) {
    let finite = |k: usize| x[k].iter().all(|c| c.is_finite());
    BoxSearch::default().find(x, x.len(), finite, domain, dimensions, cutoff, |i, j, d| {
        let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        visit(Pair { i, j, d, r });
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use psidpd_passes::noise::threefry2x32;

    /// Finds every pair by the definition: every particle with every image of every other.
    ///
    /// Particles must lie in the box along its periodic directions.
    fn for_each_pair_by_brute_force(
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        dimensions: usize,
        cutoff: f64,
        mut visit: impl FnMut(Pair),
    ) {
        // Particles inside the box are at most this many boxes from their nearest images.
        let shells = [0, 1, 2].map(|k| {
            if domain.periodic()[k] && k < dimensions {
                (cutoff / domain.height(k)).ceil() as i32 + 1
            } else {
                0
            }
        });
        let range = |k: usize| -shells[k]..=shells[k];
        for (i, j) in (0..x.len()).flat_map(|i| (i..x.len()).map(move |j| (i, j))) {
            for (a, b, c) in
                range(0).flat_map(|a| range(1).flat_map(move |b| range(2).map(move |c| (a, b, c))))
            {
                // A particle's own images +s and −s are one pair.
                if i == j && (a, b, c) <= (0, 0, 0) {
                    continue;
                }
                let shift = [a, b, c].map(f64::from);
                let d: [f64; 3] = std::array::from_fn(|m| {
                    let image: f64 = (0..3).map(|k| shift[k] * domain.edge(k)[m]).sum();
                    if m < dimensions { x[i][m] - x[j][m] + image } else { 0.0 }
                });
                let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                if r < cutoff {
                    visit(Pair { i, j, d, r });
                }
            }
        }
    }

    /// The difference of the farthest positions is beyond all numbers.
    #[test]
    fn particles_at_the_ends_of_all_numbers_hide_no_pair() {
        let open = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [false; 3]).unwrap();
        let x = [[-1.7e308; 3], [0.1, 0.2, 0.3], [1.7e308; 3], [0.1, 0.2, 0.8]];
        let mut found = Vec::new();
        for_each_pair(&x, &open, 3, 1.0, |p| found.push((p.i, p.j, p.r)));
        assert_eq!(found, [(1, 3, 0.5)]);
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let skew = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 3.0);
        let boxes = [
            (PeriodicBox::new([1.0, 2.0, 3.0], skew, [true; 3]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0; 3], [4.0, 3.0, 5.0], [true, false, true]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0, 0.0, -0.5], [4.0, 3.0, 1.0], [true; 3]).unwrap(), 2),
            (PeriodicBox::orthogonal([0.0; 3], [1.1, 6.0, 6.0], [true; 3]).unwrap(), 3),
        ];
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0;
        for (domain, dimensions) in boxes {
            let x: Vec<[f64; 3]> = (0..60)
                .map(|k| {
                    let mut p = domain.point([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2)]);
                    if dimensions == 2 {
                        p[2] = 0.0;
                    }
                    p
                })
                .collect();
            // The search wraps particles into the box itself.
            let mut outside = x.clone();
            for (k, x) in outside.iter_mut().enumerate() {
                let boxes = [k as f64 % 3.0 - 1.0, 0.0, 0.0];
                (0..3).for_each(|c| x[c] += boxes[0] * domain.edge(0)[c]);
            }
            for cutoff in [0.7, 1.3, 2.4] {
                let (mut found, mut expected) = (Vec::new(), Vec::new());
                for_each_pair(&outside, &domain, dimensions, cutoff, |p| found.push(p));
                for_each_pair_by_brute_force(&x, &domain, dimensions, cutoff, |p| expected.push(p));
                let key = |a: &Pair, b: &Pair| (a.i, a.j).cmp(&(b.i, b.j)).then(a.r.total_cmp(&b.r));
                found.sort_by(key);
                expected.sort_by(key);
                assert_eq!(found.len(), expected.len());
                for (a, b) in found.iter().zip(&expected) {
                    assert!((a.i, a.j) == (b.i, b.j) && (a.r - b.r).abs() < 1e-12, "{a:?} {b:?}");
                    let length = a.d.iter().map(|c| c * c).sum::<f64>().sqrt();
                    assert!((length - a.r).abs() < 1e-12);
                }
            }
        }
        let domain = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [true; 3]).unwrap();
        for_each_pair(&[], &domain, 3, 1.0, |_| panic!());
        for_each_pair(&[[f64::NAN; 3], [0.5; 3]], &domain, 3, 0.9, |_| panic!());
    }
}
