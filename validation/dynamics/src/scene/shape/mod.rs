//! Regions of a box that are filled with particles.

mod overlap;
mod read;

pub use read::{FACES, SHAPES, Shapes};

/// A region. Directions and lengths are those of a box with edges along the axes; in two dimensions the third
/// coordinate is ignored.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    Block {
        low: [f64; 3],
        high: [f64; 3],
    },
    /// A ball; in two dimensions a disc.
    Sphere {
        center: [f64; 3],
        radius: f64,
    },
    Cylinder {
        axis: usize,
        center: [f64; 3],
        radius: f64,
        length: f64,
    },
    /// The part of a region that others in it, which do not overlap, leave free.
    Rest {
        whole: Box<Shape>,
        others: Vec<Shape>,
    },
}

impl Shape {
    pub fn volume(&self, dimensions: usize) -> f64 {
        use std::f64::consts::PI;
        match self {
            Shape::Block { low, high } => (0..dimensions).map(|k| high[k] - low[k]).product(),
            Shape::Sphere { radius, .. } if dimensions == 2 => PI * radius * radius,
            Shape::Sphere { radius, .. } => 4.0 / 3.0 * PI * radius.powi(3),
            Shape::Cylinder { radius, length, .. } => PI * radius * radius * length,
            Shape::Rest { whole, others } => {
                whole.volume(dimensions) - others.iter().map(|s| s.volume(dimensions)).sum::<f64>()
            }
        }
    }

    /// The corners of the smallest block around the region.
    pub fn bounds(&self, dimensions: usize) -> [[f64; 3]; 2] {
        match self {
            Shape::Block { low, high } => [*low, *high],
            Shape::Rest { whole, .. } => whole.bounds(dimensions),
            Shape::Sphere { center, radius } => {
                let half = |k: usize| if k < dimensions { *radius } else { 0.0 };
                [std::array::from_fn(|k| center[k] - half(k)), std::array::from_fn(|k| center[k] + half(k))]
            }
            Shape::Cylinder { axis, center, radius, length } => {
                let half = |k: usize| if k == *axis { 0.5 * length } else { *radius };
                [std::array::from_fn(|k| center[k] - half(k)), std::array::from_fn(|k| center[k] + half(k))]
            }
        }
    }

    pub fn contains(&self, x: [f64; 3], dimensions: usize) -> bool {
        match self {
            Shape::Block { low, high } => (0..dimensions).all(|k| (low[k]..=high[k]).contains(&x[k])),
            Shape::Sphere { center, radius } => {
                (0..dimensions).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>() <= radius * radius
            }
            Shape::Cylinder { axis, center, radius, length } => {
                let across: f64 = (0..3).filter(|k| k != axis).map(|k| (x[k] - center[k]).powi(2)).sum();
                (x[*axis] - center[*axis]).abs() <= 0.5 * length && across <= radius * radius
            }
            Shape::Rest { whole, others } => {
                whole.contains(x, dimensions) && !others.iter().any(|s| s.contains(x, dimensions))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volumes agree with the share of grid points inside.
    #[test]
    fn volumes_are_those_of_the_points_inside() {
        let ball = Shape::Sphere { center: [2.0, 2.5, 3.0], radius: 1.5 };
        let rod = Shape::Cylinder { axis: 1, center: [4.4, 2.5, 1.2], radius: 0.8, length: 4.0 };
        let low = [0.0; 3];
        let high = [6.0, 5.0, 5.0];
        let whole = Box::new(Shape::Block { low, high });
        let rest = Shape::Rest { whole, others: vec![ball.clone(), rod.clone()] };
        for shape in [ball, rod, rest] {
            let points = 120;
            let mut inside = 0;
            for k in 0..points * points * points {
                let at = [k % points, k / points % points, k / points / points];
                let x = std::array::from_fn(|c| high[c] * (at[c] as f64 + 0.5) / points as f64);
                inside += shape.contains(x, 3) as usize;
                if shape.contains(x, 3) {
                    let [a, b] = shape.bounds(3);
                    assert!((0..3).all(|c| a[c] <= x[c] && x[c] <= b[c]));
                }
            }
            let found = 150.0 * inside as f64 / (points as f64).powi(3);
            assert!((found - shape.volume(3)).abs() < 0.01 * shape.volume(3), "{shape:?}: {found}");
        }
        let disc = Shape::Sphere { center: [0.0; 3], radius: 2.0 };
        assert!((disc.volume(2) - 12.566_370_614).abs() < 1e-8);
    }
}
