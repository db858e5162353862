//! The region in which a particle needs neither wrapping nor reflection, and the walls around it.

use super::walls::Walls;
use psidpd_core::engine::PeriodicBox;

/// The inside of a box: the coordinates that [`PeriodicBox::wrap`] does not change along periodic directions,
/// and those between walls along the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    /// The lowest and the highest coordinate inside. A tilted box has no such interval, so none of its
    /// coordinates count as inside.
    pub low: [f64; 3],
    pub high: [f64; 3],
    pub walls: Walls,
}

/// Number of floating-point numbers below the upper face that are tried.
const TRIES: usize = 64;

impl Bounds {
    pub fn of(domain: &PeriodicBox, dimensions: usize) -> Bounds {
        let walls = Walls::of(domain, dimensions);
        let mut bounds = Bounds { low: [f64::NEG_INFINITY; 3], high: [f64::INFINITY; 3], walls };
        let origin = domain.origin();
        let edges = [0, 1, 2].map(|k| domain.edge(k));
        let leans = (0..3).any(|k| (0..3).any(|c| c != k && edges[k][c] != 0.0));
        for k in 0..3 {
            if let Some([low, high]) = walls.faces()[k] {
                (bounds.low[k], bounds.high[k]) = (low, high);
            } else if domain.periodic()[k] {
                (bounds.low[k], bounds.high[k]) = match leans {
                    true => (f64::INFINITY, f64::NEG_INFINITY),
                    false => (origin[k], last_inside(domain, k, origin[k] + edges[k][k])),
                };
            }
        }
        bounds
    }
}

/// The highest coordinate, not above `end`, whose fraction of an edge is below 1; the box has edges along the axes.
/// Rounding decides which coordinate that is. Rounding preserves order, so all lower coordinates are inside too.
fn last_inside(domain: &PeriodicBox, k: usize, mut end: f64) -> f64 {
    let mut point = domain.origin();
    for _ in 0..TRIES {
        point[k] = end;
        if domain.fraction(point)[k] < 1.0 {
            return end;
        }
        end = end.next_down();
    }
    f64::NEG_INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn inside_is_where_nothing_is_wrapped() {
        for (origin, length) in
            [(0.0, 10.0), (-3.7, 7.3), (1e6, 0.3), (-1e-9, 1.0 / 3.0), (0.0, 6050.0f64.cbrt())]
        {
            let domain = PeriodicBox::orthogonal([origin; 3], [length; 3], [true; 3]).unwrap();
            let bounds = Bounds::of(&domain, 3);
            for k in 0..3 {
                let wraps = |c: f64| {
                    let (mut x, mut image) = ([origin; 3], [0; 3]);
                    x[k] = c;
                    domain.wrap(&mut x, &mut image);
                    image != [0; 3]
                };
                assert!((bounds.high[k] - origin - length).abs() < 1e-9 * length.max(origin.abs()));
                assert!(!wraps(bounds.low[k]) && !wraps(bounds.high[k]), "{origin} {length}");
                assert!(wraps(bounds.high[k].next_up()) && wraps(bounds.low[k] - 1e-3 * length));
            }
        }
    }

    #[test]
    fn open_directions_have_no_end_and_boxes_that_lean_no_inside() {
        let domain = PeriodicBox::orthogonal([1.0; 3], [2.0; 3], [true, false, false]).unwrap();
        let bounds = Bounds::of(&domain, 2);
        assert_eq!(
            (bounds.low, bounds.high[1..].to_vec()),
            ([1.0, 1.0, f64::NEG_INFINITY], vec![3.0, f64::INFINITY])
        );
        let edges = Matrix3::new(4.0, 1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 6.0);
        let bounds = Bounds::of(&PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap(), 3);
        assert!((0..3).all(|k| bounds.low[k] > bounds.high[k]));
    }
}
