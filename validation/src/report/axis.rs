//! Axis ranges and ticks.

use super::text::superscript;

/// One tick.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// Position along the axis, from 0 to 1.
    pub at: f64,
    /// Label; minor ticks have none.
    pub label: Option<String>,
}

/// A range of values mapped to 0..1, with ticks.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    map: Map,
    /// Ticks in increasing order of position within each kind.
    pub ticks: Vec<Tick>,
    /// Factor that labels leave out, such as `×10⁵`.
    pub factor: Option<String>,
}

/// Linear: `v / scale` in `lo..hi`. Logarithmic: `log10(v)` in `lo..hi`.
/// Dividing by the scale first keeps ranges near the largest float finite.
#[derive(Debug, Clone, Copy)]
struct Map {
    log: bool,
    scale: f64,
    lo: f64,
    hi: f64,
}

impl Map {
    /// Position of a value; outside the range it is moved to the nearer end.
    fn fraction(&self, value: f64) -> Option<f64> {
        if !value.is_finite() || (self.log && value <= 0.0) {
            return None;
        }
        let v = if self.log { value.log10() } else { value / self.scale };
        Some(((v - self.lo) / (self.hi - self.lo)).clamp(0.0, 1.0))
    }
}

/// Room left between the data and the ends of the axis.
const MARGIN: f64 = 0.04;

impl Axis {
    /// An axis that holds every finite value (every positive one if `log`),
    /// with about `wanted` labelled ticks.
    pub fn around(values: impl Iterator<Item = f64>, log: bool, wanted: usize) -> Self {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(|v| v.is_finite() && (!log || *v > 0.0)) {
            lo = lo.min(v);
            hi = hi.max(v);
        }
        if lo > hi {
            (lo, hi) = if log { (1.0, 10.0) } else { (0.0, 1.0) };
        }
        let wanted = wanted.max(2);
        if log { Self::log(lo, hi, wanted) } else { Self::linear(lo, hi, wanted) }
    }

    /// A linear axis from `lo` to `hi` exactly; ends that span no range get one of length 1.
    pub fn exact(lo: f64, hi: f64, wanted: usize) -> Self {
        let (lo, hi) = if hi > lo && (hi - lo).is_finite() { (lo, hi) } else { (0.0, 1.0) };
        let scale = 10f64.powi(exponent(lo.abs().max(hi.abs())));
        let (lo, hi) = (lo / scale, hi / scale);
        let map = Map { log: false, scale, lo, hi };
        let (ticks, factor) = linear_ticks(&map, lo, hi, scale, wanted.max(2));
        Self { map, ticks, factor }
    }

    /// Position of a value along the axis, if it can be shown.
    pub fn fraction(&self, value: f64) -> Option<f64> {
        self.map.fraction(value)
    }

    /// Position of a value within the ends of the axis.
    pub fn inside(&self, value: f64) -> Option<f64> {
        let v = if self.map.log { value.log10() } else { value / self.map.scale };
        (self.map.lo..=self.map.hi).contains(&v).then(|| self.map.fraction(value))?
    }

    fn linear(lo: f64, hi: f64, wanted: usize) -> Self {
        let scale = 10f64.powi(exponent(lo.abs().max(hi.abs())));
        let (mut lo, mut hi) = (lo / scale, hi / scale);
        let size = lo.abs().max(hi.abs());
        // A spread that is only rounding is no spread.
        let pad = if hi - lo > 1e-12 * size {
            MARGIN * (hi - lo)
        } else if size > 0.0 {
            0.1 * size
        } else {
            1.0
        };
        lo -= pad;
        hi += pad;
        let map = Map { log: false, scale, lo, hi };
        let (ticks, factor) = linear_ticks(&map, lo, hi, scale, wanted);
        Self { map, ticks, factor }
    }

    fn log(lo: f64, hi: f64, wanted: usize) -> Self {
        let (lo, hi) = (lo.log10(), hi.log10());
        let pad = if hi - lo > 1e-12 { MARGIN * (hi - lo) } else { 0.5 };
        let map = Map { log: true, scale: 1.0, lo: lo - pad, hi: hi + pad };
        let (lo, hi) = (map.lo, map.hi);
        let (first, last) = (lo.ceil() as i32, hi.floor() as i32);
        let decades = (last - first + 1).max(0) as usize;
        let labelled: &[f64] = if decades >= 3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let stride = decades.div_ceil(wanted.max(8)).max(1) as i32;
        let minors = decades <= 8;
        let plain = first >= -3 && last <= 4;

        let mut ticks = Vec::new();
        for decade in first - 1..=last + 1 {
            for digit in 1..=9 {
                let digit = f64::from(digit);
                let at = f64::from(decade) + digit.log10();
                if at < lo || at > hi {
                    continue;
                }
                let main = labelled.contains(&digit) && (decade - first) % stride == 0;
                if main || (minors && digit > 1.0) {
                    ticks.push(Tick {
                        at: (at - lo) / (hi - lo),
                        label: main.then(|| log_label(digit, decade, plain)),
                    });
                }
            }
        }
        if ticks.iter().filter(|t| t.label.is_some()).count() >= 3 {
            return Self { map, ticks, factor: None };
        }
        // Well under a decade: ticks as on a linear axis, placed by logarithm.
        let base = lo.floor();
        let scale = 10f64.powf(base);
        let (from, to) = (10f64.powf(lo - base), 10f64.powf(hi - base));
        let (ticks, factor) = linear_ticks(&map, from, to, scale, wanted);
        Self { map, ticks, factor }
    }
}

/// Decimal exponent, kept where powers of ten are ordinary floats.
fn exponent(v: f64) -> i32 {
    if v > 0.0 && v.is_finite() { (v.log10().floor() as i32).clamp(-300, 300) } else { 0 }
}

/// Ticks at multiples of 1, 2 or 5 times a power of ten; `lo` and `hi` are in
/// units of `scale`.
fn linear_ticks(map: &Map, lo: f64, hi: f64, scale: f64, wanted: usize) -> (Vec<Tick>, Option<String>) {
    let raw = (hi - lo) / wanted as f64;
    let power = 10f64.powi(exponent(raw));
    let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= raw).unwrap_or(10.0);
    let top = scale.log10().round() as i32;
    // Sizes of ordinary life are written out.
    let (shown, factor) = if (-3..=4).contains(&top) {
        (scale, None)
    } else {
        (1.0, Some(format!("×10{}", superscript(top))))
    };
    let decimals = (-(step * shown).log10() - 1e-9).ceil().clamp(0.0, 17.0) as usize;
    let first = (lo / step).ceil();
    let ticks = (0..=4 * wanted)
        .map(|k| (first + k as f64) * step)
        .take_while(|v| *v <= hi)
        .filter_map(|v| Some(Tick { at: map.fraction(v * scale)?, label: Some(number(v * shown, decimals)) }))
        .collect();
    (ticks, factor)
}

/// A fixed-point number with a true minus sign and no negative zero.
fn number(v: f64, decimals: usize) -> String {
    let text = format!("{:.*}", decimals, v.abs());
    let zero = text.chars().all(|c| matches!(c, '0' | '.'));
    if zero || v >= 0.0 { text } else { format!("−{text}") }
}

fn log_label(digit: f64, decade: i32, plain: bool) -> String {
    if plain {
        number(digit * 10f64.powi(decade), (-decade).max(0) as usize)
    } else if digit == 1.0 {
        format!("10{}", superscript(decade))
    } else {
        format!("{digit}×10{}", superscript(decade))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().filter_map(|t| t.label.as_deref()).collect()
    }

    #[test]
    fn linear_labels() {
        let axis = Axis::around([0.0, 1.0].into_iter(), false, 5);
        assert_eq!(labels(&axis), ["0.0", "0.5", "1.0"]);
        let axis = Axis::around([-4.0, 4.0].into_iter(), false, 5);
        assert_eq!(labels(&axis), ["−4", "−2", "0", "2", "4"]);
        let axis = Axis::around([0.0, 4e7].into_iter(), false, 5);
        assert_eq!(labels(&axis), ["0", "1", "2", "3", "4"]);
        assert_eq!(axis.factor.as_deref(), Some("×10⁷"));
    }

    #[test]
    fn an_exact_axis_ends_where_it_is_told() {
        let axis = Axis::exact(-2.0, 18.0, 5);
        assert_eq!((axis.fraction(-2.0), axis.fraction(18.0)), (Some(0.0), Some(1.0)));
        assert_eq!(labels(&axis), ["0", "5", "10", "15"]);
        for (lo, hi) in [(0.0, 0.0), (f64::NAN, 1.0), (1.0, -1.0), (0.0, f64::INFINITY), (0.0, 1e-300)] {
            assert!(labels(&Axis::exact(lo, hi, 5)).len() >= 2);
        }
    }

    #[test]
    fn log_labels() {
        let axis = Axis::around([0.01, 100.0].into_iter(), true, 5);
        assert_eq!(labels(&axis), ["0.01", "0.1", "1", "10", "100"]);
        let axis = Axis::around([1e-12, 1e-9].into_iter(), true, 5);
        assert_eq!(labels(&axis), ["10⁻¹²", "10⁻¹¹", "10⁻¹⁰", "10⁻⁹"]);
        assert!(labels(&Axis::around([3.0, 3.5].into_iter(), true, 5)).len() >= 3);
    }

    proptest! {
        #[test]
        fn any_values_give_an_axis(
            values in prop::collection::vec(any::<f64>(), 0..6),
            log in any::<bool>(),
        ) {
            let axis = Axis::around(values.iter().copied(), log, 6);
            for v in values {
                let shown = v.is_finite() && (!log || v > 0.0);
                prop_assert_eq!(axis.fraction(v).is_some(), shown);
                prop_assert!(axis.fraction(v).is_none_or(|f| (0.0..=1.0).contains(&f)));
            }
            let shown = labels(&axis).len();
            prop_assert!((2..=30).contains(&shown), "{} labels", shown);
            prop_assert!(axis.ticks.iter().all(|t| (0.0..=1.0).contains(&t.at)));
        }

        #[test]
        fn near_values_give_an_axis(base in -1e3..1e3f64, spread in 0.0..1e-6f64, log in any::<bool>()) {
            let axis = Axis::around([base, base + spread * base].into_iter(), log, 6);
            prop_assert!(labels(&axis).len() >= 2);
        }
    }
}
