//! File formats: LAMMPS's data files, dumps and tables, extended XYZ, and what a run's folder tells of itself.
//!
//! Nothing here knows how a run is made. Writers are functions of one [`Frame`] without memory between frames, so that a
//! file that was cut back to the end of a frame can be continued. [`Configuration`] is a frame read from a file, of
//! whichever of the formats that psidpd writes.

pub mod about;
mod configuration;
pub mod data;
pub mod dump;
mod error;
pub mod files;
mod frame;
pub mod memory;
mod open;
pub mod setfl;
pub mod text;
mod xyz;

pub use about::{About, AboutDensity, AboutStage, Expected, THERMO};
pub use configuration::Configuration;
pub use data::DataFile;
pub use error::FormatError;
pub use files::WriteError;
pub use frame::Frame;
pub use open::Which;
pub use xyz::{read_xyz, write_xyz};
