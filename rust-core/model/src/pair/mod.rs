//! Pair potentials `φ(r)`, added to the many-body terms.
//!
//! To add a form: write one file with a type that implements [`PairForm`] and one that implements [`FormEntry`], its
//! keys in the model file, and name both in `pair_table!`.

mod expression;
mod soft;
mod spline;
mod table;

pub use expression::ExpressionPair;
pub use soft::Soft;
pub use spline::{SplineAttractive, spline_shape};
pub use table::TablePair;

use crate::document::keys::{FormKeys, Key};
use crate::document::{FileError, Section, Value};
use std::collections::BTreeMap;
use std::path::Path;

/// A pair potential that vanishes at and beyond its range.
pub trait PairForm {
    /// The distance at and beyond which the potential is zero.
    fn range(&self) -> f64;

    /// The values `φ(r)` and `φ'(r)` for `r < range`.
    fn at(&self, r: f64) -> (f64, f64);

    /// `φ''(r)` for `0 < r < range`. A form without a formula for it uses the five-point difference of
    /// the exact `φ'`, whose error is its rounding error, 10⁻¹¹ of `φ'`, over the step.
    fn curvature(&self, r: f64) -> f64 {
        let range = self.range();
        let h = (1e-4 * range).min(0.4 * r).min(0.4 * (range - r));
        if h <= 0.0 {
            return 0.0;
        }
        let slope = |r: f64| self.at(r).1;
        (8.0 * (slope(r + h) - slope(r - h)) - (slope(r + 2.0 * h) - slope(r - 2.0 * h))) / (12.0 * h)
    }

    /// Computes `φ` at every `r` of a block; all `r < range`. The slices have one length; `work` is scratch space.
    fn energies(&self, r: &[f64], phi: &mut [f64], work: &mut Vec<f64>) {
        let _ = work;
        r.iter().zip(phi).for_each(|(r, phi)| *phi = self.at(*r).0);
    }

    /// Computes `φ` and `φ'` at every `r` of a block; all `r < range`. The slices have one length.
    fn block(&self, r: &[f64], phi: &mut [f64], slope: &mut [f64]) {
        r.iter().zip(phi).zip(slope).for_each(|((r, phi), slope)| (*phi, *slope) = self.at(*r));
    }
}

/// The parameters of a form as the model file has them.
pub trait FormEntry: Sized {
    /// The potential.
    type Form: PairForm;

    /// The keys of the form.
    const KEYS: &'static [Key];

    /// Reads the keys; other files are searched in `directory`.
    ///
    /// # Errors
    /// Fails for keys that are missing or have values of a wrong type.
    fn read(table: &Section, directory: &Path) -> Result<Self, FileError>;

    /// The potential for these parameters of the model, kT among them.
    ///
    /// # Errors
    /// Fails for values out of their domain.
    fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<Self::Form, FileError>;
}

/// The one list of pair forms.
macro_rules! pair_table {
    ($($variant:ident($form:ty, $entry:ty) = $name:literal),+ $(,)?) => {
        /// The names of all forms.
        pub const FORMS: &[&str] = &[$($name),+];

        /// The name and the keys of each form.
        pub const FORM_KEYS: &[FormKeys] = &[$((&[$name], <$entry as FormEntry>::KEYS)),+];

        /// The parameters of a pair potential of any form as the model file has them.
        #[derive(Debug, Clone)]
        pub enum PairEntry {
            $(#[doc = concat!("The form `", $name, "`.")] $variant($entry)),+
        }

        impl PairEntry {
            /// Reads the keys of the form that `form` names.
            ///
            /// # Errors
            /// Fails for an unknown form, and for keys that are missing or have values of a wrong type.
            pub fn read(form: &Value, table: &Section, directory: &Path) -> Result<PairEntry, FileError> {
                type Reader = fn(&Section, &Path) -> Result<PairEntry, FileError>;
                let readers: &[(&str, Reader)] = &[$((
                    $name,
                    |table, directory| <$entry>::read(table, directory).map(PairEntry::$variant),
                )),+];
                let read = form.one_of("form", readers)?;
                read(table, directory)
            }

            /// The potential for these parameters of the model, kT among them.
            ///
            /// # Errors
            /// Fails for values out of their domain.
            pub fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<PairPotential, FileError> {
                match self {
                    $(PairEntry::$variant(entry) => entry.bind(constants).map(PairPotential::$variant)),+
                }
            }
        }

        /// A pair potential of any form.
        #[derive(Debug, Clone)]
        pub enum PairPotential {
            $(#[doc = concat!("The form `", $name, "` of the model file.")] $variant($form)),+
        }

        impl PairPotential {
            /// The name of the form in the model file.
            pub fn name(&self) -> &'static str {
                match self { $(PairPotential::$variant(_) => $name),+ }
            }
        }

        impl PairForm for PairPotential {
            fn range(&self) -> f64 {
                match self { $(PairPotential::$variant(form) => form.range()),+ }
            }

            fn at(&self, r: f64) -> (f64, f64) {
                match self { $(PairPotential::$variant(form) => form.at(r)),+ }
            }

            fn curvature(&self, r: f64) -> f64 {
                match self { $(PairPotential::$variant(form) => form.curvature(r)),+ }
            }

            fn energies(&self, r: &[f64], phi: &mut [f64], work: &mut Vec<f64>) {
                match self { $(PairPotential::$variant(form) => form.energies(r, phi, work)),+ }
            }

            fn block(&self, r: &[f64], phi: &mut [f64], slope: &mut [f64]) {
                match self { $(PairPotential::$variant(form) => form.block(r, phi, slope)),+ }
            }
        }
    };
}

pair_table!(
    Soft(Soft, soft::SoftEntry) = "soft",
    Spline(SplineAttractive, spline::SplineEntry) = "spline",
    Expression(ExpressionPair, expression::ExpressionEntry) = "expression",
    Table(TablePair, table::TableEntry) = "table",
);

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// Compares φ' with central differences, and checks that φ = 0 at the range.
    pub(crate) fn slope_is_derivative(form: &impl PairForm, skip: &[f64]) {
        let range = form.range();
        assert!(form.at(range * (1.0 - 1e-12)).0.abs() < 1e-9);
        for k in 1..100 {
            let r = range * k as f64 / 100.0;
            let h = 1e-6 * range;
            if skip.iter().any(|s| (r - s).abs() < 2.0 * h) {
                continue;
            }
            let numeric = (form.at(r + h).0 - form.at(r - h).0) / (2.0 * h);
            let scale = form.at(0.3 * range).1.abs();
            assert!((numeric - form.at(r).1).abs() < 1e-7 * scale, "at {r}");
            let (h, curvature) = (1e-4 * range, form.curvature(r));
            if !skip.iter().any(|s| (r - s).abs() < 2.0 * h) {
                let numeric = (form.at(r + h).1 - form.at(r - h).1) / (2.0 * h);
                assert!((numeric - curvature).abs() < 1e-4 * (scale / range + curvature.abs()), "at {r}");
            }
        }
    }

    #[test]
    fn slopes_are_derivatives() {
        slope_is_derivative(&Soft { strength: 25.0, range: 1.0 }, &[]);
        slope_is_derivative(&Soft { strength: -40.0, range: 0.8 }, &[]);
        let spline = SplineAttractive {
            repulsion: 19.0,
            attraction: 9.5,
            repulsion_range: 0.8,
            attraction_range: 1.0,
        };
        slope_is_derivative(&spline, &[0.4, 0.5, 0.8]);
        let r: Vec<f64> = (0..=50).map(|k| 0.02 * k as f64).collect();
        let phi = r.iter().map(|r| 12.5 * (1.0 - r) * (1.0 - r)).collect();
        let spline = Arc::new(crate::curve::Spline::new(r, phi).unwrap());
        let table = TablePair { spline, range: 1.0 };
        slope_is_derivative(&table, &[]);
        let soft = Soft { strength: 25.0, range: 1.0 };
        for k in 0..100 {
            let (table, soft) = (table.at(0.01 * k as f64), soft.at(0.01 * k as f64));
            assert!((table.0 - soft.0).abs() < 1e-12 && (table.1 - soft.1).abs() < 1e-11);
        }
    }
}
