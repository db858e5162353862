//! Totals of a run, and their means.

use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thermo {
    pub step: u64,
    pub time: f64,
    /// kT from the kinetic energy.
    pub temperature: f64,
    /// The energy `U` of the conservative forces.
    pub potential: f64,
    pub kinetic: f64,
    /// The pressure: a third (in two dimensions half) of the trace of `tensor`.
    pub pressure: f64,
    /// The pressure tensor in the order xx, yy, zz, xy, xz, yz, thermostat forces included.
    pub tensor: [f64; 6],
    pub conservative_pressure: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    pub rows: u64,
    pub temperature: f64,
    pub potential: f64,
    pub pressure: f64,
    pub conservative_pressure: f64,
}

/// Sums over thermo rows; a checkpoint holds them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sums {
    rows: u64,
    temperature: f64,
    potential: f64,
    pressure: f64,
    conservative_pressure: f64,
}

impl Sums {
    pub fn add(&mut self, t: &Thermo) {
        self.rows += 1;
        self.temperature += t.temperature;
        self.potential += t.potential;
        self.pressure += t.pressure;
        self.conservative_pressure += t.conservative_pressure;
    }

    pub fn means(&self) -> Option<Means> {
        let count = self.rows as f64;
        (self.rows > 0).then(|| Means {
            rows: self.rows,
            temperature: self.temperature / count,
            potential: self.potential / count,
            pressure: self.pressure / count,
            conservative_pressure: self.conservative_pressure / count,
        })
    }
}
