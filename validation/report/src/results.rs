//! Checks and the machine-readable results file.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::ReportError;

/// One check: the comparison of a number with a limit.
///
/// JSON has no NaN or infinity: a non-finite float is written as `null`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Check {
    /// The short name, unique within the results.
    pub id: String,
    /// The heading under which the check is reported.
    pub section: String,
    pub description: String,
    pub value: f64,
    pub error: Option<f64>,
    pub expected: Option<f64>,
    /// The bound on `value`.
    pub limit: f64,
    /// True if `limit` is a lower bound on `value`; else it is an upper bound on the magnitude.
    pub at_least: bool,
    pub passed: bool,
    pub note: String,
}

impl Check {
    /// The check passes if `|value| <= limit`. A non-finite value or limit fails.
    pub fn at_most(
        id: impl Into<String>,
        section: impl Into<String>,
        description: impl Into<String>,
        value: f64,
        limit: f64,
    ) -> Self {
        let (id, section, description) = (id.into(), section.into(), description.into());
        let passed = value.is_finite() && limit.is_finite() && value.abs() <= limit;
        Self { id, section, description, value, limit, passed, ..Self::default() }
    }

    /// The check passes if `value >= limit`, signs included. A non-finite value or limit fails.
    pub fn at_least(
        id: impl Into<String>,
        section: impl Into<String>,
        description: impl Into<String>,
        value: f64,
        limit: f64,
    ) -> Self {
        let passed = value.is_finite() && limit.is_finite() && value >= limit;
        Self { at_least: true, passed, ..Self::at_most(id, section, description, value, limit) }
    }

    /// The check passes if a difference is within `z_limit` standard errors of zero: `|delta| <= z_limit * error`.
    ///
    /// `value` is the difference, `expected` is 0 and `limit` is the product `z_limit * error`, in the units of the difference.
    /// Any non-finite argument and a negative error fail.
    pub fn agreement(
        id: impl Into<String>,
        section: impl Into<String>,
        description: impl Into<String>,
        delta: f64,
        error: f64,
        z_limit: f64,
        note: impl Into<String>,
    ) -> Self {
        let limit = z_limit * error;
        let mut check = Self::at_most(id, section, description, delta, limit);
        check.passed &= error >= 0.0 && error.is_finite();
        check.error = Some(error);
        check.expected = Some(0.0);
        check.note = note.into();
        check
    }

    /// Adds a standard error for display; the verdict stays.
    pub fn with_error(mut self, error: f64) -> Self {
        self.error = Some(error);
        self
    }
}

/// All checks of a program with their circumstances. In JSON non-finite floats become `null`; all others read back to the same
/// bits.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    pub title: String,
    pub version: String,
    /// Circumstances: machine, versions, settings.
    pub facts: BTreeMap<String, String>,
    pub seeds: Vec<u64>,
    /// Checks are in the order in which they were made.
    pub checks: Vec<Check>,
    /// Other results by name.
    pub values: BTreeMap<String, Value>,
    /// True if there are checks and all passed; [`Results::push`] maintains this.
    pub passed: bool,
}

impl Results {
    /// Results without checks, which therefore have not passed.
    pub fn new(title: impl Into<String>, version: impl Into<String>) -> Self {
        Self { title: title.into(), version: version.into(), ..Self::default() }
    }

    pub fn push(&mut self, check: Check) {
        self.checks.push(check);
        self.passed = self.failed_count() == 0;
    }

    /// Records a result under a name. Non-finite floats become `null`.
    pub fn record(&mut self, name: impl Into<String>, value: impl Serialize) -> Result<(), ReportError> {
        self.values.insert(name.into(), serde_json::to_value(value)?);
        Ok(())
    }

    pub fn passed_count(&self) -> usize {
        self.checks.iter().filter(|c| c.passed).count()
    }

    pub fn failed_count(&self) -> usize {
        self.checks.len() - self.passed_count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn limits() {
        let most = |v, l| Check::at_most("a", "b", "c", v, l).passed;
        assert!(most(-1.0, 1.0) && !most(-1.1, 1.0));
        assert!(!most(f64::NAN, 1.0) && !most(1.0, f64::NAN));
        assert!(!most(f64::INFINITY, f64::INFINITY) && !most(0.0, -1.0));
        let least = |v, l| Check::at_least("a", "b", "c", v, l).passed;
        assert!(least(1.0, 1.0) && !least(-2.0, 1.0) && least(-1.0, -2.0));
        assert!(!least(f64::NAN, 1.0) && !least(f64::INFINITY, 1.0));
    }

    #[test]
    fn agreement() {
        let agree = |d, e, z| Check::agreement("a", "b", "c", d, e, z, "").passed;
        assert!(agree(-2.9, 1.0, 3.0) && !agree(3.1, 1.0, 3.0) && agree(0.0, 0.0, 3.0));
        assert!(!agree(f64::NAN, 1.0, 3.0) && !agree(0.0, f64::NAN, 3.0));
        assert!(!agree(0.0, f64::INFINITY, 3.0) && !agree(0.0, -1.0, -3.0));
        assert_eq!(Check::agreement("a", "b", "c", 1.0, 0.5, 3.0, "n").limit, 1.5);
    }

    #[test]
    fn nothing_checked_is_not_passed() {
        let mut results = Results::new("t", "v");
        assert!(!results.passed);
        results.push(Check::at_most("a", "b", "c", 0.0, 1.0));
        assert!(results.passed);
        results.push(Check::at_most("d", "b", "c", 2.0, 1.0));
        assert!(!results.passed);
        assert_eq!((results.passed_count(), results.failed_count()), (1, 1));
    }

    #[test]
    fn non_finite_floats_become_null() {
        let mut results = Results::new("t", "v");
        results.push(Check::at_most("a", "b", "c", f64::NAN, f64::INFINITY).with_error(f64::NAN));
        results.record("x", [1.0, f64::NAN]).unwrap();
        let json = serde_json::to_string_pretty(&results).unwrap();
        assert!(json.contains("\"value\": null") && json.contains("\"limit\": null"));
        let back: Value = serde_json::from_str(&json).unwrap();
        assert!(back["checks"][0]["value"].is_null() && back["checks"][0]["error"].is_null());
        assert_eq!(back["values"]["x"], serde_json::json!([1.0, null]));
    }

    proptest! {
        #[test]
        fn numbers_keep_their_bits(value in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO) {
            let mut results = Results::new("title", "1.2.3");
            results.push(Check::at_least("id", "section", "text", value, 0.5));
            let json = serde_json::to_string_pretty(&results).unwrap();
            let back: Value = serde_json::from_str(&json).unwrap();
            prop_assert_eq!(back["checks"][0]["value"].as_f64().map(f64::to_bits), Some(value.to_bits()));
        }
    }
}
