use super::{Real, Shape};
use std::f64::consts::PI;

/// `W = 1 − s`. Its force jumps at the range: Pagonabarraga and Frenkel use it for comparison in Figs 3–5.
#[derive(Debug, Clone, Copy, Default)]
pub struct Linear;

impl Shape for Linear {
    const NAME: &'static str = "linear";
    const FACTORS: [f64; 2] = [3.0 / PI, 3.0 / PI];
    const POSITIVE_DEFINITE: bool = false;

    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        R::constant(1.0) - s
    }

    #[inline(always)]
    fn slope<R: Real>(_s: R) -> R {
        R::constant(-1.0)
    }

    #[inline(always)]
    fn curvature<R: Real>(_: R) -> R {
        R::constant(0.0)
    }
}
