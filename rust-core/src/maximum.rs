//! The largest of some numbers, for checks, in which NaN counts.

use std::borrow::Borrow;

/// The largest absolute value. NaN if one of the numbers is NaN, which `f64::max` would ignore, or if
/// there are no numbers: an assertion that differences are below a limit then fails.
pub fn largest(values: impl IntoIterator<Item = impl Borrow<f64>>) -> f64 {
    let larger = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    values.into_iter().map(|x| x.borrow().abs()).reduce(larger).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hides_what_is_not_a_number() {
        assert_eq!(largest([-2.0, -1.0, -3.0]), 3.0);
        assert_eq!(largest([1.0, f64::NEG_INFINITY]), f64::INFINITY);
        for values in [&[f64::NAN, 1.0][..], &[1.0, f64::NAN], &[1.0, f64::NAN, 2.0], &[]] {
            assert!(largest(values).is_nan(), "{values:?}");
        }
    }
}
