//! Every pair of particles within a distance, images included.

use psidpd_core::engine::{Images, PeriodicBox};

/// Two particles, the second perhaps an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The first.
    pub i: usize,
    /// The second.
    pub j: usize,
    /// `r_i − r_j`.
    pub d: [f64; 3],
    /// Its length.
    pub r: f64,
}

/// Calls `visit` with every pair closer than `cutoff`, each once, in an order that depends on `x` alone.
///
/// Positions lie in the box along its periodic directions. In boxes narrower than twice the cut-off a
/// particle may meet several images of another, and its own: each is a pair.
pub fn for_each_pair(
    x: &[[f64; 3]],
    domain: &PeriodicBox,
    dimensions: usize,
    cutoff: f64,
    mut visit: impl FnMut(Pair),
) {
    // Without a number greater than 0 there is nothing to find.
    if !(cutoff > 0.0 && cutoff.is_finite()) || x.is_empty() {
        return;
    }
    let mut all = x.to_vec();
    let mut images = Images::default();
    images.build(domain, dimensions, cutoff, x.len(), &mut all);
    let mut owner: Vec<u32> = (0..x.len() as u32).collect();
    images.forward(1, &mut owner);
    let grid = Grid::new(&all, dimensions, cutoff);
    for (i, here) in x.iter().enumerate() {
        grid.near(*here, |k| {
            let j = owner[k] as usize;
            if k == i || j < i {
                return;
            }
            let d: [f64; 3] = std::array::from_fn(|c| if c < dimensions { here[c] - all[k][c] } else { 0.0 });
            // Of a particle's images those at +d and −d are one pair.
            if i == j && d.iter().find(|c| **c != 0.0).is_none_or(|c| *c < 0.0) {
                return;
            }
            let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            if r < cutoff {
                visit(Pair { i, j, d, r });
            }
        });
    }
}

/// Points sorted into cells no narrower than the cut-off.
struct Grid {
    low: [f64; 3],
    width: [f64; 3],
    cells: [usize; 3],
    start: Vec<usize>,
    order: Vec<usize>,
}

impl Grid {
    fn new(x: &[[f64; 3]], dimensions: usize, cutoff: f64) -> Grid {
        let (mut low, mut high) = (x[0], x[0]);
        for p in x {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        let mut width = [cutoff; 3];
        let most = (4 * x.len() + 64) as f64;
        let count = |width: &[f64; 3], c: usize| {
            if c < dimensions { (((high[c] - low[c]) / width[c]).floor() + 1.0).min(most) } else { 1.0 }
        };
        // Far fewer points than cells, as around a runaway: wider cells.
        while (0..3).map(|c| count(&width, c)).product::<f64>() > most {
            width = width.map(|w| 2.0 * w);
        }
        let cells: [usize; 3] = std::array::from_fn(|c| count(&width, c) as usize);
        let mut grid = Grid { low, width, cells, start: Vec::new(), order: vec![0; x.len()] };
        let places: Vec<usize> = x.iter().map(|p| grid.index(grid.cell(*p))).collect();
        grid.start = vec![0; cells.iter().product::<usize>() + 1];
        for place in &places {
            grid.start[place + 1] += 1;
        }
        for k in 1..grid.start.len() {
            grid.start[k] += grid.start[k - 1];
        }
        let mut next = grid.start.clone();
        for (k, place) in places.into_iter().enumerate() {
            grid.order[next[place]] = k;
            next[place] += 1;
        }
        grid
    }

    fn cell(&self, p: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|c| (((p[c] - self.low[c]) / self.width[c]) as usize).min(self.cells[c] - 1))
    }

    fn index(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.cells[1] + cell[1]) * self.cells[0] + cell[0]
    }

    fn near(&self, p: [f64; 3], mut visit: impl FnMut(usize)) {
        let here = self.cell(p);
        let span = |c: usize| here[c].saturating_sub(1)..(here[c] + 2).min(self.cells[c]);
        for z in span(2) {
            for y in span(1) {
                let row = span(0);
                let (first, last) = (self.index([row.start, y, z]), self.index([row.end - 1, y, z]));
                self.order[self.start[first]..self.start[last + 1]].iter().for_each(|k| visit(*k));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    /// Every pair and image by brute force, as sorted (i, j, r).
    fn brute(
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        dimensions: usize,
        cutoff: f64,
    ) -> Vec<(usize, usize, f64)> {
        let shells = |k: usize| if k < dimensions && domain.periodic()[k] { 3 } else { 0i32 };
        let mut found = Vec::new();
        for i in 0..x.len() {
            for j in i..x.len() {
                for a in -shells(0)..=shells(0) {
                    for b in -shells(1)..=shells(1) {
                        for c in -shells(2)..=shells(2) {
                            if i == j && (a, b, c) <= (0, 0, 0) {
                                continue;
                            }
                            let s = [a as f64, b as f64, c as f64];
                            let r2: f64 = (0..dimensions)
                                .map(|m| {
                                    let shift: f64 = (0..3).map(|k| s[k] * domain.edge(k)[m]).sum();
                                    (x[i][m] - x[j][m] - shift).powi(2)
                                })
                                .sum();
                            if r2.sqrt() < cutoff {
                                found.push((i, j, r2.sqrt()));
                            }
                        }
                    }
                }
            }
        }
        found
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let mut rng = StdRng::seed_from_u64(5);
        let skew = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 3.0);
        let boxes = [
            (PeriodicBox::new([1.0, 2.0, 3.0], skew, [true; 3]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0; 3], [4.0, 3.0, 5.0], [true, false, true]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0, 0.0, -0.5], [4.0, 3.0, 1.0], [true; 3]).unwrap(), 2),
            (PeriodicBox::orthogonal([0.0; 3], [1.1, 6.0, 6.0], [true; 3]).unwrap(), 3),
        ];
        for (domain, dimensions) in boxes {
            let x: Vec<[f64; 3]> = (0..60)
                .map(|_| {
                    let mut p = domain.point(std::array::from_fn(|_| rng.random::<f64>()));
                    if dimensions == 2 {
                        p[2] = 0.0;
                    }
                    p
                })
                .collect();
            for cutoff in [0.7, 1.3, 2.4] {
                let mut found = Vec::new();
                for_each_pair(&x, &domain, dimensions, cutoff, |p| found.push((p.i, p.j, p.r)));
                let key = |a: &(usize, usize, f64), b: &(usize, usize, f64)| {
                    (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
                };
                let mut expected = brute(&x, &domain, dimensions, cutoff);
                found.sort_by(key);
                expected.sort_by(key);
                assert_eq!(found.len(), expected.len());
                for (a, b) in found.iter().zip(&expected) {
                    assert!(a.0 == b.0 && a.1 == b.1 && (a.2 - b.2).abs() < 1e-12);
                }
            }
        }
        for_each_pair(
            &[],
            &PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [true; 3]).unwrap(),
            3,
            1.0,
            |_| panic!(),
        );
    }
}
