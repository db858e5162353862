//! The highest point of a measured curve.

use super::{Kind, Measured, Observation, Series};

/// The height and the place of the highest point of a curve, whose values are the first channels of `series`: of the parabola
/// through the largest mean and its neighbours. `None` where the largest mean is at an end.
pub fn peak(name: &str, title: &str, unit: &str, places: &[f64], series: &Series) -> Option<Observation> {
    let means = series.means();
    let top = (0..places.len()).max_by(|a, b| means[*a].total_cmp(&means[*b]))?;
    if top == 0 || top + 1 == places.len() {
        return None;
    }
    // Errors are those of the point near this maximum, not of the highest of all that could be highest.
    let [a, b, c] = [top - 1, top, top + 1].map(|k| places[k]);
    let found = series.jackknife(|means| {
        let [p, q, r] = [top - 1, top, top + 1].map(|k| means[k]);
        // Newton's form: q + slope (x − b) + bend (x − a)(x − b).
        let slope = (q - p) / (b - a);
        let bend = ((r - q) / (c - b) - slope) / (c - a);
        let place = (0.5 * (a + b) - 0.5 * slope / bend).clamp(a, c);
        Some(match bend < 0.0 {
            true => vec![q + (slope + bend * (place - a)) * (place - b), place],
            false => vec![q, b],
        })
    });
    let [height, place] = found[..] else { return None };
    let of = |value: Measured| [value];
    Some(Observation::new(name, title, Kind::Scalar, series).column("height", "1", of(height)).column(
        "at",
        unit,
        of(place),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of parabolas of known height and place, left and right of their highest point, on points that are not evenly spaced,
    /// each multiplied by a factor: the height is that of the mean factor with its error, and the place has none.
    #[test]
    fn the_top_of_a_parabola_is_found() {
        let places = [0.0, 0.4, 1.0, 1.5, 2.2, 2.6];
        let factors: Vec<f64> = (0..400).map(|k| 1.0 + 0.1 * f64::from(k * k).sin()).collect();
        let factor = Measured::mean(&factors);
        for top in [0.8, 1.1, 1.3, 1.7] {
            let values = places.map(|x: f64| 3.0 - (x - top) * (x - top));
            let mut series = Series::new(places.len());
            factors.iter().for_each(|factor| assert!(series.push(&values.map(|y| factor * y))));
            let found = peak("curve_peak", "Peak", "length", &places, &series).unwrap();
            let [height, place] = ["height", "at"].map(|name| found.scalar(name).unwrap());
            assert!((height.value - 3.0 * factor.value).abs() < 1e-12, "{top}: {found:?}");
            assert!((place.value - top).abs() < 1e-12 && place.error < 1e-12, "{top}: {found:?}");
            let share = height.error / (3.0 * factor.error);
            assert!((0.7..1.4).contains(&share), "{share}: {found:?}");
        }
        let mut rising = Series::new(places.len());
        (0..20).for_each(|_| assert!(rising.push(&places)));
        assert!(peak("curve_peak", "Peak", "length", &places, &rising).is_none());
    }
}
