use super::{Liquid, Options, Substance};
use serde::Serialize;

/// Boltzmann's constant, J/K, and Avogadro's, 1/mol: exact.
pub const BOLTZMANN: f64 = 1.380649e-23;
pub const AVOGADRO: f64 = 6.02214076e23;

/// The units of a model in SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Units {
    /// r_c, m.
    pub length: f64,
    /// kT, J.
    pub energy: f64,
    pub mass: f64,
    /// r_c √(m/kT), s.
    pub time: f64,
    /// kT/r_c³, Pa.
    pub pressure: f64,
    /// kT/r_c², N/m.
    pub tension: f64,
}

impl Units {
    /// With `options.density` particles of the liquid in r_c³.
    pub fn new(substance: &Substance, liquid: &Liquid, options: &Options) -> Units {
        let volume = options.density * options.molecules / (liquid.density * AVOGADRO);
        let length = volume.cbrt();
        let energy = BOLTZMANN * options.temperature;
        let mass = options.molecules * substance.molar_mass / AVOGADRO;
        Units {
            length,
            energy,
            mass,
            time: length * (mass / energy).sqrt(),
            pressure: energy / volume,
            tension: energy / (length * length),
        }
    }
}
