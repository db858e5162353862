use crate::scene::Lattice;
use crate::scene::shape::Shape;

/// The unit cell of a lattice: relative lengths of its edges, and its sites in fractions of the edges.
struct Cell {
    edges: [f64; 3],
    sites: &'static [[f64; 3]],
}

fn cell(lattice: Lattice) -> Cell {
    const HEXAGON: f64 = 1.732_050_807_568_877_2;
    // Sites lie symmetrically in the cell, so that a lattice fits a block with equal margins at opposite faces.
    let (edges, sites): (_, &[[f64; 3]]) = match lattice {
        Lattice::Simple => ([1.0; 3], &[[0.5, 0.5, 0.5]]),
        Lattice::Bcc => ([1.0; 3], &[[0.25, 0.25, 0.25], [0.75, 0.75, 0.75]]),
        Lattice::Fcc => {
            ([1.0; 3], &[[0.25, 0.25, 0.25], [0.25, 0.75, 0.75], [0.75, 0.25, 0.75], [0.75, 0.75, 0.25]])
        }
        Lattice::Hexagonal => ([1.0, HEXAGON, 1.0], &[[0.25, 0.25, 0.5], [0.75, 0.75, 0.5]]),
    };
    Cell { edges, sites }
}

/// Returns `count` sites of a lattice in `shape`; vacancies are spread evenly.
pub fn points(lattice: Lattice, count: usize, shape: &Shape, dimensions: usize) -> Vec<[f64; 3]> {
    let cell = cell(lattice);
    let sites = match shape {
        Shape::Block { low, high } => in_block(&cell, count, *low, *high, dimensions),
        _ => in_shape(&cell, count, shape, dimensions),
    };
    let total = sites.len() as u128;
    (0..count).map(|k| sites[(k as u128 * total / count as u128) as usize]).collect()
}

/// The sites of whole cells that fill a block, at least `count`. Cells keep their proportions as nearly as
/// whole numbers allow.
fn in_block(cell: &Cell, count: usize, low: [f64; 3], high: [f64; 3], dimensions: usize) -> Vec<[f64; 3]> {
    let lengths: [f64; 3] = std::array::from_fn(|k| high[k] - low[k]);
    let cells = cells(cell, count, lengths, dimensions);
    let mut sites = Vec::with_capacity(cells.iter().product::<usize>() * cell.sites.len());
    for_cells(cells, |at| {
        for site in cell.sites {
            sites.push(std::array::from_fn(|c| {
                low[c] + lengths[c] * (at[c] as f64 + site[c]) / cells[c] as f64
            }));
        }
    });
    sites
}

/// Numbers of cells along the edges, with at least `count` sites in total.
fn cells(cell: &Cell, count: usize, lengths: [f64; 3], dimensions: usize) -> [usize; 3] {
    let per_cell = cell.sites.len();
    let ratio = |k: usize| lengths[k] / cell.edges[k];
    let volume: f64 = (0..dimensions).map(ratio).product();
    let spacing = (volume * per_cell as f64 / count as f64).powf(1.0 / dimensions as f64);
    let mut cells = [1; 3];
    for k in 0..dimensions {
        cells[k] = ((ratio(k) / spacing).round() as usize).clamp(1, count);
    }
    while cells.iter().product::<usize>() * per_cell < count {
        let gap = |k: &usize| ratio(*k) / cells[*k] as f64;
        let widest = (0..dimensions).max_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(0);
        cells[widest] += 1;
    }
    cells
}

/// The sites inside a shape, of the widest lattice (within 1 %) with at least `count` sites there.
fn in_shape(cell: &Cell, count: usize, shape: &Shape, dimensions: usize) -> Vec<[f64; 3]> {
    let [low, high] = shape.bounds(dimensions);
    let aspect: f64 = cell.edges[..dimensions].iter().product();
    let per_cell = shape.volume(dimensions) * cell.sites.len() as f64 / (count as f64 * aspect);
    // The search begins with a spacing 5 % too wide: more sites than the volume suggests may lie inside.
    let mut spacing = 1.05 * per_cell.powf(1.0 / dimensions as f64);
    loop {
        let edge = cell.edges.map(|e| e * spacing);
        let cells: [usize; 3] = std::array::from_fn(|k| match k < dimensions {
            true => ((high[k] - low[k]) / edge[k]).ceil().max(1.0) as usize,
            false => 1,
        });
        let mut sites = Vec::new();
        for_cells(cells, |at| {
            for site in cell.sites {
                let x = std::array::from_fn(|c| {
                    0.5 * (low[c] + high[c]) + edge[c] * (at[c] as f64 + site[c] - 0.5 * cells[c] as f64)
                });
                if shape.contains(x, dimensions) {
                    sites.push(x);
                }
            }
        });
        if sites.len() >= count {
            return sites;
        }
        spacing *= 0.99;
    }
}

fn for_cells(cells: [usize; 3], mut each: impl FnMut([usize; 3])) {
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                each([x, y, z]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(high: [f64; 3]) -> Shape {
        Shape::Block { low: [0.0; 3], high }
    }

    #[test]
    fn sites_are_distinct_and_near_cubic() {
        let simple = cell(Lattice::Simple);
        assert_eq!(cells(&simple, 1000, [10.0; 3], 3), [10; 3]);
        assert_eq!(cells(&simple, 1001, [10.0; 3], 3).iter().max(), Some(&11));
        assert_eq!(cells(&simple, 50, [10.0, 5.0, 1.0], 2), [10, 5, 1]);
        let mut all = points(Lattice::Simple, 1234, &block([7.0, 9.0, 11.0]), 3);
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all.dedup();
        assert_eq!(all.len(), 1234);
    }

    /// The lattices have their known nearest distances at density 1, in periodic boxes that they fit closely.
    #[test]
    fn lattices_have_their_nearest_distances() {
        let cases = [
            (Lattice::Simple, 3, 512, [8.0; 3], 1.0),
            (Lattice::Bcc, 3, 2 * 343, [8.819_447; 3], 0.75f64.sqrt() * 2f64.cbrt()),
            (Lattice::Fcc, 3, 4 * 125, [7.937_005; 3], 0.5f64.sqrt() * 4f64.cbrt()),
            (Lattice::Hexagonal, 2, 480, [21.491_4, 22.335_4, 0.0], (2.0 / 3f64.sqrt()).sqrt()),
        ];
        for (lattice, dimensions, count, lengths, expected) in cases {
            let x = points(lattice, count, &block(lengths), dimensions);
            let mut nearest = f64::INFINITY;
            for a in 0..x.len() {
                for b in 0..a {
                    let d: f64 = (0..dimensions)
                        .map(|k| {
                            let d = x[a][k] - x[b][k];
                            (d - lengths[k] * (d / lengths[k]).round()).powi(2)
                        })
                        .sum();
                    nearest = nearest.min(d.sqrt());
                }
            }
            assert!((nearest - expected).abs() < 0.01 * expected, "{lattice:?}: {nearest}, not {expected}");
        }
    }

    #[test]
    fn a_ball_has_as_many_sites_as_wanted_all_inside() {
        let ball = Shape::Sphere { center: [4.0, 5.0, 6.0], radius: 3.0 };
        for count in [1, 2, 10, 777] {
            let x = points(Lattice::Fcc, count, &ball, 3);
            assert!(x.len() == count && x.iter().all(|x| ball.contains(*x, 3)));
        }
    }
}
