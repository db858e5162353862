use super::{Real, Shape};
use std::f64::consts::PI;

/// The cubic spline of Wang and Chen, eq. (8), with its whole support on `s < 1` (not `2h`):
/// `1 − 6s² + 6s³` below one half, `2(1 − s)³` above.
#[derive(Debug, Clone, Copy, Default)]
pub struct CubicSpline;

impl Shape for CubicSpline {
    const NAME: &'static str = "cubic-spline";
    const FACTORS: [f64; 2] = [40.0 / (7.0 * PI), 8.0 / PI];
    const POSITIVE_DEFINITE: bool = false;

    // The sum 2(1 − s)³ − 8(½ − s)³₊ has both pieces without a branch.
    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        let t = R::constant(1.0) - s;
        let u = (R::constant(0.5) - s).larger(R::constant(0.0));
        R::constant(2.0) * (t * t * t) - R::constant(8.0) * (u * u * u)
    }

    #[inline(always)]
    fn slope<R: Real>(s: R) -> R {
        let t = R::constant(1.0) - s;
        let u = (R::constant(0.5) - s).larger(R::constant(0.0));
        R::constant(24.0) * (u * u) - R::constant(6.0) * (t * t)
    }

    #[inline(always)]
    fn curvature<R: Real>(s: R) -> R {
        let below = (R::constant(0.5) - s).larger(R::constant(0.0));
        R::constant(12.0) * (R::constant(1.0) - s) - R::constant(48.0) * below
    }
}
