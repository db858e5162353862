use super::Shape;
use std::f64::consts::PI;

/// `W = (1 + 4s)(1 − s)⁴`. Positive definite in up to three dimensions, so it does not pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct WendlandC2;

impl Shape for WendlandC2 {
    const NAME: &'static str = "wendland-c2";
    const FACTORS: [f64; 2] = [7.0 / PI, 21.0 / (2.0 * PI)];

    #[inline(always)]
    fn value(s: f64) -> f64 {
        let t = (1.0 - s) * (1.0 - s);
        (1.0 + 4.0 * s) * t * t
    }

    #[inline(always)]
    fn slope(s: f64) -> f64 {
        let t = 1.0 - s;
        -20.0 * s * t * t * t
    }
}
