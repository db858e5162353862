//! Numbers with their errors as text.

/// Formats as `7.450 ± 0.042`: the error has two digits, the value has the same decimals. Values outside 10⁻³ … 10⁶ get a
/// power of ten. Without an error (none, or not a positive number) the value has six digits.
pub fn with_error(value: f64, error: Option<f64>) -> String {
    if !value.is_finite() {
        return "—".into();
    }
    let error = error.filter(|e| e.is_finite() && *e > 0.0);
    let Some(error) = error else { return plain(value) };
    let size = value.abs().max(error);
    let top = size.log10().floor() as i32;
    let (scale, power) = if (-3..6).contains(&top) { (1.0, None) } else { (10f64.powi(top), Some(top)) };
    let (value, error) = (value / scale, error / scale);
    let decimals = (1.0 - error.log10().floor()).clamp(0.0, 15.0) as usize;
    // The number 0.0996 is rounded up to 0.10, which has one digit less.
    let rounded: f64 = format!("{error:.decimals$}").parse().unwrap_or(error);
    let decimals = (1.0 - rounded.max(error).log10().floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{} ± {error:.decimals$}", minus(format!("{value:.decimals$}")));
    match power {
        Some(power) => format!("({text})×10{}", super::text::superscript(power)),
        None => text,
    }
}

/// A number with `places` decimals, or with an exponent if the decimals would hide it: 0.250000, 1e-300.
pub fn decimal(x: f64, places: usize) -> String {
    let smallest = 0.5 * 10f64.powi(-(places as i32));
    if x != 0.0 && x.is_finite() && !(smallest..1e15).contains(&x.abs()) {
        format!("{x:.places$e}")
    } else {
        format!("{x:.places$}")
    }
}

/// The shortest form of a number, with an exponent if it is very large or very small: 0.25, 1e-300.
pub fn number(x: f64) -> String {
    let text = format!("{x:?}");
    if text.contains('e') { text } else { x.to_string() }
}

fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let top = value.abs().log10().floor() as i32;
    if (-4..7).contains(&top) {
        let decimals = (5 - top).max(0) as usize;
        let text = format!("{value:.decimals$}");
        let text =
            if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
        return minus(text);
    }
    let digits = format!("{:.5}", value / 10f64.powi(top));
    format!("{}×10{}", minus(digits), super::text::superscript(top))
}

fn minus(text: String) -> String {
    text.strip_prefix('-').map_or(text.clone(), |rest| format!("−{rest}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_decimals_would_hide_have_exponents() {
        for (x, shown, short) in [
            (0.25, "0.250000", "0.25"),
            (20.0, "20.000000", "20"),
            (0.0, "0.000000", "0"),
            (-1.3e-4, "-0.000130", "-0.00013"),
            (1e-300, "1.000000e-300", "1e-300"),
            (-2.5e300, "-2.500000e300", "-2.5e300"),
        ] {
            assert_eq!((decimal(x, 6).as_str(), number(x).as_str()), (shown, short));
        }
    }

    #[test]
    fn errors_have_two_digits() {
        for (value, error, text) in [
            (7.4503, Some(0.0421), "7.450 ± 0.042"),
            (-47.0, Some(2.0), "−47.0 ± 2.0"),
            (12345.6, Some(321.0), "12346 ± 321"),
            (1.0, Some(0.0996), "1.00 ± 0.10"),
            (0.0, Some(0.5), "0.00 ± 0.50"),
            (1.234567e-8, Some(2e-10), "(1.235 ± 0.020)×10⁻⁸"),
            (2.5e9, Some(1e8), "(2.50 ± 0.10)×10⁹"),
            (1.5, None, "1.5"),
            (1.5, Some(0.0), "1.5"),
            (1.5, Some(f64::NAN), "1.5"),
            (f64::NAN, Some(1.0), "—"),
            (0.0, None, "0"),
            (1234567.8, None, "1234568"),
            (1e-12, None, "1.00000×10⁻¹²"),
        ] {
            assert_eq!(with_error(value, error), text);
        }
    }
}
