use serde::{Deserialize, Serialize};

/// The least, the middle and the greatest of measurements of one thing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Spread {
    pub min: f64,
    /// The middle; between two middle ones their mean.
    pub median: f64,
    pub max: f64,
}

impl Spread {
    /// The spread of `values`; `None` if there are none, or one is not finite.
    pub fn of(values: &[f64]) -> Option<Spread> {
        if values.is_empty() || !values.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let median = match sorted.len() % 2 {
            0 => 0.5 * (sorted[middle - 1] + sorted[middle]),
            _ => sorted[middle],
        };
        Some(Spread { min: sorted[0], median, max: sorted[sorted.len() - 1] })
    }

    /// The spread of the ratios of what was measured in the same round: what slows a whole round down cancels.
    pub fn of_ratios(above: &[f64], below: &[f64]) -> Option<Spread> {
        let ratios: Vec<f64> = above.iter().zip(below).map(|(a, b)| a / b).collect();
        Spread::of(&ratios)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_few_and_many() {
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[1.0, f64::NAN]), None);
        assert_eq!(Spread::of(&[2.0]), Some(Spread { min: 2.0, median: 2.0, max: 2.0 }));
        assert_eq!(Spread::of(&[3.0, 1.0]), Some(Spread { min: 1.0, median: 2.0, max: 3.0 }));
        assert_eq!(Spread::of(&[9.0, 1.0, 2.0]), Some(Spread { min: 1.0, median: 2.0, max: 9.0 }));
    }

    /// A machine that is half as fast in every second round changes no ratio.
    #[test]
    fn ratios_are_taken_round_by_round() {
        let (a, b) = ([8.0, 4.0, 8.0, 4.0], [2.0, 1.0, 2.0, 1.0]);
        assert_eq!(Spread::of_ratios(&a, &b), Some(Spread { min: 4.0, median: 4.0, max: 4.0 }));
        assert_eq!(Spread::of_ratios(&a, &[0.0; 4]), None);
        assert_eq!(Spread::of_ratios(&[], &b), None);
    }
}
