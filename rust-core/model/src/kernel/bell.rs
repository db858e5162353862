use super::{Real, Shape};
use std::f64::consts::PI;

/// `W = 2s³ − 3s² + 1`, the w₂ that Trofimov et al. reject: it is flat at the centre, so that particles
/// overlap and form lattices at high pressure.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bell;

impl Shape for Bell {
    const NAME: &'static str = "bell";
    const FACTORS: [f64; 2] = [10.0 / (3.0 * PI), 15.0 / (4.0 * PI)];
    const POSITIVE_DEFINITE: bool = false;

    #[inline(always)]
    fn value<R: Real>(s: R) -> R {
        R::constant(1.0) + s * s * (R::constant(2.0) * s - R::constant(3.0))
    }

    #[inline(always)]
    fn slope<R: Real>(s: R) -> R {
        R::constant(6.0) * s * (s - R::constant(1.0))
    }

    #[inline(always)]
    fn curvature<R: Real>(s: R) -> R {
        R::constant(12.0) * s - R::constant(6.0)
    }
}
