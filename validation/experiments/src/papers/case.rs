use psidpd_observe::Measured;
use psidpd_report::{Plot, Series, Style};
use serde::Serialize;
use serde_json::{Value, json};

/// Largest deviation that agrees, in units of the combined error.
pub const LIMIT: f64 = 3.0;

/// Largest error of a measured value, as a share of the published one, where the published error is not larger: what is
/// vaguer would agree with anything.
pub const VAGUE: f64 = 0.1;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    Equal,
    AtLeast,
    AtMost,
}

/// Where the value that a measured one is compared with comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The paper prints it, with its error or with digits.
    Printed,
    /// The paper has it as a curve, a formula or words; how near is near enough is our choice.
    Read,
    /// The number is not published: another run of this program, or its mean field.
    Own,
}

/// What a run of full size found of a value that agrees at quick size because that is too short to tell.
#[derive(Debug, Clone, Copy)]
pub struct AtFullSize {
    pub measured: [f64; 2],
    pub why: &'static str,
}

#[derive(Debug, Clone)]
pub struct Compared {
    pub name: String,
    pub measured: Measured,
    /// What is published, or follows from it; or is our own.
    pub published: Measured,
    pub rule: Rule,
    pub source: Source,
    /// That it disagrees at full size, where this is the quick one.
    pub at_full_size: Option<AtFullSize>,
}

impl Compared {
    /// The difference in units of the combined error.
    pub fn deviation(&self) -> f64 {
        let error = self.measured.error.hypot(self.published.error);
        let difference = self.measured.value - self.published.value;
        // Without errors only equal numbers agree.
        let right = match self.rule {
            Rule::Equal => difference == 0.0,
            Rule::AtLeast => difference >= 0.0,
            Rule::AtMost => difference <= 0.0,
        };
        if error == 0.0 && right { 0.0 } else { difference / error }
    }

    /// Whether it agrees. NaN does not, nor what is too vague to disagree, nor what disagrees in a longer run.
    pub fn passes(&self) -> bool {
        self.agrees() && self.at_full_size.is_none()
    }

    /// Whether it agrees by its own numbers.
    pub fn agrees(&self) -> bool {
        let deviation = self.deviation();
        match self.rule {
            Rule::Equal => !self.is_vague() && deviation.abs() <= LIMIT,
            Rule::AtLeast => deviation >= if self.is_vague() { 0.0 } else { -LIMIT },
            Rule::AtMost => deviation <= if self.is_vague() { 0.0 } else { LIMIT },
        }
    }

    /// Whether its error is so large that it tells nothing.
    pub fn is_vague(&self) -> bool {
        self.measured.error > (VAGUE * self.published.value.abs()).max(self.published.error)
    }

    pub fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "measured": self.measured,
            "published": self.published,
            "rule": self.rule,
            "own": self.source == Source::Own,
            "error_is_printed": self.source == Source::Printed,
            "at_full_size": self.at_full_size.map(|full| json!({ "measured": Measured::from(full.measured), "why": full.why })),
            "deviation": self.deviation(),
            "pass": self.passes(),
        })
    }
}

#[derive(Debug, Clone, Default)]
pub struct Reproduction {
    pub values: Vec<Compared>,
    /// File names without extension, and plots.
    pub plots: Vec<(String, Plot)>,
}

impl Reproduction {
    pub fn passes(&self) -> bool {
        !self.values.is_empty() && self.values.iter().all(Compared::passes)
    }

    pub fn equal(
        &mut self,
        name: impl Into<String>,
        measured: impl Into<Measured>,
        published: impl Into<Measured>,
    ) {
        self.add(name, measured, Rule::Equal, published);
    }

    /// Adds a value that is to equal another of this program: that of a run, or of its mean field.
    pub fn own(&mut self, name: impl Into<String>, measured: Measured, own: impl Into<Measured>) {
        self.add(name, measured, Rule::Equal, own).source = Source::Own;
    }

    /// Adds a value that is to equal a curve, a formula or words of the paper as nearly as we chose beforehand.
    pub fn read(
        &mut self,
        name: impl Into<String>,
        measured: impl Into<Measured>,
        read: impl Into<Measured>,
    ) {
        self.add(name, measured, Rule::Equal, read).source = Source::Read;
    }

    pub fn at_least(&mut self, name: impl Into<String>, measured: impl Into<Measured>, value: f64) {
        self.add(name, measured, Rule::AtLeast, value);
    }

    pub fn at_most(&mut self, name: impl Into<String>, measured: impl Into<Measured>, value: f64) {
        self.add(name, measured, Rule::AtMost, value);
    }

    fn add(
        &mut self,
        name: impl Into<String>,
        measured: impl Into<Measured>,
        rule: Rule,
        published: impl Into<Measured>,
    ) -> &mut Compared {
        let (name, measured, published) = (name.into(), measured.into(), published.into());
        self.values.push_mut(Compared {
            name,
            measured,
            published,
            rule,
            source: Source::Printed,
            at_full_size: None,
        })
    }

    pub fn plot(&mut self, file: impl Into<String>, title: &str, axes: [&str; 2], series: Vec<Series>) {
        self.plots.push((file.into(), Plot::new(title, axes, series)));
    }
}

pub fn points(name: &str, points: &[(f64, Measured)]) -> Series {
    let errors = points.iter().map(|(_, y)| y.error).collect();
    Series::new(name, bare(points), Style::Points).with_errors(errors)
}

pub fn curve(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series::new(name, points, Style::Line)
}

/// Means amid two layers that fill a periodic box, one of which is in the middle of the profile: over a quarter of the
/// box amid the other, then amid this one.
pub fn layers(profile: &[(f64, Measured)]) -> [Measured; 2] {
    let count = profile.len();
    let mean = |from: usize| {
        let some = || profile.iter().cycle().skip(from).take(count / 4).map(|(_, c)| *c);
        let n = some().count() as f64;
        let variance: f64 = some().map(|c| c.error * c.error).sum();
        // Neighbouring bins move together: their errors are not averaged out.
        Measured { value: some().map(|c| c.value).sum::<f64>() / n, error: (variance / n).sqrt() }
    };
    [mean(count - count / 8), mean(count / 2 - count / 8)]
}

/// The highest point of a profile, or with a `sign` of −1 the lowest.
pub fn extreme(profile: &[(f64, Measured)], sign: f64) -> Measured {
    let values = profile.iter().map(|(_, d)| *d);
    values.max_by(|a, b| (sign * a.value).total_cmp(&(sign * b.value))).unwrap_or(Measured::NONE)
}

/// A profile without its errors.
pub fn bare(points: &[(f64, Measured)]) -> Vec<(f64, f64)> {
    points.iter().map(|(x, y)| (*x, y.value)).collect()
}

/// A curve at 100 places.
pub fn line(low: f64, high: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..=100).map(|k| low + (high - low) * f64::from(k) / 100.0).map(|x| (x, f(x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(rule: Rule, value: f64) -> Compared {
        let measured = Measured { value, error: 0.3 };
        let published = Measured { value: 10.0, error: 0.4 };
        Compared { name: "x".into(), measured, published, rule, source: Source::Printed, at_full_size: None }
    }

    /// Three errors of more than a tenth would let a value pass that is 30 % off. Where the published error is larger than
    /// that, its own may be as large.
    #[test]
    fn an_error_of_more_than_a_tenth_is_too_vague() {
        let of = |error: f64, published_error: f64| Compared {
            measured: Measured { value: 10.0, error },
            published: Measured { value: 10.0, error: published_error },
            ..compared(Rule::Equal, 0.0)
        };
        assert!(of(0.99, 0.4).passes() && !of(1.01, 0.4).passes());
        assert!(of(1.99, 2.0).passes() && !of(2.01, 2.0).passes());
    }

    /// Relative errors of a quotient add up by squares: (6 ± 0.3)/(3 ± 0.2) is 2 ± √(0.1² + (2/15)²) = 2 ± 1/6.
    #[test]
    fn both_errors_are_in_that_of_a_quotient() {
        let found = Measured { value: 6.0, error: 0.3 }.over([3.0, 0.2]);
        assert!(found.value == 2.0 && (found.error - 1.0 / 6.0).abs() < 1e-15, "{found:?}");
    }

    /// Sixteen bins, of which four in the middle of each layer are averaged; bins that move together have the error of one.
    #[test]
    fn layers_have_the_error_of_a_bin() {
        let at = |k: usize| Measured { value: if (4..12).contains(&k) { 3.0 } else { 1.0 }, error: 0.1 };
        let profile: Vec<(f64, Measured)> = (0..16).map(|k| (k as f64, at(k))).collect();
        let [other, this] = layers(&profile);
        assert_eq!((other.value, this.value), (1.0, 3.0));
        assert!((other.error - 0.1).abs() < 1e-15 && (this.error - 0.1).abs() < 1e-15, "{other:?} {this:?}");
    }

    #[test]
    fn what_is_our_own_says_so() {
        let mut outcome = Reproduction::default();
        outcome.equal("x", 1.0, [1.0, 0.1]);
        outcome.own("y", 1.0.into(), [2.0, 0.1]);
        outcome.read("z", 1.0, [1.1, 0.1]);
        let flags =
            |key: &str| -> Vec<bool> { outcome.values.iter().map(|v| v.to_json()[key] == true).collect() };
        assert_eq!(
            (flags("own"), flags("error_is_printed")),
            (vec![false, true, false], vec![true, false, false])
        );
        assert!(outcome.values[0].passes() && !outcome.values[1].passes() && outcome.values[2].passes());
    }

    #[test]
    fn what_fails_at_full_size_fails() {
        let why = "the radius";
        let short = Compared {
            at_full_size: Some(AtFullSize { measured: [13.0, 0.1], why }),
            ..compared(Rule::Equal, 10.0)
        };
        assert!(short.agrees() && !short.passes());
        assert_eq!(short.to_json()["at_full_size"]["why"], why);
    }

    #[test]
    fn deviations_are_in_combined_errors_and_trends_have_one_side() {
        assert!((compared(Rule::Equal, 11.0).deviation() - 2.0).abs() < 1e-12);
        assert!(compared(Rule::Equal, 11.49).passes() && !compared(Rule::Equal, 8.49).passes());
        assert!(compared(Rule::AtLeast, 20.0).passes() && !compared(Rule::AtLeast, 8.0).passes());
        assert!(compared(Rule::AtMost, 2.0).passes() && !compared(Rule::AtMost, 12.0).passes());
        assert!(!compared(Rule::AtMost, f64::NAN).passes());
        let nothing = Compared { measured: Measured::NONE, ..compared(Rule::Equal, 0.0) };
        assert!(!nothing.passes());
        let exact = |value| Compared {
            measured: Measured { value, error: 0.0 },
            published: Measured { value: 1.0, error: 0.0 },
            ..compared(Rule::AtMost, 0.0)
        };
        assert_eq!(exact(0.5).deviation(), 0.0);
        assert!(!exact(1.5).passes());
        let vague =
            |rule, value| Compared { measured: Measured { value, error: 400.0 }, ..compared(rule, 0.0) };
        assert!(!vague(Rule::Equal, 10.0).passes() && vague(Rule::Equal, 10.0).deviation() == 0.0);
        assert!(vague(Rule::AtLeast, 11.0).passes() && !vague(Rule::AtLeast, 9.0).passes());
        assert!(vague(Rule::AtMost, 9.0).passes() && !vague(Rule::AtMost, 11.0).passes());
        assert!(!Reproduction::default().passes(), "a case without values says nothing");
    }
}
