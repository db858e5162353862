use super::PairForm;

/// The soft potential of standard DPD, `φ = ½ a R (1 − r/R)²`: a force `a (1 − r/R)`.
///
/// The form is that of Groot and Warren; Warren eq. (3)–(4), with the range written out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    strength: f64,
    range: f64,
}

impl Soft {
    /// Takes the strength `a` (energy over length; negative attracts) and the range `R > 0`.
    pub fn new(strength: f64, range: f64) -> Soft {
        Soft { strength, range }
    }

    /// The strength `a`: the force at contact.
    pub fn strength(&self) -> f64 {
        self.strength
    }
}

impl PairForm for Soft {
    fn range(&self) -> f64 {
        self.range
    }

    #[inline(always)]
    fn at(&self, r: f64) -> (f64, f64) {
        let t = 1.0 - r / self.range;
        (0.5 * self.strength * self.range * t * t, -self.strength * t)
    }

    fn curvature(&self, _: f64) -> f64 {
        self.strength / self.range
    }
}
