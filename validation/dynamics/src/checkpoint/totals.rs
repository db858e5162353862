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

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Means {
    pub rows: u64,
    pub temperature: f64,
    pub potential: f64,
    pub pressure: f64,
    pub conservative_pressure: f64,
}

/// Sums over thermo rows; a checkpoint holds them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sums(Means);

impl Sums {
    pub fn add(&mut self, t: &Thermo) {
        self.0.rows += 1;
        self.0.temperature += t.temperature;
        self.0.potential += t.potential;
        self.0.pressure += t.pressure;
        self.0.conservative_pressure += t.conservative_pressure;
    }

    pub fn means(&self) -> Option<Means> {
        let Means { rows, temperature, potential, pressure, conservative_pressure } = self.0;
        let mean = |sum: f64| sum / rows as f64;
        (rows > 0).then(|| Means {
            rows,
            temperature: mean(temperature),
            potential: mean(potential),
            pressure: mean(pressure),
            conservative_pressure: mean(conservative_pressure),
        })
    }
}
