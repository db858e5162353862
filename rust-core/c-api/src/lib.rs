//! The C interface, declared in `include/psidpd.h`: models and engines behind opaque handles.
//!
//! Every function that can fail returns a [`Status`] and leaves a message in [`psidpd_last_error`]; no
//! panic leaves this module. The computations are in [`psidpd_core::model`] and
//! [`psidpd_core::engine`]; this module checks and converts arguments and results.

#![warn(missing_docs)]

mod arguments;
mod engine;
mod evaluation;
mod model;
mod settings;
mod status;
mod thermostat;
mod version;

pub use engine::*;
pub use evaluation::*;
pub use model::*;
pub use settings::*;
pub use status::{Status, psidpd_last_error};
pub use thermostat::*;
pub use version::*;

#[cfg(test)]
mod tests;
