//! LAMMPS as a host: installing it, running it as a program or in this process, building the plugin for it, and writing
//! scenes and scripts for it.
//!
//! [`install()`] puts a pinned LAMMPS into the build folder; [`Host`] says where the parts of an installed LAMMPS are;
//! [`Lammps`] runs one inside this process; [`plugin`] builds psidpd's pair styles for a host; [`export`] writes scenes
//! and models for it; [`convert`] rewrites scripts for the built-in `mdpd`.

#[allow(dead_code, unsafe_op_in_unsafe_fn, clippy::all, clippy::undocumented_unsafe_blocks)]
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

pub use error::LammpsError;
pub use host::{Host, HostKind, HostVersion, RunOutput};
pub use install::{base_dir, install, venv_dir};
pub use instance::{Lammps, SimulationBox};
