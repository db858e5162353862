//! What `pareto.json` has.

use super::drift::EnergyDrift;
use super::quantity::{Class, Deviation};
use super::setting::{Host, Setting};
use super::tolerance::Tolerance;
use crate::bench::Spread;
use serde::Serialize;

/// Everything that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Changes when fields change their meaning.
    pub format: u32,
    /// Of psidpd.
    pub version: &'static str,
    /// The processor.
    pub machine: String,
    /// Title of the scene.
    pub scene: String,
    /// Name of the stage that was measured.
    pub stage: String,
    /// Particles.
    pub particles: usize,
    /// kT.
    #[serde(rename = "kT")]
    pub kt: f64,
    /// Δt of the stage.
    pub dt: f64,
    /// Whether temperatures are held against kT; against the reference otherwise.
    pub temperature_is_known: bool,
    /// What errors are held against, with its own: of its temperatures, and in the errors of its values.
    pub reference: Reference,
    /// That of LAMMPS's own style.
    pub lammps_reference: Option<Reference>,
    /// Why LAMMPS, or one of its styles, is not among the points.
    pub left_out: Vec<String>,
    /// Every setting.
    pub points: Vec<Point>,
    /// Energy without thermostat.
    pub drifts: Vec<EnergyDrift>,
    /// What was asked for.
    pub tolerances: Vec<Tolerance>,
    /// The place in `points` of the cheapest setting within these.
    pub cheapest: Option<usize>,
    /// The same among what LAMMPS can run with the plugin.
    pub cheapest_in_lammps: Option<usize>,
    /// The lines of a scene.
    pub scene_lines: Option<String>,
    /// The lines of a LAMMPS script.
    pub lammps_lines: Option<String>,
    /// What LAMMPS cannot express.
    pub lammps_refusal: Option<String>,
}

/// A reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reference {
    /// In words.
    pub what: String,
    /// Δt.
    pub dt: f64,
    /// Samples.
    pub samples: u64,
    /// Simulated time.
    pub time: f64,
    /// Its values; errors of the temperatures where these are known.
    pub values: Vec<Deviation>,
}

/// One setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Who.
    pub host: Host,
    /// How a step is made.
    pub integrator: String,
    /// Δt.
    pub dt: f64,
    /// In what pairs are computed.
    pub precision: String,
    /// Threads.
    pub threads: usize,
    /// Wall seconds for a unit of simulated time, over the rounds; nothing where it is unstable.
    pub cost: Option<Spread>,
    /// Samples.
    pub samples: u64,
    /// Simulated time that errors are from.
    pub time: f64,
    /// Errors.
    pub errors: Vec<Deviation>,
    /// Why it has none.
    pub unstable: Option<String>,
    /// For which kinds it is on the front: nothing is cheaper with a smaller error.
    pub front: Vec<Class>,
    /// Its setting.
    #[serde(skip)]
    pub setting: Setting,
}

impl Point {
    /// The largest error of a kind, as it is shown.
    pub fn error(&self, class: Class) -> Option<&Deviation> {
        self.errors.iter().filter(|d| d.class == class).max_by(|a, b| a.shown().total_cmp(&b.shown()))
    }

    /// Whether all errors of a kind are within a bound, as far as is known; `None` if none was measured.
    pub fn is_within(&self, tolerance: &Tolerance) -> Option<bool> {
        let bound = self.errors.iter().filter(|d| d.class == tolerance.class).map(Deviation::bound);
        bound.reduce(f64::max).map(|bound| bound <= tolerance.bound)
    }

    /// In words.
    pub fn name(&self) -> String {
        let who = match self.host {
            Host::Native => "native",
            Host::Plugin => "plugin",
            Host::Lammps => "lammps",
        };
        format!("{who}, {}", self.integrator)
    }
}
