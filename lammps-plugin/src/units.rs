//! From the units of LAMMPS to those of a model.

use psidpd_core::model::Units;

/// Units in terms of others: mostly one unit of the model in units of LAMMPS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    pub length: f64,
    /// Unit of energy and of virials.
    pub energy: f64,
    pub time: f64,
}

/// Units of <https://docs.lammps.org/units.html> in SI: velocities are in length over time, forces in energy over length.
fn host_units(name: &str) -> Option<Scale> {
    const ANGSTROM: f64 = 1e-10;
    // Energies are per molecule; the constants are exact since 2019, as is the electronvolt.
    const KILOCALORIE_PER_MOLE: f64 = 4184.0 / 6.022_140_76e23;
    const ELECTRONVOLT: f64 = 1.602_176_634e-19;
    match name {
        "real" => Some(Scale { length: ANGSTROM, energy: KILOCALORIE_PER_MOLE, time: 1e-15 }),
        "metal" => Some(Scale { length: ANGSTROM, energy: ELECTRONVOLT, time: 1e-12 }),
        "si" => Some(Scale::ONE),
        _ => None,
    }
}

impl Scale {
    /// The simulation uses the units of the model.
    pub const ONE: Scale = Scale { length: 1.0, energy: 1.0, time: 1.0 };

    /// The scale of a model in a simulation in `units NAME`, or the reason why there is none.
    pub fn new(name: &str, units: Option<Units>) -> Result<Scale, String> {
        if name == "lj" {
            return Ok(Scale::ONE);
        }
        let Some(host) = host_units(name) else {
            return Err(format!("a model works in units lj, real, metal and si, found 'units {name}'"));
        };
        let Some(Units { length, mass, energy }) = units else {
            return Err(format!(
                "'units {name}' needs a model that says what its numbers stand for: add a table [units] with length, \
                 mass and energy in SI, or use 'units lj'"
            ));
        };
        let time = length * (mass / energy).sqrt();
        Ok(Scale { length: length / host.length, energy: energy / host.energy, time: time / host.time })
    }

    /// Whether all units are equal, so that nothing is converted.
    pub fn is_one(&self) -> bool {
        *self == Scale::ONE
    }

    pub fn velocity(&self) -> f64 {
        self.length / self.time
    }

    pub fn force(&self) -> f64 {
        self.energy / self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Argon: 120 K, 3.4 Å, 39.948 g/mol has a unit of time of 2.16 ps.
    #[test]
    fn units_of_argon() {
        let units = Units { length: 3.405e-10, mass: 6.6335e-26, energy: 1.6540e-21 };
        let real = Scale::new("real", Some(units)).unwrap();
        assert!((real.length - 3.405).abs() < 1e-9 && (real.time / 2156.0 - 1.0).abs() < 1e-3, "{real:?}");
        assert!((real.energy / 0.23806 - 1.0).abs() < 1e-3, "{real:?}");
        let metal = Scale::new("metal", Some(units)).unwrap();
        assert!((metal.time / 2.156 - 1.0).abs() < 1e-3 && (metal.energy / 0.010323 - 1.0).abs() < 1e-3);
        let si = Scale::new("si", Some(units)).unwrap();
        assert_eq!((si.length, si.energy), (units.length, units.energy));
        assert_eq!(Scale::new("lj", None), Ok(Scale::ONE));
        assert!(Scale::new("real", None).unwrap_err().contains("[units]"));
        assert!(Scale::new("cgs", Some(units)).unwrap_err().contains("units lj, real, metal and si"));
    }
}
