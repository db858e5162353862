use super::Shape;
use std::f64::consts::PI;

/// The cubic spline of Wang and Chen, eq. (8), with its whole support on `s < 1` (not `2h`):
/// `1 − 6s² + 6s³` below one half, `2(1 − s)³` above.
#[derive(Debug, Clone, Copy, Default)]
pub struct CubicSpline;

impl Shape for CubicSpline {
    const NAME: &'static str = "cubic-spline";
    const FACTORS: [f64; 2] = [40.0 / (7.0 * PI), 8.0 / PI];

    #[inline(always)]
    fn value(s: f64) -> f64 {
        if s < 0.5 {
            1.0 + 6.0 * s * s * (s - 1.0)
        } else {
            let t = 1.0 - s;
            2.0 * t * t * t
        }
    }

    #[inline(always)]
    fn slope(s: f64) -> f64 {
        if s < 0.5 {
            6.0 * s * (3.0 * s - 2.0)
        } else {
            let t = 1.0 - s;
            -6.0 * t * t
        }
    }
}
