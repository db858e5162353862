//! Totals of a run, and their means.

use serde::{Deserialize, Serialize};

/// One row of totals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thermo {
    /// Number of the step.
    pub step: u64,
    /// Time since the start of the run.
    pub time: f64,
    /// kT from the kinetic energy.
    pub temperature: f64,
    /// `U`.
    pub potential: f64,
    /// `½ Σ m v²`.
    pub kinetic: f64,
    /// A third (in two dimensions half) of the trace of `tensor`.
    pub pressure: f64,
    /// xx, yy, zz, xy, xz, yz; thermostat forces included.
    pub tensor: [f64; 6],
    /// The pressure with conservative forces alone.
    pub conservative_pressure: f64,
}

/// Plain means over thermo rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    /// How many rows.
    pub rows: u64,
    /// Of kT.
    pub temperature: f64,
    /// Of the potential energy.
    pub potential: f64,
    /// Of the pressure.
    pub pressure: f64,
    /// Of the pressure of conservative forces.
    pub conservative_pressure: f64,
}

/// Sums over thermo rows, from which their means come: a checkpoint can hold them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sums {
    rows: u64,
    temperature: f64,
    potential: f64,
    pressure: f64,
    conservative_pressure: f64,
}

impl Sums {
    /// Counts another row.
    pub fn add(&mut self, t: &Thermo) {
        self.rows += 1;
        self.temperature += t.temperature;
        self.potential += t.potential;
        self.pressure += t.pressure;
        self.conservative_pressure += t.conservative_pressure;
    }

    /// The means; `None` without rows.
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
