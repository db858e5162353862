//! Series of vectors in bounded memory, with error bars for functions of their means.

use super::statistics::estimate;
use serde::{Deserialize, Serialize};

/// The largest number of rows in a [`Series`], an even number.
pub const MOST_ROWS: usize = 512;

/// The largest number of stretches in a [`Series::jackknife`]. With twenty or forty the correlation of neighbours drowns in the
/// noise of its estimate, and errors of slow observables, such as the shape of a drop, were a quarter to a half too small.
const STRETCHES: usize = 128;

/// A value with one standard deviation; NaN if unknown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measured {
    pub value: f64,
    pub error: f64,
}

impl Measured {
    pub const NONE: Measured = Measured { value: f64::NAN, error: f64::NAN };

    /// The mean of a correlated series with the error of [`estimate`], or of fewer samples than that accepts as if they were
    /// independent.
    pub fn mean(values: &[f64]) -> Measured {
        match estimate(values) {
            Ok(e) => Measured { value: e.mean, error: e.error },
            Err(_) => Measured::of_independent(values),
        }
    }

    /// The mean of independent values with its standard error s/√M; for one value the error is unknown.
    pub fn of_independent(values: &[f64]) -> Measured {
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|x| (x - value) * (x - value)).sum();
        Measured { value, error: (squares / (count * (count - 1.0))).sqrt() }
    }

    pub fn times(self, factor: f64) -> Measured {
        Measured { value: self.value * factor, error: self.error * factor.abs() }
    }

    /// The sum of two independent values.
    pub fn plus(self, other: Measured) -> Measured {
        Measured { value: self.value + other.value, error: self.error.hypot(other.error) }
    }

    /// The difference of two independent values.
    pub fn minus(self, other: impl Into<Measured>) -> Measured {
        let other = other.into();
        Measured { value: self.value - other.value, error: self.error.hypot(other.error) }
    }

    /// The quotient of two independent values.
    pub fn over(self, other: impl Into<Measured>) -> Measured {
        let other = other.into();
        let value = self.value / other.value;
        Measured { value, error: (self.error / other.value).hypot(value * other.error / other.value) }
    }
}

/// A number that is exact, or has only rounding errors.
impl From<f64> for Measured {
    fn from(value: f64) -> Measured {
        Measured { value, error: 0.0 }
    }
}

/// A value and its error.
impl From<[f64; 2]> for Measured {
    fn from([value, error]: [f64; 2]) -> Measured {
        Measured { value, error }
    }
}

/// A series of vectors of one width, stored as means of consecutive blocks. Up to [`MOST_ROWS`] samples each block is one
/// sample. Then neighbouring blocks are averaged, and blocks become twice as long.
///
/// An incomplete block at the end is left out of every mean. Sums are made in the order of the samples, so a series that is
/// written, read back and continued ends with the same bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Series {
    width: usize,
    most: usize,
    block: u64,
    pending: Vec<f64>,
    pending_samples: u64,
    rows: Vec<f64>,
}

/// The stored form of a [`Series`] before validation.
#[derive(Deserialize)]
struct Unchecked {
    width: usize,
    most: usize,
    block: u64,
    pending: Vec<f64>,
    pending_samples: u64,
    rows: Vec<f64>,
}

impl TryFrom<Unchecked> for Series {
    type Error = &'static str;

    fn try_from(read: Unchecked) -> Result<Series, &'static str> {
        let Unchecked { width, most, block, pending, pending_samples, rows } = read;
        let whole_rows = if width == 0 { rows.is_empty() } else { rows.len().is_multiple_of(width) };
        let series = Series { width, most, block, pending, pending_samples, rows };
        let even = most >= 2 && most.is_multiple_of(2);
        let counted =
            block.is_power_of_two() && block.checked_mul(most as u64).is_some() && pending_samples < block;
        let started = series.pending.len() == if pending_samples == 0 { 0 } else { width };
        let finite = series.rows.iter().chain(&series.pending).all(|x| x.is_finite());
        if whole_rows && even && counted && started && finite && series.len() < most {
            Ok(series)
        } else {
            Err("no series of samples")
        }
    }
}

impl Series {
    pub fn new(width: usize) -> Series {
        Series::with_rows(width, MOST_ROWS)
    }

    /// A series with fewer rows, for wide vectors. `most` is even.
    pub fn with_rows(width: usize, most: usize) -> Series {
        let most = (most & !1).max(2);
        Series { width, most, block: 1, pending: Vec::new(), pending_samples: 0, rows: Vec::new() }
    }

    /// Adds a sample and returns true. A sample with another width, NaN or infinity is not added.
    pub fn push(&mut self, sample: &[f64]) -> bool {
        if sample.len() != self.width || self.width == 0 || !sample.iter().all(|x| x.is_finite()) {
            return false;
        }
        if self.pending_samples == 0 {
            self.pending.clear();
            self.pending.extend_from_slice(sample);
        } else {
            self.pending.iter_mut().zip(sample).for_each(|(sum, x)| *sum += x);
        }
        self.pending_samples += 1;
        if self.pending_samples == self.block {
            let block = self.block as f64;
            self.rows.extend(self.pending.iter().map(|x| x / block));
            self.pending_samples = 0;
            self.pending.clear();
            if self.len() == self.most {
                self.halve();
            }
        }
        true
    }

    pub fn clear(&mut self) {
        *self = Series::with_rows(self.width, self.most);
    }

    fn halve(&mut self) {
        let width = self.width;
        for k in 0..self.most / 2 {
            for c in 0..width {
                self.rows[k * width + c] =
                    0.5 * (self.rows[2 * k * width + c] + self.rows[(2 * k + 1) * width + c]);
            }
        }
        self.rows.truncate(self.most / 2 * width);
        self.block *= 2;
    }

    /// The most bytes that it holds of so many samples.
    pub fn bytes(&self, samples: f64) -> f64 {
        (size_of::<f64>() * self.width) as f64 * (1.0 + samples.min(self.most as f64))
    }

    pub fn len(&self) -> usize {
        self.rows.len().checked_div(self.width).unwrap_or(0)
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The number of samples in the rows.
    pub fn samples(&self) -> u64 {
        self.len() as u64 * self.block
    }

    pub fn width(&self) -> usize {
        self.width
    }

    /// The rows, oldest first.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.width.max(1))
    }

    pub fn channel(&self, k: usize) -> Vec<f64> {
        self.rows().map(|row| row[k]).collect()
    }

    pub fn mean(&self, k: usize) -> Measured {
        Measured::mean(&self.channel(k))
    }

    pub fn means(&self) -> Vec<f64> {
        self.means_of(0..self.len())
    }

    fn means_of(&self, rows: std::ops::Range<usize>) -> Vec<f64> {
        let mut sum = vec![0.0; self.width];
        for row in self.rows().take(rows.end).skip(rows.start) {
            sum.iter_mut().zip(row).for_each(|(s, x)| *s += x);
        }
        let count = rows.len() as f64;
        sum.iter_mut().for_each(|s| *s /= count);
        sum
    }

    /// The mean of a linear function of the samples.
    pub fn linear(&self, function: impl Fn(&[f64]) -> f64) -> Measured {
        let values: Vec<f64> = self.rows().map(function).collect();
        Measured::mean(&values)
    }

    /// The ratio `⟨a⟩/⟨b⟩` of two linear functions of the samples. Its error is that of the mean of `(a − R b)/⟨b⟩`.
    pub fn ratio(&self, a: impl Fn(&[f64]) -> f64, b: impl Fn(&[f64]) -> f64) -> Measured {
        let tops: Vec<f64> = self.rows().map(a).collect();
        let bottoms: Vec<f64> = self.rows().map(b).collect();
        let bottom = bottoms.iter().sum::<f64>() / bottoms.len() as f64;
        let value = tops.iter().sum::<f64>() / tops.len() as f64 / bottom;
        if !value.is_finite() {
            return Measured::NONE;
        }
        let rest: Vec<f64> = tops.iter().zip(&bottoms).map(|(a, b)| (a - value * b) / bottom).collect();
        Measured { value, error: Measured::mean(&rest).error }
    }

    /// Functions of the means with their errors from the infinitesimal jackknife (Jaeckel, Bell Laboratories MM 72-1215-11
    /// (1972); Efron, The Jackknife, the Bootstrap and Other Resampling Plans (1982), chapter 6).
    ///
    /// The series is cut into 65 to 128 stretches, or into single rows if there are fewer. The means are moved towards
    /// those of each stretch in turn. The changes of the value form a series, whose mean has the error of [`estimate`], so
    /// stretches may be correlated. For K stretches the step is 1/√K of the distance, about one standard deviation of the
    /// means. A function with small jumps, such as a median or a fit to a varying set of points, then changes by its
    /// variation from run to run. The smaller steps of leaving out one stretch would double the error of such functions.
    ///
    /// The result is empty if the functions have no value at the means.
    pub fn jackknife(&self, function: impl Fn(&[f64]) -> Option<Vec<f64>>) -> Vec<Measured> {
        if self.is_empty() {
            return Vec::new();
        }
        let means = self.means();
        let Some(values) = function(&means) else { return Vec::new() };
        // The stretches have nearly equal lengths.
        let stretches = self.len().div_ceil(self.len().div_ceil(STRETCHES));
        let step = 1.0 / (stretches as f64).sqrt();
        let moved = |k: usize| {
            let rows = k * self.len() / stretches..(k + 1) * self.len() / stretches;
            let weight = (rows.len() * stretches) as f64 / self.len() as f64;
            let towards = self.means_of(rows);
            let at: Vec<f64> = means.iter().zip(towards).map(|(mean, x)| mean + step * (x - mean)).collect();
            function(&at).map(|moved| (weight / step, moved))
        };
        let moved: Option<Vec<(f64, Vec<f64>)>> = (0..stretches).map(moved).collect();
        let added = |k: usize, value: f64| {
            let added = moved
                .iter()
                .flatten()
                .map(|(weight, at)| weight * (at.get(k).copied().unwrap_or(f64::NAN) - value));
            Measured::mean(&added.collect::<Vec<f64>>()).error
        };
        values
            .iter()
            .enumerate()
            .map(|(k, value)| Measured { value: *value, error: added(k, *value) })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};

    /// A series with the autocorrelation ρ(t) = a^t. The variance of its mean is (1 + a)/(1 − a)/N of the stationary
    /// variance.
    fn exponential(a: f64, count: usize, rng: &mut StdRng) -> Vec<f64> {
        let mut x: f64 = StandardNormal.sample(rng);
        (0..count)
            .map(|_| {
                let step: f64 = StandardNormal.sample(rng);
                x = a * x + (1.0 - a * a).sqrt() * step;
                x
            })
            .collect()
    }

    fn jackknife(series: &Series, function: impl Fn(&[f64]) -> f64) -> Measured {
        series.jackknife(|means| Some(vec![function(means)])).pop().unwrap_or(Measured::NONE)
    }

    #[test]
    fn rows_are_block_means_and_stay_bounded() {
        let mut series = Series::new(2);
        for k in 0..10_000 {
            assert!(series.push(&[k as f64, 1.0]));
            assert!(series.len() < MOST_ROWS);
        }
        assert!(!series.push(&[f64::NAN, 1.0]) && !series.push(&[1.0]));
        let block = series.block as f64;
        for (k, row) in series.rows().enumerate() {
            assert_eq!(row, [k as f64 * block + 0.5 * (block - 1.0), 1.0]);
        }
        assert!(series.samples() <= 10_000 && 10_000 - series.samples() < series.block);
    }

    #[test]
    fn a_series_read_back_goes_on_the_same() {
        let mut rng = StdRng::seed_from_u64(4);
        let values = exponential(0.5, 3000, &mut rng);
        let mut whole = Series::new(1);
        let mut parts = Series::new(1);
        for (k, x) in values.iter().enumerate() {
            whole.push(&[*x]);
            parts.push(&[*x]);
            if k % 701 == 0 {
                let text = serde_json::to_string(&parts).unwrap();
                parts = serde_json::from_str(&text).unwrap();
            }
        }
        assert_eq!(whole, parts);
    }

    /// Blocks are powers of two, of no more samples than there can be.
    #[test]
    fn what_is_no_series_is_not_read() {
        let read = |block: u64| {
            let mut series = serde_json::to_value(Series::new(1)).unwrap();
            series["block"] = block.into();
            serde_json::from_value::<Series>(series).is_ok()
        };
        assert_eq!([1, 2, 3, 4, 1 << 63].map(read), [true, true, false, true, false]);
    }

    /// Mean, ratio and jackknife of 400 correlated series of 8000 samples each with a correlation time of ten. The errors
    /// agree with theory within 10 % on average. Intervals of two errors contain the true value in 95 % of the series:
    /// 380 ± 4.4; the limit 355 is more than five deviations below. The seed is fixed.
    #[test]
    fn errors_of_correlated_series_are_right() {
        let mut rng = StdRng::seed_from_u64(81);
        let (a, count) = (0.9, 8000usize);
        let theory = ((1.0 + a) / (1.0 - a) / count as f64).sqrt();
        let (mut covered, mut sizes) = ([0; 3], [0.0; 3]);
        for _ in 0..400 {
            let (x, y) = (exponential(a, count, &mut rng), exponential(a, count, &mut rng));
            let mut series = Series::new(2);
            for (x, y) in x.iter().zip(&y) {
                series.push(&[*x, 5.0 + 0.1 * y]);
            }
            let ratio_theory = theory / 5.0;
            let found = [
                (series.mean(0), 0.0, theory),
                (series.ratio(|s| s[0], |s| s[1]), 0.0, ratio_theory),
                (jackknife(&series, |m| m[0] / m[1]), 0.0, ratio_theory),
            ];
            for (k, (m, truth, theory)) in found.into_iter().enumerate() {
                covered[k] += usize::from((m.value - truth).abs() < 2.0 * m.error);
                sizes[k] += m.error / theory / 400.0;
            }
        }
        assert!(covered.iter().all(|c| *c >= 355), "{covered:?}");
        assert!(sizes.iter().all(|s| (0.9..1.15).contains(s)), "{sizes:?}");
    }

    /// Jackknife errors for correlated stretches: 100 samples with a correlation time of 4.5 in stretches of five. Errors that
    /// ignore the correlation are 1.6 times too small. The seed is fixed.
    #[test]
    fn correlated_stretches_are_noticed() {
        let mut rng = StdRng::seed_from_u64(82);
        for a in [0.0, 0.5, 0.8, 0.9] {
            let found: Vec<Measured> = (0..400)
                .map(|_| {
                    let mut series = Series::new(1);
                    exponential(a, 100, &mut rng).iter().for_each(|x| _ = series.push(&[*x]));
                    jackknife(&series, |m| m[0] + 0.01 * m[0] * m[0])
                })
                .collect();
            let spread = (found.iter().map(|m| m.value * m.value).sum::<f64>() / 400.0).sqrt();
            let reported = found.iter().map(|m| m.error).sum::<f64>() / 400.0;
            assert!((0.85..1.15).contains(&(spread / reported)), "{a}: {}", spread / reported);
        }
    }

    /// In an oscillating series stretches compensate for each other, and a median jumps. Errors that leave out one stretch in
    /// turn and assume independence are 1.4 to 2.2 times too large for both. The seed is fixed.
    #[test]
    fn swings_and_jumps_have_no_larger_errors() {
        let mut rng = StdRng::seed_from_u64(83);
        let ratio = |found: Vec<Measured>| {
            let count = found.len() as f64;
            let mean = found.iter().map(|m| m.value).sum::<f64>() / count;
            let spread = found.iter().map(|m| (m.value - mean).powi(2)).sum::<f64>() / count;
            (spread / (found.iter().map(|m| m.error.powi(2)).sum::<f64>() / count)).sqrt()
        };
        let swings = (0..400).map(|_| {
            let mut series = Series::new(1);
            let (mut x, mut before) = (0.0, 0.0);
            for k in 0..300 {
                let step: f64 = StandardNormal.sample(&mut rng);
                (before, x) = (x, 1.9 * f64::cos(std::f64::consts::TAU / 20.0) * x - 0.9025 * before + step);
                if k >= 200 {
                    series.push(&[x]);
                }
            }
            jackknife(&series, |m| m[0])
        });
        let swings = ratio(swings.collect());
        assert!((0.85..1.15).contains(&swings), "{swings}");
        let medians = (0..400).map(|_| {
            let mut series = Series::new(31);
            for _ in 0..100 {
                let row: Vec<f64> = (0..31).map(|_| StandardNormal.sample(&mut rng)).collect();
                series.push(&row);
            }
            jackknife(&series, |m| {
                let mut sorted = m.to_vec();
                sorted.sort_by(f64::total_cmp);
                sorted[15]
            })
        });
        let medians = ratio(medians.collect());
        assert!((0.8..1.25).contains(&medians), "{medians}");
    }

    /// Errors of independent values add up as squares. A quotient of two series in one proportion has no error, however large theirs.
    /// 131 rows are 65 stretches of two, and one, the first. A row that stands out says as much about the error in a short stretch as
    /// in a long one.
    #[test]
    fn short_stretches_count_with_their_rows() {
        let error = |outlier: usize| {
            let mut series = Series::new(1);
            for k in 0..131 {
                series.push(&[if k == outlier { 1.0 } else { 0.0 }]);
            }
            jackknife(&series, |m| m[0]).error
        };
        let [short, long] = [0, 65].map(error);
        assert!((short / long - 1.0).abs() < 0.1, "{short} {long}");
        // Of one row in n the error of the mean is 1/n.
        assert!((131.0 * long - 1.0).abs() < 0.1, "{long}");
    }

    #[test]
    fn errors_of_two_values() {
        let (a, b) = (Measured { value: 6.0, error: 3.0 }, Measured { value: 2.0, error: 4.0 });
        for (found, value, error) in [(a.plus(b), 8.0, 5.0), (a.minus(b), 4.0, 5.0), (b.minus(a), -4.0, 5.0)]
        {
            assert_eq!((found.value, found.error), (value, error));
        }
        assert_eq!((b.times(-2.0).value, b.times(-2.0).error), (-4.0, 8.0));
        let quotient = a.over(b);
        assert!(quotient.value == 3.0 && (quotient.error - 3.0 * 0.5f64.hypot(2.0)).abs() < 1e-14);
        let mut rng = StdRng::seed_from_u64(84);
        let mut series = Series::new(2);
        for x in exponential(0.5, 200, &mut rng) {
            series.push(&[3.0 * (5.0 + x), 5.0 + x]);
        }
        let ratio = series.ratio(|s| s[0], |s| s[1]);
        assert!((ratio.value - 3.0).abs() < 1e-14 && ratio.error < 1e-14, "{ratio:?}");
        assert!(series.mean(0).error > 0.1);
    }

    #[test]
    fn short_series_say_what_they_know() {
        assert!(Measured::mean(&[]).value.is_nan());
        let one = Measured::mean(&[2.0]);
        assert!(one.value == 2.0 && one.error.is_nan());
        let two = Measured::mean(&[1.0, 3.0]);
        assert_eq!((two.value, two.error), (2.0, 1.0));
        assert!(jackknife(&Series::new(1), |m| m[0]).value.is_nan());
        assert!(Series::new(2).ratio(|s| s[0], |s| s[1]).value.is_nan());
    }
}
