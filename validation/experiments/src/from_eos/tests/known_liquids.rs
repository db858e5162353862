//! Models of a liquid whose properties are known, with fluids whose tension and pressure are known in place of runs.

use super::*;

fn liquid() -> Liquid {
    Liquid {
        density: 5000.0,
        pressure: 2e5,
        compressibility: 1.5e-9,
        tension: 0.02,
        compressed: vec![(5250.0, 4e7), (6000.0, 2.6e8)],
    }
}

fn options(molecules: f64, density: f64) -> Options {
    Options {
        temperature: 320.0,
        molecules,
        density,
        range: 0.75,
        tolerance: 0.03,
        sampling: Sampling::SHORT,
    }
}

fn decane() -> Substance {
    Substance::find("decane").unwrap()
}

fn close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
}

/// The density of the model is that of the liquid, kT is the energy, and units of pressure, tension and time follow from length,
/// energy and mass, whatever a particle has of molecules.
#[test]
fn units_agree_with_each_other_and_with_the_liquid() {
    let (substance, liquid) = (decane(), liquid());
    for (molecules, density) in [(1.0, 6.0), (3.0, 6.0), (0.5, 7.5)] {
        let u = Units::new(&substance, &liquid, &options(molecules, density));
        close(density * u.mass / u.length.powi(3), liquid.density * substance.molar_mass);
        close(density * molecules / u.length.powi(3), liquid.density * 6.022_140_76e23);
        close(u.energy, 1.380_649e-23 * 320.0);
        close(u.pressure * u.length.powi(3), u.energy);
        close(u.tension * u.length.powi(2), u.energy);
        close(u.mass * (u.length / u.time).powi(2), u.energy);
    }
}

/// A fluid whose tension is a tenth of the square of its strength, whose slab is 2 % too thin, and which is pressed as it should be.
struct Known {
    wanted: f64,
    calibrated: bool,
    strengths: Vec<f64>,
}

impl Measures for Known {
    fn calibrated(&mut self, path: &Path, _: &str) -> Result<(String, bool), ExperimentError> {
        let text = std::fs::read_to_string(path).unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        self.strengths.push(table["parameters"]["A"].as_float().unwrap());
        Ok((format!("# calibrated\n{text}"), self.calibrated))
    }

    fn slab(&mut self, path: &Path) -> Result<[Measured; 2], ExperimentError> {
        assert!(std::fs::read_to_string(path).unwrap().starts_with("# calibrated\n"));
        let strength = self.strengths[self.strengths.len() - 1];
        let tension = self.wanted * (strength / -52.0).powi(2) + 0.004 * (strength + 52.0);
        Ok([Measured { value: 0.98 * 7.5, error: 0.03 }, Measured { value: tension, error: 0.1 }])
    }

    /// 2 at the density of the liquid, and 10 where it is 5 % denser.
    fn pressure(&mut self, _: &Path, density: f64) -> Result<Measured, ExperimentError> {
        let value = 2.0 + 8.0 * (density / 7.5 - 1.0) / 0.05;
        Ok(Measured { value, error: 0.3 })
    }
}

fn found(calibrated: bool) -> (Found, Known, Units) {
    let (substance, liquid, options) = (decane(), liquid(), options(3.0, 7.5));
    let units = Units::new(&substance, &liquid, &options);
    let mut known = Known { wanted: liquid.tension / units.tension, calibrated, strengths: Vec::new() };
    let folder = temporary_folder().unwrap();
    let found =
        model_of(&liquid, &substance, &options, "a command", &mut |_| {}, folder.path(), &mut known).unwrap();
    (found, known, units)
}

/// The strength with the wanted tension is −52; it is found within the tolerance of 3 %, of which the tension has twice as much, and
/// what was measured is told in SI units.
#[test]
fn the_strength_with_the_wanted_tension_is_found() {
    let (found, known, units) = found(true);
    let last = found.trials.last().unwrap();
    assert!(found.converged && (last.attraction / -52.0 - 1.0).abs() < 0.015, "{:?}", found.trials);
    assert_eq!(known.strengths[0], -40.0);
    let tried: Vec<f64> = found.trials.iter().map(|t| t.attraction).collect();
    assert!(tried == known.strengths && tried.len() <= 3, "{tried:?}");
    assert!(found.text.starts_with("# calibrated\n"));

    let [density, squeezed, tension] = &found.compared[..] else { panic!("{:?}", found.compared) };
    let mass = 5000.0 * decane().molar_mass;
    close(density.wanted, mass);
    close(density.measured.value, 0.98 * mass);
    close(density.measured.error, 0.004 * mass);
    close(squeezed.wanted, 1e9 * 1.05f64.ln() / (4e7 - 2e5));
    close(squeezed.measured.value, 1e9 * 1.05f64.ln() / (8.0 * units.pressure));
    close(squeezed.measured.error / squeezed.measured.value, 0.3 * 2f64.sqrt() / 8.0);
    close(tension.wanted, 20.0);
    close(tension.measured.value, 1e3 * last.tension.value * units.tension);
    close(tension.measured.error, 100.0 * units.tension);
}

/// A tension that is met with pressures that are not is no model.
#[test]
fn pressures_that_are_not_met_are_said() {
    let (found, ..) = found(false);
    assert!(!found.converged && found.trials.iter().all(|t| !t.calibrated));
}
