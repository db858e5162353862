//! Observables: read, never drive.
//!
//! [`read`] reads what a scene asks for; [`Observers`] measures it as the run goes, each observable a
//! [`meter`]; [`Observation`]s come out, with error bars. The rest are functions on recorded series and
//! frames. All quantities are in the reduced units of the simulation (length r_c, energy k_B T, mass m),
//! and no function panics, whatever it is given.

pub mod configurational;
pub mod drift;
pub mod edges;
pub mod flux;
pub mod frame;
pub mod keys;
pub mod meter;
pub mod observation;
pub mod observers;
pub mod profile;
pub mod request;
pub mod series;
pub mod statistics;
pub mod surface_tension;
pub mod young_laplace;

pub use drift::{Drift, DriftError, drift};
pub use observation::{Abscissa, Column, Kind, Observation, write_csv, write_json};
pub use observers::Observers;
pub use profile::{DensityProfile, ProfileAccumulator, ProfileError, interface_width};
pub use request::{Observe, Request, StageNames, read};
pub use series::{Measured, Series};
pub use statistics::{Comparison, Estimate, StatisticsError, difference, estimate, threshold};
pub use surface_tension::{TensionError, tension_series};

#[cfg(test)]
mod balance;
#[cfg(test)]
mod tests;
