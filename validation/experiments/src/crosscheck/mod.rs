//! The cross-code validation: one fluid in the native runner, in the plugin, in LAMMPS's `mdpd` and as
//! `eam/alloy` tables.
//!
//! - [`forces`]: one configuration in every code;
//! - [`energy`]: energy against time without a thermostat, and the work around a closed loop;
//! - [`equilibrium`]: temperature, pressure, density and energy of a slab in equilibrium;
//! - [`trajectory`]: the same trajectory in both hosts, noise on, on one rank and on two.

pub mod closed_loop;
pub mod codes;
mod conclusion;
pub mod energy;
pub mod equilibrium;
mod error;
pub mod fluids;
pub mod forces;
pub mod jobs;
pub mod start;
pub mod trace;
pub mod trajectory;
mod validate;

pub use error::ValidateError;
pub use validate::machine;
pub use validate::{Options, check_table, validate};

use psidpd_lammps_host::Host;
use psidpd_report::Progress;
use std::path::{Path, PathBuf};

/// What every part of the validation works with.
#[derive(Debug)]
pub struct Context<'a> {
    /// The LAMMPS.
    pub host: &'a Host,
    /// The plugin built for it.
    pub plugin: &'a Path,
    /// A folder for decks and data.
    pub work: PathBuf,
    /// Whether long runs are wanted.
    pub full: bool,
    /// Where progress is shown.
    pub progress: &'a Progress,
}

/// Name, checks, and what a part of the validation adds to the report.
#[derive(Debug, Default)]
pub struct Part {
    /// The checks.
    pub checks: Vec<psidpd_report::Check>,
    /// For the report.
    pub section: psidpd_report::Section,
    /// Named numbers for `results.json`.
    pub values: Vec<(String, serde_json::Value)>,
}
