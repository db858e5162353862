//! The whole calibration of fluids whose local density and pressure are known, in place of runs.

use super::fit::fit_pressure;
use super::*;
use psidpd_observe::{Kind, Observation, Series};
use std::cell::Cell;

const KT: f64 = 0.7;

/// p = kT ρ − a ρ² + b ρ³ in mean field, half of whose attraction is a soft pair force of range 1: (π/30) A ρ² is −ρ² for
/// A = −30/π. Where kT = aρ − bρ² the pressure is zero: at ρ = 3 for a = 5/6 and b = 1/5.
const MODEL: &str = "title = \"known\"\nspecies = [\"F\"]\n[parameters]\na = 0.8333333333333334\nb = 0.2\n\
    [density.n]\nkernel = \"quadratic\"\nrange = 0.75\n[excess_free_energy.F]\n\
    pressure = \"rho*kT + (1 - a)*rho^2 + b*rho^3\"\n\
    [[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = -9.549296585513721\nrange = 1.0\n\
    [[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

/// The wanted pressure, by hand.
fn wanted(rho: f64) -> f64 {
    KT * rho - 5.0 / 6.0 * rho * rho + 0.2 * rho.powi(3)
}

/// ψ′ for p = kT ρ + ρ² ψ′(ρ), without the pair force.
fn slope(x: f64) -> f64 {
    1.0 - 5.0 / 6.0 + 0.2 * x
}

fn options(densities: &[f64], tolerance: f64) -> Options {
    Options {
        kt: KT,
        densities: densities.to_vec(),
        composition: vec![1.0],
        name: None,
        tolerance,
        sampling: Sampling { every: 3, ..Sampling::SHORT },
    }
}

/// What a run of a fluid would have observed with this mean of the local density and this pressure.
fn observed(n: f64, pressure: Measured) -> Observed {
    let scalar = |name: &str, column: &str, value: Measured| {
        Observation::new(name, name, Kind::Scalar, &Series::new(1)).column(column, "1", [value])
    };
    let known = |value| Measured { value, error: 1e-9 };
    let sharp = Observation::new("local_density", "n", Kind::Curve, &Series::new(1))
        .against("n", "1", vec![n - 1e-6, n, n + 1e-6])
        .exact("F", "1", [0.0, 1.0, 0.0]);
    Observed(vec![
        sharp,
        scalar("local_density_means", "mean_F_F", known(n)),
        scalar("temperature", "kinetic", known(KT)),
        scalar("pressure", "conservative", pressure),
    ])
}

fn calibrated(run: Measure, options: &Options) -> Result<Calibration, ExperimentError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("known.toml");
    std::fs::write(&path, MODEL).unwrap();
    calibrate_by(run, &path, options, "a command", &mut |_| {})
}

/// The correction that a fluid is run with; none in the first guess, whose forces are constant.
fn correction(bulk: &Bulk) -> Option<Polynomial> {
    let constant = bulk.model.source().text().contains("n_F");
    (!constant).then(|| bulk.model.at(KT).unwrap().densities[0].correction[0].clone())
}

/// A fluid with ⟨n⟩ = (ρ − 0.5)/1.1, whose pressure beyond the pair force and the ideal gas has a factor.
fn straight(bulk: &Bulk, factor: f64) -> [f64; 2] {
    let rho = bulk.densities[0];
    let n = (rho - 0.5) / 1.1;
    let (value, derivative) = correction(bulk).map_or((rho, DUMMY_SLOPE), |p| p.at(n));
    if correction(bulk).is_none() {
        // The first guess has the force of the bulk at any density.
        let theory = MeanField::new(&bulk.model.at(KT).unwrap()).unwrap();
        for x in [0.5, rho] {
            let found = theory.excess_slopes(0, &[x])[0];
            assert!((found - DUMMY_SLOPE * slope(rho)).abs() < 1e-6, "{rho} {x}: {found}");
        }
    }
    [n, KT * rho - rho * rho + factor * rho * rho * slope(value) * derivative]
}

/// ρ̃ = 0.5 + 1.1 n has ⟨ρ̃⟩ = ρ, and the pressure if the virial lacks the factor 1.1: found in one round, and written into the
/// model with its six digits. The wanted pressures are those of the formula.
#[test]
fn a_fluid_with_a_straight_hole_is_calibrated_in_one_round() {
    let run = |bulk: &Bulk| {
        let [n, pressure] = straight(bulk, 1.0 / 1.1);
        Ok(observed(n, Measured { value: pressure, error: 1e-9 }))
    };
    let densities = spaced(2.0, 6.0, 5);
    let found = calibrated(&run, &options(&densities, 1e-3)).unwrap();
    assert!(found.converged && found.rounds.len() == 1 && found.failed.is_empty(), "{found:?}");
    assert_eq!((found.first_guess, found.density.as_str()), ("constant", "n"));
    let written =
        Model::parse("m.toml", &found.text).unwrap().at(KT).unwrap().densities[0].correction[0].clone();
    assert!((written.0[0] - 0.5).abs() < 1e-6 && (written.0[1] - 1.1).abs() < 1e-6, "{written:?}");
    for (residual, rho) in found.residuals.iter().zip(densities) {
        assert!((residual.wanted - wanted(rho)).abs() < 1e-7 * rho.powi(3), "{residual:?}");
        assert!(
            (residual.corrected[0].value - rho).abs() < 1e-9 && residual.deviation < 1e-6,
            "{residual:?}"
        );
    }
    assert!(found.text.contains("# Corrected density") && !found.text.contains("misses"), "{}", found.text);
}

/// A pressure that is no number at a density is no target, nor is one whose slope has no bound.
#[test]
fn a_density_without_a_pressure_is_named() {
    let pressure = "[excess_free_energy.F]\npressure = \"rho*kT + (1 - a)*rho^2 + b*rho^3\"";
    for (psi, at) in [("ln(8 - n)", 9.0), ("(8 - n)^1.5", 8.0)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pole.toml");
        let pole = MODEL.replace(pressure, &format!("[excess_free_energy]\nF = \"{psi}\""));
        assert_ne!(pole, MODEL);
        std::fs::write(&path, pole).unwrap();
        let run = |_: &Bulk| panic!("nothing is run");
        let found = calibrate_by(&run, &path, &options(&[5.0, at], 1e-3), "a command", &mut |_| {});
        assert!(matches!(found, Err(ExperimentError::NoTarget(x)) if x == at), "{found:?}");
    }
}

/// Where the virial lacks a tenth, one density fixes offset and slope of the correction: the first fit to the pressure meets it,
/// since it knows which part of the pressure is not of ψ.
#[test]
fn a_fit_to_one_pressure_meets_it_at_once() {
    let run = |bulk: &Bulk| {
        let [n, pressure] = straight(bulk, 0.9);
        Ok(observed(n, Measured { value: pressure, error: 1e-9 }))
    };
    let found = calibrated(&run, &options(&[5.0], 1e-4)).unwrap();
    let [density, pressure] = &found.rounds[..] else { panic!("{found:?}") };
    assert!(found.converged && (density.goal, pressure.goal) == (Goal::Density, Goal::Pressure));
    // 0.1 of ρ² ψ′(5) = 25 · 7/6, of a pressure of 7.667.
    assert!((density.pressure_residual - 2.916_667 / 7.666_667).abs() < 1e-4, "{density:?}");
    assert!(pressure.pressure_residual < 1e-6 && pressure.density_residual < 1e-6, "{pressure:?}");
}

/// Deviations are parts of the pressure, and where it is near zero of a tenth of the bulk modulus: at ρ = 3 this is
/// 0.1 · 3 · (0.7 − 5 + 5.4) = 0.33; at ρ = 6 the pressure is 17.4.
#[test]
fn deviations_are_parts_of_the_pressure_or_of_the_modulus() {
    let run = |bulk: &Bulk| {
        let rho = bulk.densities[0];
        Ok(observed((rho - 0.5) / 1.1, Measured { value: wanted(rho) + 0.1, error: 0.01 }))
    };
    let found = calibrated(&run, &options(&[3.0, 6.0], 1e-3)).unwrap();
    let deviations: Vec<f64> = found.residuals.iter().map(|r| r.deviation).collect();
    assert!((deviations[0] - 0.1 / 0.33).abs() < 1e-4, "{deviations:?}");
    assert!((deviations[1] - 0.1 / 17.4).abs() < 1e-4, "{deviations:?}");
    assert!((found.rounds[0].pressure_error - 0.01 / 0.33).abs() < 1e-4, "{found:?}");
    assert!(!found.converged && found.text.contains("misses the requested tolerance"), "{}", found.text);
}

/// A pressure that is met counts only with an error of at most half of the tolerance.
#[test]
fn a_pressure_that_may_be_off_is_not_met() {
    let met = |error: f64| {
        let run = |bulk: &Bulk| {
            let rho = bulk.densities[0];
            let pressure = Measured { value: wanted(rho), error: error * wanted(rho) };
            Ok(observed((rho - 0.5) / 1.1, pressure))
        };
        calibrated(&run, &options(&[5.0, 6.0], 0.01)).unwrap().converged
    };
    assert!(met(0.0049) && !met(0.0051));
}

/// Rounds whose pressures are off by what is known, some of which lose a density: where none meets the tolerance, the one with the
/// fewest losses is chosen, and of these the nearest. The last of all meets it only if its error is small.
#[test]
fn the_round_that_loses_least_and_is_nearest_is_chosen() {
    let densities = [4.0, 5.0, 6.0];
    let offs = [0.2, -0.1, 0.05, -0.08, 0.3, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2];
    let chosen = |lost: &[usize]| {
        let runs = Cell::new(0);
        let run = |bulk: &Bulk| {
            // The first three are of the first guess.
            let batch = (runs.replace(runs.get() + 1) / densities.len()).checked_sub(1);
            let rho = bulk.densities[0];
            if rho == 6.0 && batch.is_some_and(|batch| lost.contains(&batch)) {
                return Err(RunError::TooHot {
                    step: 7,
                    since: 3,
                    ratio: 9.0,
                    dt: 0.01,
                    integrator: "x".into(),
                });
            }
            let off = batch.and_then(|batch| offs.get(batch)).copied().unwrap_or(0.2);
            Ok(observed((rho - 0.5) / 1.1, Measured { value: wanted(rho) * (1.0 + off), error: 0.0 }))
        };
        let found = calibrated(&run, &options(&densities, 0.01)).unwrap();
        assert!(!found.converged && found.text.contains("misses the requested tolerance"));
        let residual = found.rounds[found.chosen].pressure_residual;
        assert!((residual - offs[found.chosen].abs()).abs() < 1e-9, "{found:?}");
        let told = found.text.contains("does not run with it at density 6.");
        (found.chosen, found.failed.iter().map(|f| f.density).collect::<Vec<_>>(), told)
    };
    assert_eq!(chosen(&[]), (2, vec![], false));
    assert_eq!(chosen(&[2]), (3, vec![], false));
    // Where all lose it, the nearest is taken, and what it loses is said.
    assert_eq!(chosen(&(0..40).collect::<Vec<_>>()), (2, vec![6.0], true));
}

/// Six digits, however large a coefficient is.
#[test]
fn coefficients_are_written_with_six_digits() {
    let found = rounded(&Polynomial(vec![1.234_567_8, -0.012_345_678, 1_234.567_8, 0.0, 0.999_999_4]));
    let expected = [1.234_57, -0.012_345_7, 1_234.57, 0.0, 0.999_999];
    for (found, expected) in found.0.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
    }
}

/// Of a density of 1 for three particles of four, and 3 for the fourth: ⟨n⟩ = 3/2, ⟨n²⟩ = 3, ⟨n³⟩ = 15/2.
#[test]
fn means_of_powers_are_those_of_the_distribution() {
    let point = Point {
        total: 2.0,
        own: vec![2.0],
        means: vec![Measured { value: 1.5, error: 0.01 }],
        spread: Some([0.75, 0.75]),
        temperature: Measured { value: KT, error: 0.0 },
        pressure: Measured { value: 1.0, error: 0.0 },
    };
    let moments: Vec<f64> = (0..4).map(|m| point.moment(0, m)).collect();
    assert_eq!(moments, [1.0, 1.5, 3.0, 7.5]);
    // 1 + 2n + 3n² + 4n³ is 1 + 3 + 9 + 30, and at 3/2 has the slope 2 + 9 + 27.
    let corrected = point.corrected(0, &Polynomial(vec![1.0, 2.0, 3.0, 4.0]));
    assert!(
        (corrected.value - 43.0).abs() < 1e-12 && (corrected.error - 0.38).abs() < 1e-12,
        "{corrected:?}"
    );
}

/// Errors of a correction that is fitted to pressures are the scatter of fits to pressures with that noise. 400 fits know it to
/// 3.5 %: more than 15 % off is beyond four standard deviations. The seed is fixed.
#[test]
fn errors_of_a_fit_to_pressures_are_those_of_repeated_fits() {
    use rand::{RngExt, SeedableRng};
    let mut rng = chacha20::ChaCha8Rng::seed_from_u64(11);
    let densities = spaced(3.0, 7.0, 6);
    let start = Polynomial(vec![0.5, 1.1]);
    let targets: Vec<Target> = densities
        .iter()
        .map(|rho| Target { wanted: wanted(*rho), base: KT * rho - rho * rho, scale: 0.5 * rho * rho })
        .collect();
    let mut fits: Vec<Fit> = Vec::new();
    for _ in 0..400 {
        let noisy = |rho: &f64| {
            // Twelve uniform numbers make a normal one.
            let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            let (n, error) = ((rho - 0.5) / 1.1, 0.002 * rho * rho);
            let pressure = KT * rho - rho * rho + rho * rho * slope(*rho) * 1.1;
            let sharp = |value| Measured { value, error: 0.0 };
            Point {
                total: *rho,
                own: vec![*rho],
                means: vec![sharp(n)],
                spread: Some([0.0; 2]),
                temperature: sharp(KT),
                pressure: Measured { value: pressure + error * normal, error },
            }
        };
        let points: Vec<Point> = densities.iter().map(noisy).collect();
        fits.push(fit_pressure(&points, &targets, &slope, &start, 1, 0.02).unwrap());
    }
    for m in 0..2 {
        let mean = fits.iter().map(|fit| fit.coefficients[m]).sum::<f64>() / 400.0;
        let scatter =
            (fits.iter().map(|fit| (fit.coefficients[m] - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
        let stated = fits.iter().map(|fit| fit.errors[m].unwrap()).sum::<f64>() / 400.0;
        assert!((stated / scatter - 1.0).abs() < 0.15, "{m}: {stated} {scatter}");
    }
}
