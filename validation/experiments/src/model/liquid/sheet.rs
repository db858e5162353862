//! What a data sheet says of a liquid, the size of a particle, and what both are in the units of a model.

use super::error::LiquidError;
use psidpd_core::document::{Document, FileError};
use psidpd_core::model::Units;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

/// Boltzmann's constant, J/K, and Avogadro's, 1/mol: exact.
pub const BOLTZMANN: f64 = 1.380649e-23;
pub const AVOGADRO: f64 = 6.02214076e23;

/// Particles in r_c³ if nothing else is asked for: 10.6 neighbours within the range of the repulsion.
pub const USUAL_DENSITY: f64 = 6.0;

/// ∂p/∂ρ over kT, and the tension in kT/r_c², of a liquid whose unit of energy is free: those of Warren's set 6, nearly.
const FREE_STIFFNESS: f64 = 45.0;
const FREE_TENSION: f64 = 7.5;

/// A number of a data sheet: its key, its unit, and what a liquid may have.
pub struct Entry {
    pub key: &'static str,
    pub unit: &'static str,
    within: [f64; 2],
}

const fn entry(key: &'static str, unit: &'static str, low: f64, high: f64) -> Entry {
    Entry { key, unit, within: [low, high] }
}

pub const ENTRIES: [Entry; 15] = [
    entry("density", "kg/m3", 20.0, 3e4),
    entry("tension", "N/m", 1e-6, 5.0),
    entry("compressibility", "1/Pa", 1e-12, 1e-6),
    entry("sound_speed", "m/s", 20.0, 2e4),
    entry("viscosity", "Pa s", 1e-6, 1e4),
    entry("temperature", "K", 1.0, 1e4),
    entry("molar_mass", "kg/mol", 1e-3, 1e3),
    entry("molecules", "", 1e-2, 1e15),
    entry("rc", "m", 1e-10, 1.0),
    entry("drop", "m", 1e-9, 10.0),
    entry("particles", "", 100.0, 1e12),
    entry("number_density", "1/r_c3", 3.0, 12.0),
    entry("length", "m", 1e-10, 1e3),
    entry("velocity", "m/s", 1e-9, 1e5),
    entry("gravity", "m/s2", 1e-6, 1e15),
];

/// The numbers of a data sheet by their keys.
#[derive(Debug, Clone, Default)]
pub struct Entries(BTreeMap<&'static str, f64>);

impl Entries {
    /// # Errors
    /// Fails for a number that no liquid has.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), LiquidError> {
        let Some(entry) = ENTRIES.iter().find(|entry| entry.key == key) else {
            return Err(LiquidError::Unknown(key.to_owned()));
        };
        let [low, high] = entry.within;
        if !(low..=high).contains(&value) {
            return Err(LiquidError::Range { key: entry.key, value, unit: entry.unit, low, high });
        }
        self.0.insert(entry.key, value);
        Ok(())
    }

    pub fn get(&self, key: &str) -> Option<f64> {
        self.0.get(key).copied()
    }

    fn need(&self, key: &'static str, why: &'static str) -> Result<f64, LiquidError> {
        self.get(key).ok_or(LiquidError::Missing { key, why })
    }

    /// Reads a TOML file of such numbers.
    ///
    /// # Errors
    /// Fails for other keys, and for numbers that no liquid has.
    pub fn read(path: &Path) -> Result<Entries, FileError> {
        let document = Document::open(path)?;
        let root = document.root();
        root.only(ENTRIES.iter().map(|entry| entry.key))?;
        let mut all = Entries::default();
        for entry in &ENTRIES {
            if let Some(value) = root.get(entry.key) {
                all.set(entry.key, value.number()?).map_err(|wrong| value.error(wrong.to_string()))?;
            }
        }
        Ok(all)
    }
}

/// Goals in the units of a model, at kT = 1; `None` is free.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Goals {
    /// Particles in r_c³.
    pub density: f64,
    /// ∂p/∂ρ at constant temperature.
    pub stiffness: Option<f64>,
    pub tension: Option<f64>,
    pub viscosity: Option<f64>,
}

/// Largest relative differences.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tolerance {
    pub density: f64,
    pub compressibility: f64,
    pub tension: f64,
    pub viscosity: f64,
}

pub const TOLERANCE: Tolerance =
    Tolerance { density: 0.005, compressibility: 0.03, tension: 0.02, viscosity: 0.05 };

/// A liquid, its particles, and its goals.
#[derive(Debug, Clone)]
pub struct Liquid {
    pub name: String,
    pub entries: Entries,
    /// kg/m³.
    pub density: f64,
    /// 1/Pa, if it is a goal.
    pub compressibility: Option<f64>,
    pub units: Units,
    pub goals: Goals,
}

/// The unit of time.
pub fn time(units: &Units) -> f64 {
    units.length * (units.mass / units.energy).sqrt()
}

impl Liquid {
    /// # Errors
    /// Fails if the size of a particle or a unit is not stated, or stated twice.
    pub fn new(name: &str, entries: &Entries) -> Result<Liquid, LiquidError> {
        let density = entries.need("density", "without it particles have no mass")?;
        let number = entries.get("number_density").unwrap_or(USUAL_DENSITY);
        let volume = particle_volume(entries, density, number)?;
        let compressibility = match (entries.get("compressibility"), entries.get("sound_speed")) {
            (Some(_), Some(_)) => {
                return Err(LiquidError::Twice("compressibility", "sound_speed"));
            }
            (Some(kappa), None) => Some(kappa),
            (None, speed) => speed.map(|c| 1.0 / (density * c * c)),
        };
        let length = (number * volume).cbrt();
        let stiffness = |energy: f64| Some(volume / (energy * compressibility?));
        let tension = |energy: f64| Some(entries.get("tension")? * length * length / energy);
        let energy = match entries.get("temperature") {
            Some(kelvin) => BOLTZMANN * kelvin,
            None => [stiffness(FREE_STIFFNESS), tension(FREE_TENSION)].into_iter().flatten().next().ok_or(
                LiquidError::Missing { key: "temperature", why: "without it, and without tension and compressibility, no number sets the unit of energy" },
            )?,
        };
        let units = Units { length, mass: density * volume, energy };
        let viscosity = |eta: f64| eta * length.powi(3) / (energy * time(&units));
        let goals = Goals {
            density: number,
            stiffness: stiffness(energy),
            tension: tension(energy),
            viscosity: entries.get("viscosity").map(viscosity),
        };
        Ok(Liquid { name: name.to_owned(), entries: entries.clone(), density, compressibility, units, goals })
    }

    /// Molecules in a particle, if their mass is known.
    pub fn molecules(&self) -> Option<f64> {
        Some(self.units.mass * AVOGADRO / self.entries.get("molar_mass")?)
    }

    /// The volume of a particle, m³.
    pub fn volume(&self) -> f64 {
        self.units.length.powi(3) / self.goals.density
    }

    /// Factors from the units of the model to SI.
    pub fn pressure_unit(&self) -> f64 {
        self.units.energy / self.units.length.powi(3)
    }

    pub fn tension_unit(&self) -> f64 {
        self.units.energy / self.units.length.powi(2)
    }

    pub fn viscosity_unit(&self) -> f64 {
        self.pressure_unit() * time(&self.units)
    }
}

/// The volume of a particle from the one size that is stated.
fn particle_volume(entries: &Entries, density: f64, number: f64) -> Result<f64, LiquidError> {
    let sizes = ["molecules", "rc", "drop"];
    let stated: Vec<&'static str> = sizes.into_iter().filter(|key| entries.get(key).is_some()).collect();
    match stated[..] {
        ["molecules"] => {
            let mass = entries.need("molar_mass", "a number of molecules has no volume without it")?;
            Ok(entries.need("molecules", "")? * mass / (density * AVOGADRO))
        }
        ["rc"] => Ok(entries.need("rc", "")?.powi(3) / number),
        ["drop"] => {
            let particles =
                entries.need("particles", "a drop says how large particles are only with their number")?;
            Ok(PI / 6.0 * entries.need("drop", "")?.powi(3) / particles)
        }
        [first, second, ..] => Err(LiquidError::Twice(first, second)),
        _ => Err(LiquidError::NoSize),
    }
}
