//! Drift of a quantity that should be conserved.

use psidpd_core::maximum::largest;
use serde::Serialize;

use super::error::ObserveError;
use super::statistics::estimate;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drift {
    /// Least-squares slope b = Σ (tᵢ − t̄)(xᵢ − x̄) / Σ (tᵢ − t̄)², in the units of the series per unit of time.
    pub slope: f64,
    /// One standard deviation of the slope,
    /// √(2τ Σ rᵢ² / (N − 2) / Σ (tᵢ − t̄)²), in the units of the slope, where
    /// r are the residuals of the line and τ is their integrated
    /// autocorrelation time in samples.
    pub slope_error: f64,
    /// The last value minus the first, in the units of the series.
    pub net: f64,
    /// The largest departure from the first value, |xᵢ − x₀|, in the units of the series.
    pub largest: f64,
}

/// Drift of `values` taken at the increasing `times`.
///
/// The autocorrelation time of the residuals counts samples, so the error of
/// the slope holds for times that are about evenly spaced.
pub fn drift(times: &[f64], values: &[f64]) -> Result<Drift, ObserveError> {
    if times.len() != values.len() {
        return Err(ObserveError::Times { times: times.len(), values: values.len() });
    }
    let mean = estimate(values)?.mean;
    let mut before = f64::NEG_INFINITY;
    for (index, &t) in times.iter().enumerate() {
        if !t.is_finite() || t <= before {
            return Err(ObserveError::Time { index });
        }
        before = t;
    }
    let n = times.len() as f64;
    let (start, first) = (times[0], values[0]);
    let middle = start + times.iter().map(|t| t - start).sum::<f64>() / n;
    let (mut tt, mut tx) = (0.0, 0.0);
    for (t, x) in times.iter().zip(values) {
        tt += (t - middle) * (t - middle);
        tx += (t - middle) * (x - mean);
    }
    let slope = tx / tt;
    let residuals: Vec<f64> =
        times.iter().zip(values).map(|(t, x)| (x - mean) - slope * (t - middle)).collect();
    if !(tt.is_finite() && slope.is_finite() && residuals.iter().all(|r| r.is_finite())) {
        return Err(ObserveError::Overflow);
    }
    let tau = estimate(&residuals)?.tau.max(0.5);
    let variance = residuals.iter().map(|r| r * r).sum::<f64>() / (n - 2.0);
    Ok(Drift {
        slope,
        slope_error: (2.0 * tau * variance / tt).sqrt(),
        net: values[values.len() - 1] - first,
        largest: largest(values.iter().map(|x| (x - first).abs())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn a_line_is_exact() {
        let times: Vec<f64> = (0..50).map(|i| 10.0 + 0.5 * f64::from(i)).collect();
        let values: Vec<f64> = times.iter().map(|t| 3.0 - 2.0 * t).collect();
        let d = drift(&times, &values).unwrap();
        assert!((d.slope + 2.0).abs() < 1e-12 && d.slope_error < 1e-12);
        assert!((d.net + 49.0).abs() < 1e-12 && (d.largest - 49.0).abs() < 1e-12);
    }

    /// Slopes of 300 driftless correlated series lie within two errors of zero 286 ± 3.6 times if the error is exact.
    /// The limit of 265 also allows for the correlation that the fitted line removes from the residuals. Errors for
    /// uncorrelated samples would give about 106.
    #[test]
    fn slope_errors_allow_for_correlation() {
        let mut rng = StdRng::seed_from_u64(23);
        let times: Vec<f64> = (0..2000).map(f64::from).collect();
        let covered = (0..300)
            .filter(|_| {
                let mut x: f64 = 0.0;
                let values: Vec<f64> = times
                    .iter()
                    .map(|_| {
                        let step: f64 = StandardNormal.sample(&mut rng);
                        x = 0.9 * x + step;
                        x
                    })
                    .collect();
                let d = drift(&times, &values).unwrap();
                d.slope.abs() < 2.0 * d.slope_error
            })
            .count();
        assert!(covered >= 265, "{covered} of 300");
    }

    #[test]
    fn bad_series_are_refused() {
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(drift(&times, &[0.0; 9]), Err(ObserveError::Times { times: 10, values: 9 }));
        assert_eq!(drift(&[0.0; 10], &[0.0; 10]), Err(ObserveError::Time { index: 1 }));
        assert!(matches!(drift(&times, &[f64::NAN; 10]), Err(ObserveError::NonFinite { index: 0 })));
        assert!(drift(&[], &[]).is_err());
        let huge: Vec<f64> = times.iter().map(|t| t * 1e200).collect();
        assert!(drift(&huge, &times).is_err());
    }
}
