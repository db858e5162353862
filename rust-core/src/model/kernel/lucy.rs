use super::Shape;
use std::f64::consts::PI;

/// `W = (1 + 3s)(1 − s)³`, of Lucy; the density of the style `mdpd/rhosum` of LAMMPS.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lucy;

impl Shape for Lucy {
    const NAME: &'static str = "lucy";
    const FACTORS: [f64; 2] = [5.0 / PI, 105.0 / (16.0 * PI)];

    #[inline(always)]
    fn value(s: f64) -> f64 {
        let t = 1.0 - s;
        (1.0 + 3.0 * s) * t * t * t
    }

    #[inline(always)]
    fn slope(s: f64) -> f64 {
        let t = 1.0 - s;
        -12.0 * s * t * t
    }
}
