//! Warren's fluid with the pressures of a liquid.

use super::{Liquid, Options, Substance, Units};
use crate::ExperimentError;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Coefficients of `p = ρ + (π/30) A ρ² + b₁ρ³ + b₂ρ⁴ + b₃ρ⁵` in reduced units: pressure and slope of the saturated
/// liquid exactly, and of the compressed liquid at its highest density the pressure.
pub fn coefficients(
    liquid: &Liquid,
    units: &Units,
    density: f64,
    attraction: f64,
) -> Result<[f64; 3], ExperimentError> {
    let rest = |x: f64, p: f64| p - x - PI / 30.0 * attraction * x * x;
    let slope = 1.0 / (liquid.compressibility * units.pressure * density);
    let Some((compressed, p)) = liquid.compressed.last() else {
        return Err(ExperimentError::Equation("no pressures of the compressed liquid".into()));
    };
    let x = density * compressed / liquid.density;
    let row = |x: f64| [x.powi(3), x.powi(4), x.powi(5)];
    let change = |x: f64| [3.0 * x * x, 4.0 * x.powi(3), 5.0 * x.powi(4)];
    let [first, second, third] = [row(density), change(density), row(x)];
    let matrix = Matrix3::from_row_slice(&[first, second, third].concat());
    let wanted = Vector3::new(
        rest(density, liquid.pressure / units.pressure),
        slope - 1.0 - PI / 15.0 * attraction * density,
        rest(x, p / units.pressure),
    );
    let found = matrix.lu().solve(&wanted).filter(|b| b.iter().all(|b| b.is_finite()));
    found
        .map(|b| [b[0], b[1], b[2]])
        .ok_or_else(|| ExperimentError::Equation("its pressures cannot be fitted".into()))
}

/// The model file, without corrected density.
pub fn model(
    substance: &Substance,
    liquid: &Liquid,
    units: &Units,
    options: &Options,
    attraction: f64,
    command: &str,
) -> Result<String, ExperimentError> {
    let [b1, b2, b3] = coefficients(liquid, units, options.density, attraction)?;
    Ok(format!(
        "# {name} at {t} K, {molecules} molecules to a particle, by\n#   {command}\n\
         # Equation of state: PC-SAFT, parameters of {source}.\n\
         # Units, at kT = 1: length {length:e} m, energy {energy:e} J, mass {mass:e} kg, time {time:e} s,\n\
         # pressure {pressure:e} Pa, surface tension {tension:e} N/m.\n\
         # The liquid has density {rho} here, which is {real:.2} kg/m3. Below it the pressure is an extrapolation.\n\
         # gamma = 4.5 is a thermostat, not the viscosity of the liquid.\n\
         title     = \"{name} at {t} K\"\nreference = \"{source}\"\nspecies   = [\"F\"]\n\n\
         [parameters]\nA  = {attraction:?}\nb1 = {b1:?}\nb2 = {b2:?}\nb3 = {b3:?}\nrd = {rd:?}\n\n\
         [density.n]\nkernel = \"quadratic\"\nrange  = \"rd\"\n\n\
         [excess_free_energy.F]\n\
         # The pressure less that of the pair attraction in mean field.\n\
         pressure = \"rho*kT + b1*rho^3 + b2*rho^4 + b3*rho^5\"\n\n\
         [[pair]]\nbetween  = [\"F\", \"F\"]\nform     = \"soft\"\nstrength = \"A\"\nrange    = 1.0\n\n\
         [[thermostat]]\ngamma = 4.5\nrange = 1.0\n",
        name = substance.name,
        source = substance.source,
        t = options.temperature,
        molecules = options.molecules,
        length = units.length,
        energy = units.energy,
        mass = units.mass,
        time = units.time,
        pressure = units.pressure,
        tension = units.tension,
        rho = options.density,
        real = liquid.density * substance.molar_mass,
        rd = options.range,
    ))
}

#[cfg(test)]
mod tests {
    use super::super::units::BOLTZMANN;
    use super::*;
    use crate::bulk::Sampling;
    use psidpd_core::model::Model;
    use psidpd_core::theory::MeanField;

    /// Figures of decane at 298.15 K from PC-SAFT.
    fn decane() -> (Substance, Liquid, Options) {
        let liquid = Liquid {
            density: 5064.16,
            pressure: 182.0,
            compressibility: 1.4854e-9,
            tension: 0.023195,
            compressed: vec![(5064.16 * 1.1, 95.49e6), (5064.16 * 1.2, 260.9e6)],
        };
        let options = Options {
            temperature: 298.15,
            molecules: 1.0,
            density: 6.0,
            range: 0.75,
            tolerance: 0.05,
            sampling: Sampling::SHORT,
        };
        (Substance::find("decane").unwrap(), liquid, options)
    }

    /// Six molecules of decane take 6/(5064.16 N_A) = 1.96740e-27 m³; the rest by hand from that and kT = 4.11641e-21 J.
    #[test]
    fn units_are_those_of_si() {
        let (substance, liquid, options) = decane();
        let units = Units::new(&substance, &liquid, &options);
        let close =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        close(units.length, 1.25303e-9);
        close(units.pressure, 2.09231e6);
        close(units.tension, 2.62176e-3);
        // The target tension of the model, in its own unit.
        close(liquid.tension / units.tension, 8.84711);
        // The file states the same tension.
        let text = model(&substance, &liquid, &units, &options, -40.0, "psidpd").unwrap();
        assert!(text.contains("surface tension 2.6217") && text.contains("e-3 N/m"), "{text}");
    }

    #[test]
    fn mean_field_has_the_pressures_and_the_compressibility_of_the_liquid() {
        let (substance, liquid, options) = decane();
        let units = Units::new(&substance, &liquid, &options);
        assert!((units.length * 1e9 - 1.253).abs() < 0.001, "{units:?}");
        assert!((units.energy / (BOLTZMANN * 298.15) - 1.0).abs() < 1e-12);
        for attraction in [-30.0, -50.0] {
            let text = model(&substance, &liquid, &units, &options, attraction, "psidpd").unwrap();
            let theory = MeanField::new(&Model::parse("m.toml", &text).unwrap().at(1.0).unwrap()).unwrap();
            let si = |rho: f64| theory.pressure(&[rho]) * units.pressure;
            assert!((si(6.0) - 182.0).abs() < 1e3, "{}", si(6.0));
            assert!((si(7.2) / 260.9e6 - 1.0).abs() < 1e-6, "{}", si(7.2));
            // What was not fitted, to what a polynomial can.
            assert!((si(6.6) / 95.49e6 - 1.0).abs() < 0.05, "{}", si(6.6));
            let modulus = 6.0 * theory.pressure_slope(&[6.0]) * units.pressure;
            assert!((modulus * 1.4854e-9 - 1.0).abs() < 1e-6, "{modulus}");
        }
    }
}
