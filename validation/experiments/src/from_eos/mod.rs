//! A model of a real liquid from its equation of state.
//!
//! 1. The equation of state gives the saturated liquid at a temperature: density, compressibility, tension, and the
//!    pressures of the compressed liquid ([`Liquid`]).
//! 2. N_m molecules are a particle. The unit of length r_c puts the liquid at the number density asked for, the unit of
//!    energy is kT ([`Units`]).
//! 3. The fluid is Warren's: a soft attraction of strength A and range r_c, which makes the tension, and a ψ of shorter
//!    range with the rest of the pressure (P. B. Warren, Phys. Rev. E 68, 066702 (2003)).
//! 4. For some A the corrected density is found that gives the pressures (as `psidpd calibrate`), and the tension of a slab
//!    is measured; A is sought by the secant through two of them, until the tension is that of the liquid.

mod equation;
mod fluid;
mod substance;
mod units;

pub use equation::Liquid;
pub use substance::Substance;
pub use units::Units;

use crate::ExperimentError;
use crate::bulk::{self, Bulk, Sampling};
use crate::calibrate::{Options as Calibrate, calibrate, spaced};
use psidpd_core::model::Model;
use psidpd_dynamics::run::Begin;
use psidpd_dynamics::scene::Scene;
use psidpd_formats::files::{Existing, temporary_folder, write_bytes};
use psidpd_observe::Measured;
use serde::Serialize;
use std::path::Path;

#[derive(Debug, Clone)]
pub struct Options {
    /// Temperature in kelvin.
    pub temperature: f64,
    /// Molecules in a particle.
    pub molecules: f64,
    /// Particles in r_c³ of the liquid.
    pub density: f64,
    /// Range of ψ in r_c, below 1.
    pub range: f64,
    /// Largest relative difference of the tension, and of pressures as `calibrate` has it.
    pub tolerance: f64,
    pub sampling: Sampling,
}

#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    pub attraction: f64,
    /// Tension of the slab, in kT/r_c².
    pub tension: Measured,
    /// Whether its pressures met the tolerance.
    pub calibrated: bool,
}

/// A quantity of the equation of state and of the model, in SI units.
#[derive(Debug, Clone, Serialize)]
pub struct Property {
    /// What it is, with its unit.
    pub name: &'static str,
    pub wanted: f64,
    pub measured: Measured,
}

#[derive(Debug, Clone, Serialize)]
pub struct Found {
    pub substance: String,
    /// Temperature in kelvin.
    pub temperature: f64,
    /// Molecules in a particle.
    pub molecules: f64,
    pub units: Units,
    /// Strengths that were tried; the last is that of the model.
    pub trials: Vec<Trial>,
    /// Density, compressibility and tension of the liquid.
    pub compared: Vec<Property>,
    /// Whether pressures and tension meet the tolerance.
    pub converged: bool,
    #[serde(skip)]
    pub text: String,
}

const TRIALS: usize = 5;

/// What is measured of the model in a file.
trait Measures {
    /// The model with its corrected density, and whether its pressures met the tolerance.
    fn calibrated(&mut self, path: &Path, command: &str) -> Result<(String, bool), ExperimentError>;
    /// Density of the liquid and tension of a slab.
    fn slab(&mut self, path: &Path) -> Result<[Measured; 2], ExperimentError>;
    /// The pressure at a density.
    fn pressure(&mut self, path: &Path, density: f64) -> Result<Measured, ExperimentError>;
}

pub fn from_eos(
    substance: &Substance,
    options: &Options,
    command: &str,
    told: &mut dyn FnMut(&str),
) -> Result<Found, ExperimentError> {
    let liquid = equation::liquid(substance, options.temperature)?;
    let folder = temporary_folder()?;
    let mut runs = Runs { options, folder: folder.path() };
    model_of(&liquid, substance, options, command, told, folder.path(), &mut runs)
}

/// The model of a liquid that is known, by trials in a folder.
fn model_of(
    liquid: &Liquid,
    substance: &Substance,
    options: &Options,
    command: &str,
    told: &mut dyn FnMut(&str),
    folder: &Path,
    measures: &mut dyn Measures,
) -> Result<Found, ExperimentError> {
    let units = Units::new(substance, liquid, options);
    let wanted = liquid.tension / units.tension;
    told(&format!(
        "liquid of {:.1} kg/m3; r_c = {:.3} nm; targets in reduced units: dp/drho = {:.1}, tension = {wanted:.2}",
        liquid.density * substance.molar_mass,
        units.length * 1e9,
        1.0 / (liquid.compressibility * units.pressure * options.density),
    ));
    let path = folder.join("trial.toml");
    let mut trials: Vec<Trial> = Vec::new();
    // Between these the tension of Warren's fluids is 5 to 15.
    let mut attraction = -40.0;
    loop {
        let text = fluid::model(substance, liquid, &units, options, attraction, command)?;
        write_bytes(&path, Existing::Keep, text.as_bytes())?;
        let (text, calibrated) = measures.calibrated(&path, command)?;
        write_bytes(&path, Existing::Keep, text.as_bytes())?;
        let [dense, tension] = measures.slab(&path)?;
        told(&format!(
            "A = {attraction:.2}: tension {:.2} ± {:.2}, pressures {}met",
            tension.value,
            tension.error,
            if calibrated { "" } else { "not " }
        ));
        trials.push(Trial { attraction, tension, calibrated });
        let met = (tension.value / wanted - 1.0).abs() <= options.tolerance;
        let next = next(&trials, wanted);
        if met || trials.len() == TRIALS || next.is_none() {
            let (compressibility, by_eos) =
                compressibility(liquid, options, &units, &mut |rho| measures.pressure(&path, rho))?;
            let property = |name, wanted, measured| Property { name, wanted, measured };
            let mass = liquid.density * substance.molar_mass;
            let squeezed = "isothermal compressibility up to 5 % denser, 1/GPa";
            let compared = vec![
                property("density, kg/m3", mass, dense.times(mass / options.density)),
                property(squeezed, by_eos * 1e9, compressibility.times(1e9)),
                property("surface tension, mN/m", liquid.tension * 1e3, tension.times(units.tension * 1e3)),
            ];
            return Ok(Found {
                substance: substance.name.clone(),
                temperature: options.temperature,
                molecules: options.molecules,
                units,
                converged: met && calibrated,
                trials,
                compared,
                text,
            });
        }
        attraction = next.unwrap_or(attraction);
    }
}

/// Measures by runs, in a folder.
struct Runs<'a> {
    options: &'a Options,
    folder: &'a Path,
}

impl Measures for Runs<'_> {
    fn calibrated(&mut self, path: &Path, command: &str) -> Result<(String, bool), ExperimentError> {
        let Options { density, tolerance, sampling, .. } = *self.options;
        let calibration = calibrate(
            path,
            &Calibrate {
                kt: 1.0,
                densities: spaced(density, 1.15 * density, 5),
                composition: vec![1.0],
                name: None,
                tolerance,
                sampling,
            },
            command,
            &mut |_| {},
        )?;
        Ok((calibration.text, calibration.converged))
    }

    fn slab(&mut self, path: &Path) -> Result<[Measured; 2], ExperimentError> {
        slab(path, self.options, self.folder)
    }

    fn pressure(&mut self, path: &Path, density: f64) -> Result<Measured, ExperimentError> {
        let model = Model::open(path)?;
        let sampling = Sampling { steps: 3 * self.options.sampling.steps, ..self.options.sampling };
        let bulk = Bulk { model: &model, kt: 1.0, densities: &[density], observe: "", sampling };
        Ok(bulk.run(path, &self.folder.join("bulk"))?.pressure())
    }
}

/// Density of the liquid and tension of a slab of the model in the file `path`, in its vapour.
fn slab(path: &Path, options: &Options, folder: &Path) -> Result<[Measured; 2], ExperimentError> {
    let dt = options.sampling.dt;
    let text = format!(
        "title = \"slab\"\nmodel = \"trial.toml\"\nkT = 1.0\nseed = {}\nbox = [7.0, 7.0, 18.0]\ndt = {dt:?}\nequilibrate = {}\n\
         steps = {}\n[initial]\nkind = \"slab\"\naxis = \"z\"\nthickness = 9.0\ndensity = {:?}\n[output]\nthermo = 0\n[observe]\n\
         every = 10\nsurface_tension = {{ every = 20 }}\ninterface_width = true\n",
        options.sampling.seed,
        options.sampling.equilibrate * 3,
        options.sampling.steps * 8,
        options.density,
    );
    let scene = Scene::parse("slab", &text, path.parent().unwrap_or(Path::new("")))?;
    let observed = bulk::run(&scene, &folder.join("slab"), Begin::Overwrite, options.sampling.threads, None)?;
    Ok([observed.scalar("interface_width", "liquid"), observed.scalar("surface_tension", "stress")])
}

/// The next strength: a step that should change the tension as it must, then the secant. None if trials no longer
/// tell where to go.
fn next(trials: &[Trial], wanted: f64) -> Option<f64> {
    let next = match trials {
        [.., a, b] => {
            let slope = (b.tension.value - a.tension.value) / (b.attraction - a.attraction);
            b.attraction + (wanted - b.tension.value) / slope
        }
        // The tension grows about as the square of the strength.
        [one] => one.attraction * (wanted / one.tension.value).abs().sqrt().clamp(0.6, 1.6),
        [] => return None,
    };
    (next.is_finite() && (-200.0..-5.0).contains(&next)).then_some(next)
}

/// Δ ln ρ/Δp in 1/Pa between the liquid and its first compressed state, of the model and by the equation of state.
fn compressibility(
    liquid: &Liquid,
    options: &Options,
    units: &Units,
    pressure: &mut dyn FnMut(f64) -> Result<Measured, ExperimentError>,
) -> Result<(Measured, f64), ExperimentError> {
    let Some((denser, compressed)) = liquid.compressed.first() else {
        return Err(ExperimentError::Equation("no pressures of the compressed liquid".into()));
    };
    let factor = denser / liquid.density;
    let (a, b) = (pressure(options.density)?, pressure(factor * options.density)?);
    let found = Measured::from(factor.ln()).over(b.minus(a).times(units.pressure));
    Ok((found, factor.ln() / (compressed - liquid.pressure)))
}

#[cfg(test)]
mod tests {
    use super::*;

    mod known_liquids;

    #[test]
    fn the_strength_follows_the_tension() {
        let trial = |attraction: f64, tension: f64| Trial {
            attraction,
            tension: Measured { value: tension, error: 0.1 },
            calibrated: true,
        };
        assert_eq!(next(&[trial(-40.0, 8.0)], 8.0), Some(-40.0));
        assert!(next(&[trial(-40.0, 8.0)], 10.0).unwrap() < -40.0);
        assert!((next(&[trial(-40.0, 8.0), trial(-50.0, 12.0)], 10.0).unwrap() + 45.0).abs() < 1e-9);
        // Two equal tensions lead nowhere.
        assert_eq!(next(&[trial(-40.0, 8.0), trial(-50.0, 8.0)], 10.0), None);
    }
}
