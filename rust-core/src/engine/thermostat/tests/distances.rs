//! Distances from the lengths of vectors.

use super::*;

/// Species A and B with these exponents of AA and AB, and pairs BB without drag.
fn mixture(aa: f64, ab: f64) -> String {
    TWO.replace("exponent = 2\n", &format!("exponent = {aa:?}\n"))
        .replace("exponent = 0.5\n", &format!("exponent = {ab:?}\n"))
}

/// Every exponent that has a form of its own, and others; one species and two, both precisions. A distance is as accurate as the vector:
/// an error of a few units in the last digit is one of the range over the exponent, or that of the coordinates.
#[test]
fn distances_are_those_of_the_particles() {
    let edges = Matrix3::from_diagonal(&[3.0, 4.1, 5.3].into());
    let one = |exponent: f64| (format!("{ONE}exponent = {exponent:?}\n"), 1, exponent);
    let mut models: Vec<(String, usize, f64)> = [0.25, 0.5, 1.0, 1.75, 2.0, 4.0, 0.7, 5.3].map(one).into();
    models
        .extend([(2.0, 0.5), (1.0, 1.0), (0.7, 1.3)].map(|(aa, ab)| (mixture(aa, ab), 2, f64::min(aa, ab))));
    for (model, species, exponent) in models {
        for (precision, last_digit) in [(Precision::Mixed, 1e-6), (Precision::Double, 1e-14)] {
            let cloud = Cloud { precision, ..Cloud::new(species, edges, [true; 3], 6.0) };
            let mut thermostat = thermostat(&model, 1.0, precision);
            thermostat.find_pairs(&pool(2), &cloud.bodies(), DT, true).unwrap();
            let (distances, order) = (thermostat.distances(), thermostat.lists.order());
            let mut count = 0;
            for plane in &thermostat.planes {
                for [i, j, k] in plane.pairs() {
                    let [a, b] = [i, j].map(|k| cloud.x[order[k] as usize]);
                    let g = plane.lists.own.g(k);
                    let length = |d: [f64; 3]| d.iter().map(|d| d * d).sum::<f64>().sqrt();
                    let r = length(cloud.domain.minimum_image(a, b));
                    let found = distances.per_length(i, j, g) * length(g);
                    assert!((found - r).abs() < last_digit * (1.0 + 1.0 / exponent), "{model}: {found} {r}");
                    count += usize::from(r > 0.0);
                }
            }
            assert!(count > 300, "{model}: {count} pairs");
        }
    }
}
