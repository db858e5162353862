//! File formats: LAMMPS's data files, dumps and tables, extended XYZ, GSD, VTK, and the description in the folder of a run.
//!
//! This crate does not depend on how a run is made. A writer is a function of one [`Frame`] and has no memory between
//! frames, so a file that was cut at the end of a frame can be continued; a [`GsdFile`] keeps its number of frames. A
//! [`Configuration`] is a frame that was read from a LAMMPS data file, a LAMMPS dump, an extended XYZ file or psidpd's own GSD.

pub mod about;
mod configuration;
pub mod data;
pub mod dump;
mod error;
pub mod files;
mod frame;
mod gsd;
pub mod memory;
mod open;
mod rows;
pub mod setfl;
pub mod text;
mod vtk;
mod xyz;

pub use about::{About, AboutDensity, AboutStage, Expected, THERMO};
pub use configuration::{Configuration, domain};
pub use data::DataFile;
pub use error::{FormatError, PathError};
pub use frame::Frame;
pub use gsd::GsdFile;
pub use vtk::{Grid, write_vti, write_vtp};
pub use xyz::{read_xyz, write_xyz};
