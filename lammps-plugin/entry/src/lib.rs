//! The file that LAMMPS loads. It needs nothing but C when it is loaded, so that any LAMMPS can load it and be told for
//! which one the styles were built; those are in a second file beside it, which needs the C++ of that LAMMPS.
//!
//! - `entry`: `lammpsplugin_init`, which `plugin load` calls, and `psidpd_register`, for a LAMMPS without plugins;
//! - `styles`: loads the second file, whose contract is `table`;
//! - `version`: LAMMPS's versions in words;
//! - `whole`: whether the second file has all its bytes.

#[cfg(lammps_host)]
mod entry;
#[cfg(lammps_host)]
mod styles;
#[cfg(lammps_host)]
mod table;
#[cfg(any(lammps_host, test))]
mod version;
#[cfg(lammps_host)]
mod whole;
