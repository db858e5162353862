//! `ψ` from measured or tabulated pressures.

use super::Spline;

/// Number of points of the table of ψ, from the first to the last density of the pressure table.
const POINTS: usize = 2000;

/// `ψ(ρ)` from the spline through `p(ρ)`: `ψ′ = (p − ρkT)/ρ²`, integrated by Simpson's rule from the
/// first density, where ψ = 0. Beyond the ends of the table ψ has a constant second derivative.
///
/// # Errors
/// Fails, in words, for a density that is not positive or a pressure too steep to integrate.
pub fn psi(pressure: &Spline, kt: f64) -> Result<Spline, String> {
    let [low, high] = pressure.ends();
    if low <= 0.0 {
        return Err(format!("densities of a pressure must be positive: the first is {low}"));
    }
    let slope = |rho: f64| (pressure.at(rho)[0] - rho * kt) / (rho * rho);
    let step = (high - low) / POINTS as f64;
    let at = |k: usize| if k == POINTS { high } else { low + k as f64 * step };
    let (mut rho, mut psi, mut sum) = (vec![low], vec![0.0], 0.0);
    for k in 0..POINTS {
        let (a, b) = (at(k), at(k + 1));
        sum += (b - a) / 6.0 * (slope(a) + 4.0 * slope(0.5 * (a + b)) + slope(b));
        rho.push(b);
        psi.push(sum);
    }
    Spline::new(rho, psi).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pressure_of_the_table_comes_back() {
        let p = |rho: f64| 1.3 * rho + 2.0 * rho * rho - 0.05 * rho.powi(3);
        let rho: Vec<f64> = (1..=40).map(|k| 0.25 * f64::from(k)).collect();
        let table = Spline::new(rho.clone(), rho.iter().map(|r| p(*r)).collect()).unwrap();
        let psi = psi(&table, 1.3).unwrap();
        for k in 1..60 {
            let rho = 0.3 + 0.16 * f64::from(k);
            let found = 1.3 * rho + rho * rho * psi.at(rho)[1];
            assert!((found - p(rho)).abs() < 1e-5 * p(rho), "{rho}: {found} {}", p(rho));
        }
        let zero = Spline::new(vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 3.0]).unwrap();
        assert!(super::psi(&zero, 1.0).unwrap_err().contains("the first is 0"));
    }
}
