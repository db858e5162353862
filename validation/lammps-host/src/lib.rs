//! LAMMPS as a host: installs it, runs it as a program or within this process, builds the plugin for it, and
//! writes scenes and scripts for it.
//!
//! [`install()`] puts a pinned LAMMPS into the build folder; [`Host`] has the paths of an installed LAMMPS;
//! [`Lammps`] runs one within this process; [`plugin`] builds psidpd's pair styles for a host; [`export`]
//! writes scenes and models for it; [`convert`] rewrites scripts for the built-in `mdpd`.

#[macro_use]
mod library;

mod bindings;
pub mod convert;
mod error;
pub mod export;
mod host;
mod install;
mod instance;
mod made_from;
mod mpi;
pub mod plugin;
mod record;
mod trust;

pub use error::LammpsError;
pub use host::{Host, HostKind, HostVersion, RunOutput};
pub use install::{base_dir, install, venv_dir};
pub use instance::{Lammps, SimulationBox};
