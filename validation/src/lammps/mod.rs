//! Driving LAMMPS: putting it in place, running it as a program or in this process, building the plugin for it, and its files.
//!
//! [`install`] puts a pinned LAMMPS into the build folder; [`Host`] says where the parts of an installed LAMMPS are;
//! [`Lammps`] runs one inside this process; [`plugin`] builds psidpd's pair styles for a host; [`data`], [`dump`] and
//! [`setfl`] read and write LAMMPS's file formats; [`convert`] rewrites scripts for the built-in `mdpd`.

#[allow(dead_code, missing_docs, unsafe_op_in_unsafe_fn, clippy::all, clippy::undocumented_unsafe_blocks)]
mod bindings;
pub mod convert;
pub mod data;
pub mod dump;
mod error;
mod host;
mod install;
mod instance;
mod made_from;
mod mpi;
pub mod plugin;
mod record;
pub mod setfl;
pub mod text;

pub use data::DataFile;
pub use error::LammpsError;
pub use host::{Host, HostKind, HostVersion, RunOutput};
pub use install::{base_dir, install, venv_dir};
pub use instance::{Lammps, SimulationBox};
