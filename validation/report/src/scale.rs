//! Axes that are linear or logarithmic.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

use super::extremes;
use super::text::superscript;

/// The range of an axis. One type serves both kinds, because the kind is chosen at run time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    range: Range<f64>,
    log: bool,
    /// The labels of a linear axis are divided by this power of ten.
    power: i32,
}

impl Scale {
    /// A linear scale from `low` to `high`; ends that span no range get the range from 0 to 1.
    pub fn exact(low: f64, high: f64) -> Scale {
        let spread = high - low;
        let spans = spread.is_finite() && spread > 1e-9 * low.abs().max(high.abs());
        let range = if spans { low..high } else { 0.0..1.0 };
        let size = range.start.abs().max(range.end.abs());
        // The powers of ten are limited so that they are normal numbers.
        let power = if size > 0.0 { (size.log10().floor() as i32).clamp(-290, 290) } else { 0 };
        // Numbers of everyday size are written without a power of ten.
        Scale { range, log: false, power: if (-3..=4).contains(&power) { 0 } else { power } }
    }

    /// A scale with room for every value that can be shown.
    pub fn around(values: impl Iterator<Item = f64>, log: bool) -> Scale {
        let [low, high] = extremes(values.filter(|v| shows(*v, log)));
        match (low <= high, log) {
            (false, true) => Scale { range: 1.0..10.0, log, power: 0 },
            (false, false) => Scale::exact(0.0, 1.0),
            (true, true) => {
                let (low, high) = (low.log10(), high.log10());
                let room = 0.04 * (high - low).max(1.0);
                Scale { range: 10f64.powf(low - room)..10f64.powf(high + room), log, power: 0 }
            }
            (true, false) => {
                let size = low.abs().max(high.abs());
                // A spread of the size of rounding errors counts as none.
                let room = match high - low {
                    spread if spread > 1e-9 * size => 0.04 * spread,
                    _ if size > 0.0 => 0.1 * size,
                    _ => 1.0,
                };
                Scale::exact(low - room, high + room)
            }
        }
    }

    /// The value, moved to the nearer end if it is outside; `None` if it cannot be shown.
    pub fn clamp(&self, value: f64) -> Option<f64> {
        shows(value, self.log).then(|| value.clamp(self.range.start, self.range.end))
    }

    /// The name of the quantity, with the power of ten that the labels lack.
    pub fn name(&self, name: &str) -> String {
        match self.power {
            0 => name.to_owned(),
            power => format!("{name} (×10{})", superscript(power)).trim_start().to_owned(),
        }
    }

    pub fn ends(&self) -> (f64, f64) {
        (self.range.start, self.range.end)
    }

    fn linear(&self) -> RangedCoordf64 {
        let unit = 10f64.powi(self.power);
        (self.range.start / unit..self.range.end / unit).into()
    }

    /// The axis in terms of decimal logarithms.
    fn logarithmic(&self) -> RangedCoordf64 {
        (self.range.start.log10()..self.range.end.log10()).into()
    }

    /// The powers of ten; if there are few, also 2 and 5 times them.
    fn decades(&self, most: usize) -> Vec<f64> {
        let (low, high) = (self.range.start.log10().floor() as i32, self.range.end.log10().ceil() as i32);
        let digits: &[f64] = if high - low <= 3 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let stride = (high - low) as usize / most.max(1) + 1;
        let powers = (low..=high).step_by(stride).map(|power| 10f64.powi(power));
        let ticks = powers.flat_map(|power| digits.iter().map(move |digit| digit * power));
        ticks.filter(|tick| self.range.contains(tick)).collect()
    }
}

/// Returns true if a value has a place on an axis. Powers of ten near it must be normal numbers.
fn shows(value: f64, log: bool) -> bool {
    value.abs() < 1e250 && (!log || value > 1e-250)
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        if self.log {
            self.logarithmic().map(&value.log10(), limit)
        } else {
            self.linear().map(&(value / 10f64.powi(self.power)), limit)
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points();
        let decades = if self.log { self.decades(most) } else { Vec::new() };
        if decades.len() > 2 {
            return decades;
        }
        // A range of much less than a decade has ticks as on a linear axis.
        let unit = 10f64.powi(self.power);
        self.linear().key_points(most).into_iter().map(|v| v * unit).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Scale {
    /// Writes as many digits as the ticks need to differ.
    fn format_ext(&self, value: &f64) -> String {
        let unit = 10f64.powi(self.power);
        if self.log && !(1e-3..1e6).contains(value) {
            return format!("{value:.1e}").replace(".0e", "e");
        }
        let step = if self.log { *value } else { (self.range.end - self.range.start) / unit };
        let decimals = (2.0 - step.log10()).ceil().clamp(0.0, 15.0) as usize;
        let text = format!("{:.decimals$}", value / unit);
        let fraction = text.contains('.');
        let short = if fraction { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if short == "-0" { "0".to_owned() } else { short.replace('-', "−") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: &Scale) -> Vec<String> {
        scale.key_points(8).iter().map(|v| scale.format_ext(v)).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels(&Scale::exact(0.0, 10.0)), ["0", "2", "4", "6", "8", "10"]);
        let small = Scale::around([1e-17, 3e-17].into_iter(), false);
        assert_eq!(small.name("u"), "u (×10⁻¹⁷)");
        assert!(labels(&small).len() > 3 && labels(&small).contains(&"2".to_owned()), "{:?}", labels(&small));
        let near = labels(&Scale::exact(1.0, 1.0 + 1e-6));
        assert!(near.len() > 3 && near.windows(2).all(|w| w[0] != w[1]), "{near:?}");
        assert!(labels(&Scale::around([100.0, 1e6].into_iter(), true)).contains(&"10000".to_owned()));
        assert!(labels(&Scale::around([2.0, 8.0].into_iter(), true)).len() > 3);
    }

    #[test]
    fn values_without_a_place() {
        let scale = Scale::around([f64::NAN, -1.0, 1.0, f64::INFINITY].into_iter(), false);
        assert_eq!(scale.range(), -1.08..1.08);
        assert_eq!((scale.clamp(5.0), scale.clamp(f64::NAN)), (Some(1.08), None));
        let log = Scale::around([-1.0, 0.0, 10.0].into_iter(), true);
        assert_eq!((log.clamp(0.0), log.clamp(1e9)), (None, Some(log.range().end)));
        assert_eq!(Scale::exact(3.0, 3.0).range(), 0.0..1.0);
    }
}
