//! The ridge of liquid on a wall whose cross-section is a part of a circle.

/// Area of the cross-section in squares of the range of the forces, if its height allows it.
const AREA: f64 = 60.0;
/// The least height: layers at the wall take two.
const HEIGHT: f64 = 4.5;
/// Room beside it and above it.
const ROOM: f64 = 3.0;

/// A ridge in ranges of the forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ridge {
    /// The box, across the ridge and away from the wall.
    pub edges: [f64; 2],
    /// The rectangle of the same area that it starts from, centred: half of its width, and its height.
    pub start: [f64; 2],
}

/// The ridge with the contact angle θ, in degrees: `A = R² (θ − sin θ cos θ)`, of height `R (1 − cos θ)`.
pub fn ridge(angle: f64) -> Ridge {
    let (sin, cos) = angle.to_radians().sin_cos();
    let share = angle.to_radians() - sin * cos;
    let radius = (AREA / share).sqrt().max(HEIGHT / (1.0 - cos));
    let (area, height) = (radius * radius * share, radius * (1.0 - cos));
    // Half of the width at its widest, which is at the wall for angles below 90 degrees.
    let widest = if angle < 90.0 { radius * sin } else { radius };
    let half = 0.85 * widest;
    let top = 0.5 * area / half;
    Ridge { edges: [2.0 * (widest + ROOM), height.max(top) + ROOM], start: [half, top] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A half-circle: R² = 2A/π; and a flat ridge is as high as is needed.
    #[test]
    fn cross_sections_are_parts_of_circles() {
        let half = ridge(90.0);
        let radius = (2.0 * AREA / std::f64::consts::PI).sqrt();
        assert!((half.edges[0] - 2.0 * (radius + ROOM)).abs() < 1e-9, "{half:?}");
        assert!((2.0 * half.start[0] * half.start[1] - AREA).abs() < 1e-9);
        for angle in [20.0f64, 30.0, 60.0, 120.0, 160.0] {
            let Ridge { edges, start: [across, top] } = ridge(angle);
            assert!(edges[1] >= HEIGHT + ROOM - 1e-9 && edges[0] > 2.0 * across, "{angle}");
            // The rectangle has the area of the part of the circle, summed in slices.
            let widest = 0.5 * edges[0] - ROOM;
            let radius = if angle < 90.0 { widest / angle.to_radians().sin() } else { widest };
            let height = radius * (1.0 - angle.to_radians().cos());
            let wide = |y: f64| 2.0 * (radius * radius - (y - height + radius).powi(2)).sqrt();
            let slices = (0..4000).map(|k| (f64::from(k) + 0.5) / 4000.0 * height);
            let area = slices.map(wide).sum::<f64>() * height / 4000.0;
            assert!((2.0 * across * top / area - 1.0).abs() < 1e-3, "{angle}: {area}");
            assert!((edges[1] - ROOM - height.max(top)).abs() < 1e-9, "{angle}: {edges:?}");
            assert!((across / widest - 0.85).abs() < 1e-9 && 2.0 * across * top >= AREA - 1e-9);
        }
    }
}
