use super::{Real, Shape};
use std::f64::consts::PI;

/// `W = (1 + 3s)(1 − s)³`, of Lucy; the density of the style `mdpd/rhosum` of LAMMPS.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lucy;

impl Shape for Lucy {
    const NAME: &'static str = "lucy";
    const FACTORS: [f64; 2] = [5.0 / PI, 105.0 / (16.0 * PI)];
    const POSITIVE_DEFINITE: bool = false;

    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        let one = R::constant(1.0);
        let t = one - s;
        (one + R::constant(3.0) * s) * t * t * t
    }

    #[inline(always)]
    fn slope<R: Real>(s: R) -> R {
        let t = R::constant(1.0) - s;
        R::constant(-12.0) * s * t * t
    }

    #[inline(always)]
    fn curvature<R: Real>(s: R) -> R {
        let one = R::constant(1.0);
        R::constant(-12.0) * (one - s) * (one - R::constant(3.0) * s)
    }
}
