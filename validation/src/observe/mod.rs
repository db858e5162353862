//! Observables: read, never drive.
//!
//! Pure functions on recorded series and frames. All quantities are in the
//! reduced units of the simulation (length r_c, energy k_B T, mass m), and no
//! function panics, whatever it is given.

pub mod drift;
pub mod profile;
pub mod statistics;
pub mod surface_tension;

pub use drift::{Drift, DriftError, drift};
pub use profile::{DensityProfile, ProfileAccumulator, ProfileError, interface_width};
pub use statistics::{Comparison, Estimate, StatisticsError, difference, estimate, threshold};
pub use surface_tension::{TensionError, tension_series};
