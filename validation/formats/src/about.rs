//! `about.json`: what was run, and what the columns of its series are.

use super::FormatError;
use crate::files::write_atomically;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a run is, for whoever opens its folder: names, units, conventions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// What wrote the folder, with its version.
    pub program: String,
    /// Title of the scene.
    pub title: String,
    /// Title of the model.
    pub model: String,
    /// 2 or 3.
    pub dimensions: usize,
    /// Names of the species; LAMMPS type k is the k-th.
    pub species: Vec<String>,
    /// Mass of each species.
    pub masses: Vec<f64>,
    /// The weighted local densities of the model.
    pub densities: Vec<AboutDensity>,
    /// kT of the scene.
    #[serde(rename = "kT")]
    pub kt: f64,
    /// Seed of the initial state and of the noise.
    pub seed: u64,
    /// In what the forces of pairs were computed; empty if it is not told.
    #[serde(default)]
    pub precision: String,
    /// Corner of the box.
    pub box_origin: [f64; 3],
    /// The three edge vectors of the box. In two dimensions the third is a unit.
    pub box_edges: [[f64; 3]; 3],
    /// Which directions repeat.
    pub box_periodic: [bool; 3],
    /// The stages in order.
    pub stages: Vec<AboutStage>,
    /// What units the numbers are in.
    pub units: String,
    /// The columns of `thermo.csv`.
    pub thermo: Vec<Column>,
    /// What theory and literature say of the fluid, to be put beside what is measured.
    #[serde(default)]
    pub expected: Vec<Expected>,
}

/// What is known of a quantity before it is measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// As in the results of a run: `pressure`, `liquid`, `vapour`, `tension`, `width`.
    pub name: String,
    /// What mean field says.
    pub mean_field: Option<f64>,
    /// What is published for this kT: value and error.
    pub published: Option<[f64; 2]>,
}

/// A weighted local density of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AboutDensity {
    /// Its name.
    pub name: String,
    /// Its weight function.
    pub kernel: String,
    /// Where that vanishes, a length.
    pub range: f64,
}

/// A stage of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AboutStage {
    /// Its name.
    pub name: String,
    /// The number of the step it starts from.
    pub begin: u64,
    /// The number of its last step.
    pub end: u64,
    /// Δt.
    pub dt: f64,
    /// kT.
    #[serde(rename = "kT")]
    pub kt: f64,
    /// Whether dissipative and random forces act.
    pub thermostat: bool,
    /// How a step is made.
    pub integrator: String,
}

/// A column of a series.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Its name in the header of the file.
    pub name: String,
    /// What it is, in words.
    pub title: String,
    /// Its unit, in terms of the length, energy and mass of the model; empty for a pure number.
    pub unit: String,
}

/// Name, meaning and unit of what `thermo.csv` can have.
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

/// What every number of a run is in.
pub const UNITS: &str = "reduced: length, energy and mass are those of the model file";

impl About {
    /// Writes `about.json` into the folder of a run.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), FormatError> {
        let path = folder.join("about.json");
        match serde_json::to_string_pretty(self) {
            Ok(text) => Ok(write_atomically(path, (text + "\n").as_bytes())?),
            Err(cause) => Err(FormatError::Json { path, cause }),
        }
    }

    /// What no run can have, if there is any of it: others may have written the file.
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

    /// Of the box; its area in two dimensions.
    pub fn volume(&self) -> f64 {
        let [a, b, c] = self.box_edges;
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (0..3).map(|k| a[k] * cross[k]).sum()
    }

    /// Reads `about.json` of a folder; `None` if there is none.
    ///
    /// # Errors
    /// A file that cannot be read, or is no such description.
    pub fn read(folder: &Path) -> Result<Option<About>, FormatError> {
        let path = folder.join("about.json");
        match std::fs::read_to_string(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(FormatError::read(&path)(e)),
            Ok(text) => {
                let about: About = match serde_json::from_str(&text) {
                    Ok(about) => about,
                    Err(cause) => return Err(FormatError::Json { path, cause }),
                };
                match about.fault() {
                    Some(message) => Err(FormatError::Content { path, message }),
                    None => Ok(Some(about)),
                }
            }
        }
    }
}
