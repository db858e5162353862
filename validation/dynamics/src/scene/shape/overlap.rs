//! Exact tests whether the interiors of two regions overlap, for every pair of kinds.

use super::Shape;

/// Depth, as a share of a length, that counts as touching: rounding can overlap regions that are meant to touch.
const TOUCH: f64 = 1e-9;

impl Shape {
    /// Whether the two regions overlap. A region of kind `Rest` overlaps with nothing.
    pub fn overlaps(&self, other: &Shape, dimensions: usize) -> bool {
        use Shape::{Block, Cylinder, Rest, Sphere};
        match (self, other) {
            (Rest { .. }, _) | (_, Rest { .. }) => false,
            (Block { low: a, high: b }, Block { low: c, high: d }) => {
                (0..dimensions).all(|k| less(a[k].max(c[k]), b[k].min(d[k])))
            }
            (Sphere { center, radius }, Block { low, high })
            | (Block { low, high }, Sphere { center, radius }) => {
                let away = (0..dimensions).map(|k| beyond(center[k], low[k], high[k]));
                less(norm(away), *radius)
            }
            (Sphere { center: a, radius: r }, Sphere { center: b, radius: s }) => {
                less(norm((0..dimensions).map(|k| a[k] - b[k])), r + s)
            }
            (Cylinder { axis, center, radius, length }, Sphere { center: b, radius: s })
            | (Sphere { center: b, radius: s }, Cylinder { axis, center, radius, length }) => {
                let across = norm((0..3).filter(|k| k != axis).map(|k| b[k] - center[k]));
                let along = ((b[*axis] - center[*axis]).abs() - 0.5 * length).max(0.0);
                less(along.hypot((across - radius).max(0.0)), *s)
            }
            (Cylinder { axis, center, radius, length }, Block { low, high })
            | (Block { low, high }, Cylinder { axis, center, radius, length }) => {
                let away = (0..3).filter(|k| k != axis).map(|k| beyond(center[k], low[k], high[k]));
                let [from, to] = [center[*axis] - 0.5 * length, center[*axis] + 0.5 * length];
                less(norm(away), *radius) && less(from.max(low[*axis]), to.min(high[*axis]))
            }
            (
                Cylinder { axis: i, center: a, radius: r, length: l },
                Cylinder { axis: j, center: b, radius: s, length: m },
            ) if i == j => {
                let across = norm((0..3).filter(|k| k != i).map(|k| a[k] - b[k]));
                less(across, r + s) && less((a[*i] - b[*i]).abs(), 0.5 * (l + m))
            }
            (
                Cylinder { axis: i, center: a, radius: r, length: l },
                Cylinder { axis: j, center: b, radius: s, length: m },
            ) => {
                // Direction k is normal to both axes: each interval along k holds the points of one cylinder
                // that lie within the length of the other.
                let k = 3 - i - j;
                let reach = |radius: f64, away: f64| (radius * radius - away * away).max(0.0).sqrt();
                let first = reach(*r, beyond(a[*j], b[*j] - 0.5 * m, b[*j] + 0.5 * m));
                let second = reach(*s, beyond(b[*i], a[*i] - 0.5 * l, a[*i] + 0.5 * l));
                first > 0.0 && second > 0.0 && less((a[k] - b[k]).abs(), first + second)
            }
        }
    }
}

fn less(a: f64, b: f64) -> bool {
    a < b - TOUCH * (a.abs() + b.abs())
}

/// The distance of `x` from an interval; 0 inside.
fn beyond(x: f64, low: f64, high: f64) -> f64 {
    (low - x).max(x - high).max(0.0)
}

fn norm(components: impl Iterator<Item = f64>) -> f64 {
    components.map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shapes() -> impl Strategy<Value = Shape> {
        let point = || prop::array::uniform3(0.0..6.0f64);
        let size = || 0.3..2.0f64;
        prop_oneof![
            (point(), prop::array::uniform3(0.3..3.0f64))
                .prop_map(|(low, e)| Shape::Block { low, high: std::array::from_fn(|k| low[k] + e[k]) }),
            (point(), size()).prop_map(|(center, radius)| Shape::Sphere { center, radius }),
            (0usize..3, point(), size(), 0.3..4.0f64)
                .prop_map(|(axis, center, radius, length)| Shape::Cylinder { axis, center, radius, length }),
        ]
    }

    /// The nearest point of a convex shape.
    fn nearest(shape: &Shape, x: [f64; 3]) -> [f64; 3] {
        match shape {
            Shape::Block { low, high } => std::array::from_fn(|k| x[k].clamp(low[k], high[k])),
            Shape::Sphere { center, radius } => {
                let d = norm((0..3).map(|k| x[k] - center[k]));
                let scale = if d > *radius { radius / d } else { 1.0 };
                std::array::from_fn(|k| center[k] + scale * (x[k] - center[k]))
            }
            Shape::Cylinder { axis, center, radius, length } => {
                let d = norm((0..3).filter(|k| k != axis).map(|k| x[k] - center[k]));
                let scale = if d > *radius { radius / d } else { 1.0 };
                std::array::from_fn(|k| {
                    if k == *axis {
                        x[k].clamp(center[k] - 0.5 * length, center[k] + 0.5 * length)
                    } else {
                        center[k] + scale * (x[k] - center[k])
                    }
                })
            }
            Shape::Rest { .. } => x,
        }
    }

    proptest! {
        /// Alternating projections onto the two shapes converge to one point if and only if the shapes meet.
        #[test]
        fn overlap_is_what_projections_find(a in shapes(), b in shapes()) {
            let mut x = [3.0; 3];
            let mut gap = 0.0;
            for _ in 0..4000 {
                let y = nearest(&a, x);
                x = nearest(&b, y);
                gap = norm((0..3).map(|k| x[k] - y[k]));
            }
            // Shapes that nearly touch converge too slowly for a decision.
            prop_assume!(!(1e-9..1e-2).contains(&gap));
            prop_assert_eq!(a.overlaps(&b, 3), gap <= 1e-9);
            prop_assert_eq!(b.overlaps(&a, 3), gap <= 1e-9);
        }
    }

    #[test]
    fn what_touches_does_not_overlap() {
        let block = |from: f64, to: f64| Shape::Block { low: [0.0, 0.0, from], high: [4.0, 4.0, to] };
        assert!(!block(0.0, 0.1 + 0.2).overlaps(&block(0.3, 1.0), 3));
        assert!(block(0.0, 0.4).overlaps(&block(0.3, 1.0), 3));
        let ball = |x: f64| Shape::Sphere { center: [x, 2.0, 2.0], radius: 1.0 };
        assert!(!ball(1.0).overlaps(&ball(3.0), 3) && ball(1.0).overlaps(&ball(2.99), 3));
        assert!(!ball(1.0).overlaps(&block(3.0, 4.0), 3) && ball(1.0).overlaps(&block(2.9, 4.0), 3));
    }
}
