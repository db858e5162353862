use super::PairForm;
use crate::kernel::{CubicSpline, Shape};

/// The repulsive–attractive potential of Wang and Chen,
/// `φ = a [A W(r, R_A) − B W(r, R_B)]`, with the cubic spline `W` of their eq. (8), `W(0) = 1`,
/// not normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineAttractive {
    repulsion: f64,
    attraction: f64,
    repulsion_range: f64,
    attraction_range: f64,
}

/// The shape `W(r, R)` and `∂W/∂r`; zero at and beyond `R`.
#[inline(always)]
pub fn spline_shape(r: f64, range: f64) -> (f64, f64) {
    let s = r / range;
    if s < 1.0 { (CubicSpline::value(s), CubicSpline::slope(s) / range) } else { (0.0, 0.0) }
}

impl SplineAttractive {
    /// Takes the strength `a`, the amplitudes `A` and `B`, and the ranges `R_A` and `R_B`.
    pub fn new(
        strength: f64,
        repulsion: f64,
        attraction: f64,
        repulsion_range: f64,
        attraction_range: f64,
    ) -> SplineAttractive {
        SplineAttractive {
            repulsion: strength * repulsion,
            attraction: strength * attraction,
            repulsion_range,
            attraction_range,
        }
    }

    /// The factor `aA` of the repulsive spline.
    pub fn repulsion(&self) -> f64 {
        self.repulsion
    }

    /// The factor `aB` of the attractive spline.
    pub fn attraction(&self) -> f64 {
        self.attraction
    }

    /// The range `R_A` of the repulsion.
    pub fn repulsion_range(&self) -> f64 {
        self.repulsion_range
    }

    /// The range `R_B` of the attraction.
    pub fn attraction_range(&self) -> f64 {
        self.attraction_range
    }
}

impl PairForm for SplineAttractive {
    fn range(&self) -> f64 {
        self.repulsion_range.max(self.attraction_range)
    }

    #[inline(always)]
    fn at(&self, r: f64) -> (f64, f64) {
        let (wa, da) = spline_shape(r, self.repulsion_range);
        let (wb, db) = spline_shape(r, self.attraction_range);
        (self.repulsion * wa - self.attraction * wb, self.repulsion * da - self.attraction * db)
    }
}
