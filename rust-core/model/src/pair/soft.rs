use super::{FormEntry, PairForm};
use crate::document::keys::{Key, REQUIRED, ValueKind, keys};
use crate::document::{FileError, Section};
use crate::number::Number;
use std::collections::BTreeMap;
use std::path::Path;

/// The soft potential of standard DPD, `φ = ½ a R (1 − r/R)²`: a force `a (1 − r/R)`.
///
/// The form is that of Groot and Warren; Warren eq. (3)–(4), with the range written out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    /// The strength `a`: the force at contact, energy over length; negative attracts.
    pub strength: f64,
    /// The range `R > 0`.
    pub range: f64,
}

/// The form `soft` in the model file.
#[derive(Debug, Clone)]
pub struct SoftEntry {
    strength: Number,
    range: Number,
}

impl FormEntry for SoftEntry {
    type Form = Soft;

    const KEYS: &'static [Key] = keys! {
        "strength": ValueKind::NumberOrFormula, REQUIRED,
            "The amplitude of `phi = strength range/2 (1 - r/range)^2`, a force; negative if it attracts."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = \"-40\"\nrange = 1.0";
        "range": ValueKind::NumberOrFormula, REQUIRED,
            "The distance at and beyond which the potential is zero."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\nrange = \"2^(1/3)\"";
    };

    fn read(table: &Section, _: &Path) -> Result<SoftEntry, FileError> {
        let number = |key| Number::require(table, key);
        Ok(SoftEntry { strength: number("strength")?, range: number("range")? })
    }

    fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<Soft, FileError> {
        let strength = self.strength.evaluate(constants)?.value;
        Ok(Soft { strength, range: self.range.positive(constants)? })
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

    #[inline(always)]
    fn curvature(&self, _: f64) -> f64 {
        self.strength / self.range
    }
}
