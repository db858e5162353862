//! `about.json`: a description of a run, and of the columns of its series.

use super::FormatError;
use crate::files::{PathError, read_json_if_there, replace_inside};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A description of a run for readers of its folder: names, units, conventions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The program that wrote the folder, with its version.
    pub program: String,
    pub title: String,
    pub model: String,
    pub dimensions: usize,
    /// Names of the species; LAMMPS type k is the k-th species.
    pub species: Vec<String>,
    pub masses: Vec<f64>,
    pub densities: Vec<AboutDensity>,
    #[serde(rename = "kT")]
    pub kt: f64,
    pub seed: u64,
    /// The precision of the pair forces; empty in files that do not say it.
    #[serde(default)]
    pub precision: String,
    /// The processor of the steps, `cpu` or `gpu:N`; empty in files that do not say it.
    #[serde(default)]
    pub device: String,
    pub box_origin: [f64; 3],
    /// The three edge vectors of the box. In two dimensions the third has length 1.
    pub box_edges: [[f64; 3]; 3],
    pub box_periodic: [bool; 3],
    pub stages: Vec<AboutStage>,
    pub units: String,
    pub thermo: Vec<Column>,
    /// Predictions of theory and published values for this fluid, to compare with the measured values.
    #[serde(default)]
    pub expected: Vec<Expected>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// The name is that in the results of a run: `pressure`, `liquid`, `vapour`, `tension`, `width`.
    pub name: String,
    pub mean_field: Option<f64>,
    /// The published value for this kT and its error.
    pub published: Option<[f64; 2]>,
}

/// A weighted local density of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AboutDensity {
    pub name: String,
    pub kernel: String,
    /// The distance at which the weight function vanishes.
    pub range: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AboutStage {
    pub name: String,
    /// The number of the step before the first step of the stage.
    pub begin: u64,
    pub end: u64,
    pub dt: f64,
    #[serde(rename = "kT")]
    pub kt: f64,
    /// True if dissipative and random forces act.
    pub thermostat: bool,
    /// True if body forces or moving walls drive a flow; false in files that do not say it.
    #[serde(default)]
    pub body_forces: bool,
    pub integrator: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// The name in the header of the file.
    pub name: String,
    pub title: String,
    /// The unit in terms of the length, energy and mass of the model; empty for a pure number.
    pub unit: String,
}

/// Name, meaning and unit of the columns that `thermo.csv` can have.
pub const THERMO: [(&str, &str, &str); 12] = [
    ("step", "number of the step", ""),
    ("time", "time since the start of the run", "length (mass/energy)^(1/2)"),
    ("temperature", "kT from the kinetic energy, over d(N − 1) degrees of freedom", "energy"),
    ("potential", "potential energy U = Σ ψ + Σ φ of the whole system", "energy"),
    ("kinetic", "kinetic energy ½ Σ m v² of the whole system", "energy"),
    ("pressure", "pressure: trace of the tensor over d, thermostat forces included", "energy/length^d"),
    ("pxx", "pressure tensor (Σ m v v + W)/V, xx", "energy/length^d"),
    ("pyy", "pressure tensor, yy", "energy/length^d"),
    ("pzz", "pressure tensor, zz", "energy/length^d"),
    ("pxy", "pressure tensor, xy", "energy/length^d"),
    ("pxz", "pressure tensor, xz", "energy/length^d"),
    ("pyz", "pressure tensor, yz", "energy/length^d"),
];

pub const UNITS: &str = "reduced: length, energy and mass are those of the model file";

impl About {
    pub const NAME: &str = "about.json";

    pub fn write(&self, folder: &Path) -> Result<(), FormatError> {
        let path = folder.join(About::NAME);
        let text = serde_json::to_string_pretty(self).map_err(|e| PathError::at("write", &path)(e.into()))?;
        Ok(replace_inside(&path, (text + "\n").as_bytes(), true)?)
    }

    /// The first value that no run can have, for another program may have written the file.
    fn fault(&self) -> Option<String> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let size = self.box_origin.iter().chain(self.box_edges.iter().flatten());
        if !(2..=3).contains(&self.dimensions) {
            Some(format!("dimensions is {}, and a fluid has 2 or 3", self.dimensions))
        } else if self.species.is_empty() || self.masses.len() != self.species.len() {
            Some(format!("there are {} species and {} masses", self.species.len(), self.masses.len()))
        } else if !self.densities.iter().all(|d| positive(d.range)) {
            Some("the range of a density is not a positive number".into())
        } else if !size.into_iter().all(|x| x.abs() < 1e100) || !positive(self.volume()) {
            Some("the box has no volume".into())
        } else {
            None
        }
    }

    /// The volume of the box; in two dimensions the area.
    pub fn volume(&self) -> f64 {
        let [a, b, c] = self.box_edges;
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (0..3).map(|k| a[k] * cross[k]).sum()
    }

    /// Reads `about.json` of a folder; `None` if the file does not exist.
    pub fn read(folder: &Path) -> Result<Option<About>, FormatError> {
        let path = folder.join(About::NAME);
        let Some(about) = read_json_if_there::<About>(&path)? else { return Ok(None) };
        match about.fault() {
            Some(message) => Err(FormatError::content(&path)(message)),
            None => Ok(Some(about)),
        }
    }
}
