use super::{Real, Shape};
use std::f64::consts::PI;

/// `W = (1 + 4s)(1 − s)⁴`. It is positive definite in up to three dimensions, so that particles do not form pairs.
#[derive(Debug, Clone, Copy, Default)]
pub struct WendlandC2;

impl Shape for WendlandC2 {
    const NAME: &'static str = "wendland-c2";
    const FACTORS: [f64; 2] = [7.0 / PI, 21.0 / (2.0 * PI)];
    const POSITIVE_DEFINITE: bool = true;

    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        let one = R::constant(1.0);
        let t = (one - s) * (one - s);
        (one + R::constant(4.0) * s) * t * t
    }

    #[inline(always)]
    fn slope<R: Real>(s: R) -> R {
        let t = R::constant(1.0) - s;
        R::constant(-20.0) * s * t * t * t
    }

    #[inline(always)]
    fn curvature<R: Real>(s: R) -> R {
        let one = R::constant(1.0);
        let t = one - s;
        R::constant(-20.0) * t * t * (one - R::constant(4.0) * s)
    }
}
