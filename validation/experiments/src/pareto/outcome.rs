//! What `pareto.json` has.

use super::drift::EnergyDrift;
use super::quantity::{self, Deviation};
use super::setting::Setting;
use super::tolerance::{self, Tolerance, Worst};
use crate::bench::Spread;
use crate::code::Host;
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Changes when fields change their meaning.
    pub format: u32,
    pub version: &'static str,
    pub machine: String,
    pub scene: String,
    pub stage: String,
    pub particles: usize,
    #[serde(rename = "kT")]
    pub kt: f64,
    pub dt: f64,
    /// Whether temperatures are compared with kT; against the reference otherwise.
    pub temperature_is_known: bool,
    /// What errors are compared with, with its own: of its temperatures, and in the errors of its values.
    pub reference: Reference,
    /// What diffusion coefficients and viscosities are compared with, if the reference has no time step.
    pub reference_of_dynamics: Option<Reference>,
    pub lammps_reference: Option<Reference>,
    /// Why LAMMPS, or one of its styles, is not among the points.
    pub left_out: Vec<String>,
    pub points: Vec<Point>,
    pub drifts: Vec<EnergyDrift>,
    /// What was asked for; if nothing was, 1, 2, 5 or 10 % of each quantity, as well as the time resolves it, doubled until a setting is within.
    #[serde(rename = "tolerance", serialize_with = "tolerance::by_name")]
    pub tolerances: Vec<Tolerance>,
    /// Quantities that are not judged, as most points do not resolve the largest of these.
    pub unresolved: Vec<String>,
    /// Standard deviations by which errors are widened before a setting counts as within or beyond, for all looks at all settings.
    pub margin: f64,
    /// Points that may be within and would be cheaper than the cheapest that is; none if the recommendation is decided.
    pub undecided: Vec<usize>,
    pub recommended: Option<Recommended>,
}

/// The cheapest setting within tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recommended {
    /// The place of the recommended setting among the points.
    pub point: usize,
    pub scene: String,
    /// The lines of a LAMMPS script: of the same steps, or of the cheapest that LAMMPS can make.
    pub lammps: Option<String>,
    /// The place of these among the points, if LAMMPS was timed.
    pub point_in_lammps: Option<usize>,
    /// What LAMMPS cannot express of the setting.
    pub lammps_refusal: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reference {
    pub what: String,
    pub dt: Option<f64>,
    pub samples: u64,
    /// Simulated time; in Monte Carlo, sweeps.
    pub time: f64,
    /// The values of the reference; errors of the temperatures where these are known.
    #[serde(serialize_with = "quantity::by_name")]
    pub values: Vec<Deviation>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    /// The median over rounds.
    pub value: f64,
    /// Half of the difference between the slowest round and the fastest.
    pub error: f64,
    pub min: f64,
    pub max: f64,
}

impl Cost {
    /// The cost that rounds of timing give; `None` if there were none.
    pub fn of(rounds: &[f64]) -> Option<Cost> {
        let Spread { min, median, max } = Spread::of(rounds)?;
        Some(Cost { value: median, error: 0.5 * (max - min), min, max })
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    pub code: Host,
    pub integrator: String,
    pub dt: f64,
    pub precision: String,
    pub threads: usize,
    pub cost: Option<Cost>,
    pub samples: u64,
    /// Simulated time that errors are from.
    pub time: f64,
    /// Errors, by quantity: `u` and temperatures in kT, pressures in ρkT, densities in that of the liquid, others relative.
    #[serde(serialize_with = "quantity::by_name")]
    pub errors: Vec<Deviation>,
    /// The error that is most of its tolerance.
    pub worst: Option<Worst>,
    /// Whether the run was made to its end.
    pub stable: bool,
    pub unstable: Option<String>,
    /// Whether nothing is cheaper with a smaller worst error.
    pub front: bool,
    #[serde(skip)]
    pub setting: Setting,
}

impl Point {
    /// Whether all errors are within their bounds, two of their own added, as far as is known; false where nothing was measured
    /// that is bound.
    pub fn is_within(&self, tolerances: &[Tolerance]) -> bool {
        !tolerances.is_empty()
            && tolerances.iter().all(|t| {
                let mut errors = self.errors.iter().filter(|d| t.applies(d)).peekable();
                errors.peek().is_some() && errors.all(|d| d.bound() <= t.bound)
            })
    }

    pub fn name(&self) -> String {
        format!("{}, {}", self.code.name(), self.integrator)
    }
}
