use super::{Real, Shape};
use std::f64::consts::PI;

/// `W = (1 − s)²`, of Warren and of Trofimov et al. Its slope is the force law of standard DPD, so a
/// ψ linear in the density is standard DPD exactly (Warren eq. 10).
#[derive(Debug, Clone, Copy, Default)]
pub struct Quadratic;

impl Shape for Quadratic {
    const NAME: &'static str = "quadratic";
    const FACTORS: [f64; 2] = [6.0 / PI, 15.0 / (2.0 * PI)];
    const POSITIVE_DEFINITE: bool = true;

    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        let t = R::constant(1.0) - s;
        t * t
    }

    #[inline(always)]
    fn slope<R: Real>(s: R) -> R {
        R::constant(-2.0) * (R::constant(1.0) - s)
    }

    #[inline(always)]
    fn curvature<R: Real>(_: R) -> R {
        R::constant(2.0)
    }
}
