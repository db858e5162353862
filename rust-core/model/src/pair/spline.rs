use super::{FormEntry, PairForm};
use crate::document::keys::{Key, REQUIRED, ValueKind, keys};
use crate::document::{FileError, Section};
use crate::kernel::{CubicSpline, Shape};
use crate::number::Number;
use std::collections::BTreeMap;
use std::path::Path;

/// The repulsive–attractive potential of Wang and Chen,
/// `φ = a [A W(r, R_A) − B W(r, R_B)]`, with the cubic spline `W` of their eq. (8), `W(0) = 1`,
/// not normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineAttractive {
    /// The factor `aA` of the repulsive spline.
    pub repulsion: f64,
    /// The factor `aB` of the attractive spline.
    pub attraction: f64,
    /// The range `R_A` of the repulsion.
    pub repulsion_range: f64,
    /// The range `R_B` of the attraction.
    pub attraction_range: f64,
}

/// The shape `W(r, R)` and `∂W/∂r`; zero at and beyond `R`.
#[inline(always)]
pub fn spline_shape(r: f64, range: f64) -> (f64, f64) {
    let s = r / range;
    if s < 1.0 { (CubicSpline::value(s), CubicSpline::slope(s) / range) } else { (0.0, 0.0) }
}

/// The form `spline` in the model file.
#[derive(Debug, Clone)]
pub struct SplineEntry {
    /// Strength, `A`, `B`, `range_A` and `range_B`.
    numbers: Box<[Number; 5]>,
}

impl FormEntry for SplineEntry {
    type Form = SplineAttractive;

    const KEYS: &'static [Key] = keys! {
        "strength": ValueKind::NumberOrFormula, REQUIRED,
            "The amplitude, an energy, of `phi = strength [A W(r, range_A) - B W(r, range_B)]` with Wang and Chen's \
             cubic spline, `W(0) = 1`."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 18.75\nA = 2\nB = 1\nrange_A = \
             0.8\nrange_B = 1.0";
        "A": ValueKind::NumberOrFormula, REQUIRED,
            "The weight of the repulsion."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 18.75\nA = 2\nB = 1\nrange_A \
             = 0.8\nrange_B = 1.0";
        "B": ValueKind::NumberOrFormula, REQUIRED,
            "The weight of the attraction."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 18.75\nA = 2\nB = \
             0.8\nrange_A = 0.8\nrange_B = 1.0";
        "range_A": ValueKind::NumberOrFormula, REQUIRED,
            "The range of the repulsion."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 9.5\nA = 2\nB = 1\nrange_A = \
             0.75\nrange_B = 1.0";
        "range_B": ValueKind::NumberOrFormula, REQUIRED,
            "The range of the attraction."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 9.5\nA = 2\nB = 1\nrange_A = \
             0.8\nrange_B = 1.1";
    };

    fn read(table: &Section, _: &Path) -> Result<SplineEntry, FileError> {
        let number = |key| Number::require(table, key);
        let numbers =
            [number("strength")?, number("A")?, number("B")?, number("range_A")?, number("range_B")?];
        Ok(SplineEntry { numbers: Box::new(numbers) })
    }

    fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<SplineAttractive, FileError> {
        let [strength, a, b, range_a, range_b] = &*self.numbers;
        let value = |number: &Number| number.evaluate(constants).map(|x| x.value);
        let strength = value(strength)?;
        Ok(SplineAttractive {
            repulsion: strength * value(a)?,
            attraction: strength * value(b)?,
            repulsion_range: range_a.positive(constants)?,
            attraction_range: range_b.positive(constants)?,
        })
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

    #[inline(always)]
    fn curvature(&self, r: f64) -> f64 {
        let of = |range: f64| {
            let s = r / range;
            if s < 1.0 { CubicSpline::curvature(s) / (range * range) } else { 0.0 }
        };
        self.repulsion * of(self.repulsion_range) - self.attraction * of(self.attraction_range)
    }
}
